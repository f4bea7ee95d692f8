#include "server/services/query_service.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_registry.h"
#include "map/values/value_query.h"
#include "server/rpc/revision_wait.h"
#include "server/rpc/unary_call.h"
#include "server/services/part_source.h"
#include "wire/answer.h"
#include "wire/geometry.h"
#include "wire/scope.h"

namespace hypermap::server {
namespace {

// Queries up to this size are likely to be answered in less time than a worker needs to wake up,
// and are answered on gRPC's thread.
constexpr double kSmallArea_m2 = 1000.0;
constexpr int kFewNeighbours = 64;
// Checking an area of more vertices than this takes longer than most answers.
constexpr int kFewVertices = 256;

// RESOURCE_EXHAUSTED if a question with an area has so many bytes that it must have more vertices
// than is allowed: parsing it would keep gRPC's thread busy for milliseconds.
absl::Status CheckSize(const grpc::ByteBuffer& request, const Limits& limits) {
  // A vertex takes 16 bytes; the least ring, of three, has 8 bytes besides.
  constexpr size_t kBytesOfVertex = 24;
  // All but the area: the names of layers, above all.
  constexpr size_t kOtherBytes = 256 << 10;
  const auto most =
      kOtherBytes + kBytesOfVertex * static_cast<size_t>(limits.max_question_vertices);
  if (request.Length() <= most) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat("the question has ", request.Length(), " bytes, more than ", most,
                   ": --max_question_vertices is ", limits.max_question_vertices));
}

// Whether the query is answered from the newest snapshot without waiting.
template <typename Request>
bool AsksNewest(const Request& request) {
  const v1::AsOf& as_of = request.as_of();
  return as_of.as_of_case() == v1::AsOf::AS_OF_NOT_SET && as_of.min_revision() == 0;
}

int NumVertices(const v1::Polygon& area) {
  int sum = area.outer().xs_size();
  for (const v1::Ring& hole : area.holes()) sum += hole.xs_size();
  return sum;
}

// Whether the polygon has few vertices and its bounding box at most kSmallArea_m2. False for a
// malformed polygon.
bool IsSmall(const v1::Polygon& area) {
  Box box;
  const v1::Ring& outer = area.outer();
  if (outer.xs_size() != outer.ys_size() || NumVertices(area) > kFewVertices) return false;
  for (int i = 0; i < outer.xs_size(); ++i) box.Extend(Point{outer.xs(i), outer.ys(i)});
  return (box.max.x - box.min.x) * (box.max.y - box.min.y) <= kSmallArea_m2;
}

}  // namespace

QueryService::QueryService(const Facilities& facilities) : facilities_(facilities) {
  SetMessageAllocatorFor_QueryPoint(&point_messages_);
  SetMessageAllocatorFor_QueryNearest(&nearest_messages_);
}

template <typename Request>
absl::StatusOr<AskedRevision> QueryService::Pin(const Request& request) const {
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                            FindMap(facilities_, request.scope()));
  HYPERMAP_ASSIGN_OR_RETURN(const AsOf as_of, wire::DecodeAsOf(request.as_of()));
  return AskedRevision::Find(*session, as_of);
}

template <typename Request, typename Response>
grpc::ServerUnaryReactor* QueryService::AnswerUnary(grpc::CallbackServerContext* context,
                                                    absl::string_view rpc, const Request* request,
                                                    Response* response,
                                                    Answer<Request, Response> answer) const {
  auto* const reactor = new WaitingReactor();
  auto call = std::make_shared<UnaryCall>(facilities_.budgets, context, reactor, rpc,
                                          request->scope().map());
  if (!call->admitted().ok()) {
    call->Finish(call->admitted());
    return reactor;
  }
  reactor->wait().Start(
      facilities_, request->scope(), request->as_of().min_revision(),
      [this, call = std::move(call), request, response, answer] {
        AnswerOn(&facilities_.workers->questions, call,
                 [this, request, response, answer] { return (this->*answer)(*request, response); });
      });
  return reactor;
}

template <typename Request, typename Response>
grpc::ServerUnaryReactor* QueryService::AnswerAtOnce(grpc::CallbackServerContext* context,
                                                     absl::string_view rpc, const Request* request,
                                                     Response* response,
                                                     Answer<Request, Response> answer) const {
  UnaryCall call(facilities_.budgets, context, rpc, request->scope().map());
  if (!call.admitted().ok()) {
    call.Finish(call.admitted());
    return call.reactor();
  }
  const absl::StatusOr<int64_t> items = (this->*answer)(*request, response);
  call.Finish(items.status(), items.value_or(0));
  return call.reactor();
}

template <typename Request, typename Response>
grpc::ServerWriteReactor<grpc::ByteBuffer>* QueryService::Begin(
    StreamedAnswer<Request, Response>* answer) const {
  const Request& request = answer->request();
  if (AsksNewest(request) && IsSmall(request.area())) {
    answer->BeginAtOnce();
  } else {
    answer->BeginAfter(
        [this, &request](RevisionWait& wait, auto done) {
          wait.Start(facilities_, request.scope(), request.as_of().min_revision(), std::move(done));
        },
        NumVertices(request.area()) > kFewVertices);
  }
  return answer;
}

grpc::ServerUnaryReactor* QueryService::QueryPoint(grpc::CallbackServerContext* context,
                                                   const v1::QueryPointRequest* request,
                                                   v1::QueryPointResponse* response) {
  const auto answer = &QueryService::AnswerPoint;
  if (AsksNewest(*request)) return AnswerAtOnce(context, "QueryPoint", request, response, answer);
  return AnswerUnary(context, "QueryPoint", request, response, answer);
}

absl::StatusOr<int64_t> QueryService::AnswerPoint(const v1::QueryPointRequest& request,
                                                  v1::QueryPointResponse* response) const {
  HYPERMAP_ASSIGN_OR_RETURN(const AskedRevision asked, Pin(request));
  if (!request.has_point()) return absl::InvalidArgumentError("point is missing");
  HYPERMAP_ASSIGN_OR_RETURN(const Point point, wire::DecodePoint("point", request.point()));
  const Scope scope = wire::DecodeScope(request.scope());
  HYPERMAP_ASSIGN_OR_RETURN(const SnapshotPtr snapshot,
                            asked.ForPoint(scope, point, request.tolerance_m()));
  HYPERMAP_ASSIGN_OR_RETURN(const std::string frame, asked.ResolveFrame(scope.frame_id));
  const absl::Status status = VisitContentAt(
      *snapshot, scope, point, request.tolerance_m(),
      [response](const LayerPtr& layer, const PlanarTransform& caller_from_layer,
                 const PointContent& content) {
        wire::EncodeLayerContent(*layer, caller_from_layer, content, response->add_layers());
      });
  if (!status.ok()) return status;

  response->set_map(request.scope().map());
  response->set_revision(asked.revision());
  response->set_incarnation(asked.incarnation());
  response->set_frame_id(frame);
  wire::EncodePoint(point, response->mutable_point());
  return response->layers_size();
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* QueryService::QueryArea(
    grpc::CallbackServerContext* context, const grpc::ByteBuffer* request) {
  return Begin(new StreamedAnswer<v1::QueryAreaRequest, v1::QueryAreaResponse>(
      facilities_.budgets, context, "QueryArea", *request, &facilities_.workers->questions,
      &facilities_.workers->long_questions,
      [this](const v1::QueryAreaRequest& asked) { return OpenArea(asked); },
      CheckSize(*request, facilities_.limits)));
}

absl::StatusOr<std::unique_ptr<MessageSource<v1::QueryAreaResponse>>> QueryService::OpenArea(
    const v1::QueryAreaRequest& request) const {
  HYPERMAP_ASSIGN_OR_RETURN(const AskedRevision asked, Pin(request));
  if (!request.has_area()) return absl::InvalidArgumentError("area is missing");
  HYPERMAP_ASSIGN_OR_RETURN(Polygon decoded,
                            wire::DecodeQuestionArea("area", request.area(), facilities_.limits));
  std::optional<Polygon> area(std::move(decoded));
  const Scope scope = wire::DecodeScope(request.scope());
  HYPERMAP_ASSIGN_OR_RETURN(SnapshotPtr snapshot, asked.ForArea(scope, area));
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<PartReader> reader,
                            ContentIn(std::move(snapshot), scope, *std::move(area)));
  return std::make_unique<PartSource<v1::QueryAreaResponse>>(
      std::move(reader), asked.revision(), asked.incarnation(), facilities_.limits);
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* QueryService::QueryValue(
    grpc::CallbackServerContext* context, const grpc::ByteBuffer* request) {
  return Begin(new StreamedAnswer<v1::QueryValueRequest, v1::QueryValueResponse>(
      facilities_.budgets, context, "QueryValue", *request, &facilities_.workers->questions,
      &facilities_.workers->long_questions,
      [this](const v1::QueryValueRequest& asked) { return OpenValue(asked); },
      CheckSize(*request, facilities_.limits)));
}

absl::StatusOr<std::unique_ptr<MessageSource<v1::QueryValueResponse>>> QueryService::OpenValue(
    const v1::QueryValueRequest& request) const {
  HYPERMAP_ASSIGN_OR_RETURN(const AskedRevision asked, Pin(request));
  HYPERMAP_ASSIGN_OR_RETURN(ValueQuery value, ParseValueQuery(request.value()));
  std::optional<Polygon> area;
  if (request.has_area()) {
    HYPERMAP_ASSIGN_OR_RETURN(Polygon decoded,
                              wire::DecodeQuestionArea("area", request.area(), facilities_.limits));
    area = std::move(decoded);
  }
  const Scope scope = wire::DecodeScope(request.scope());
  HYPERMAP_ASSIGN_OR_RETURN(SnapshotPtr snapshot, asked.ForArea(scope, area));
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<PartReader> reader,
                            Search(std::move(snapshot), scope, std::move(value), std::move(area)));
  return std::make_unique<PartSource<v1::QueryValueResponse>>(
      std::move(reader), asked.revision(), asked.incarnation(), facilities_.limits);
}

grpc::ServerUnaryReactor* QueryService::QueryNearest(grpc::CallbackServerContext* context,
                                                     const v1::QueryNearestRequest* request,
                                                     v1::QueryNearestResponse* response) {
  const auto answer = &QueryService::AnswerNearest;
  if (AsksNewest(*request) && request->k() <= kFewNeighbours && AsksObjectsOnly(*request)) {
    return AnswerAtOnce(context, "QueryNearest", request, response, answer);
  }
  return AnswerUnary(context, "QueryNearest", request, response, answer);
}

bool QueryService::AsksObjectsOnly(const v1::QueryNearestRequest& request) const {
  const absl::StatusOr<std::shared_ptr<MapSession>> session = FindMap(facilities_, request.scope());
  if (!session.ok()) return true;  // The answer will be an error, which is short.
  const SnapshotPtr snapshot = (*session)->snapshot();
  const auto holds_objects = [](const Layer* layer) {
    return layer == nullptr || !IsGridKind(layer->spec().kind);
  };
  if (request.scope().layers().empty()) {
    return std::all_of(snapshot->layers.begin(), snapshot->layers.end(),
                       [&](const auto& entry) { return holds_objects(entry.second.get()); });
  }
  return std::all_of(request.scope().layers().begin(), request.scope().layers().end(),
                     [&](const auto& name) { return holds_objects(snapshot->FindLayer(name)); });
}

absl::StatusOr<int64_t> QueryService::AnswerNearest(const v1::QueryNearestRequest& request,
                                                    v1::QueryNearestResponse* response) const {
  HYPERMAP_ASSIGN_OR_RETURN(const AskedRevision asked, Pin(request));
  if (!request.has_point()) return absl::InvalidArgumentError("point is missing");
  HYPERMAP_ASSIGN_OR_RETURN(const Point point, wire::DecodePoint("point", request.point()));
  HYPERMAP_ASSIGN_OR_RETURN(const ValueQuery value, ParseValueQuery(request.value()));
  if (request.k() > facilities_.limits.max_nearest) {
    return absl::ResourceExhaustedError(
        absl::StrCat("k is ", request.k(), ", --max_nearest is ", facilities_.limits.max_nearest));
  }
  const Scope scope = wire::DecodeScope(request.scope());
  HYPERMAP_ASSIGN_OR_RETURN(const NearestAnswer answer,
                            asked.Nearest(scope, point, value, request.k()));
  HYPERMAP_ASSIGN_OR_RETURN(const std::string frame, asked.ResolveFrame(scope.frame_id));

  response->set_map(request.scope().map());
  response->set_revision(asked.revision());
  response->set_incarnation(asked.incarnation());
  response->set_frame_id(frame);
  wire::EncodeNearestAnswer(answer, response);
  return static_cast<int64_t>(answer.entries.size());
}

grpc::ServerBidiReactor<v1::QueryPointsRequest, v1::QueryPointsResponse>* QueryService::QueryPoints(
    grpc::CallbackServerContext* context) {
  return new PointsCall(context, &facilities_, &points_calls_);
}

}  // namespace hypermap::server
