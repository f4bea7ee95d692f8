#include "server/services/query_service.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "base/status/unless_memory_fails.h"
#include "map/layers/layer_registry.h"
#include "map/values/value_query.h"
#include "server/rpc/revision_wait.h"
#include "server/rpc/short_turn.h"
#include "server/rpc/unary_call.h"
#include "server/services/estimate_transform.h"
#include "server/services/part_source.h"
#include "server/services/points_call.h"
#include "wire/answer.h"
#include "wire/geometry.h"
#include "wire/object_bytes.h"
#include "wire/scope.h"

namespace hypermap::server {
namespace {

// Queries up to this size are likely to be answered in less time than a worker needs to wake up,
// and are answered on gRPC's thread.
constexpr double kSmallArea_m2 = 1000.0;
constexpr int kFewNeighbours = 64;
// Answers with more bytes of objects are encoded by a worker.
constexpr int64_t kShortAnswerBytes = 64 << 10;
// Checking an area of more vertices than this takes longer than most answers.
constexpr int kFewVertices = 256;

// Returns whether the query is about the past, which is read from the disk.
template <typename Request>
bool AsksPast(const Request& request) {
  return request.as_of().as_of_case() != v1::AsOf::AS_OF_NOT_SET;
}

int NumVertices(const v1::Polygon& area) {
  int sum = area.outer().xs_size();
  for (const v1::Ring& hole : area.holes()) sum += hole.xs_size();
  return sum;
}

// Returns whether the polygon has few vertices and its bounding box at most kSmallArea_m2. False
// for a malformed polygon.
bool IsSmall(const v1::Polygon& area) {
  Box box;
  const v1::Ring& outer = area.outer();
  if (outer.xs_size() != outer.ys_size() || NumVertices(area) > kFewVertices) return false;
  for (int i = 0; i < outer.xs_size(); ++i) box.Extend(Point{outer.xs(i), outer.ys(i)});
  return (box.max.x - box.min.x) * (box.max.y - box.min.y) <= kSmallArea_m2;
}

// Reserves room in the answer for the objects.
absl::Status ReserveObjects(UnaryCall& call, const std::vector<ObjectPtr>& objects) {
  call.set_advice("ask QueryArea, whose answer is a stream");
  int64_t bytes = 0;
  for (const ObjectPtr& object : objects) bytes += wire::EstimateObjectBytes(*object);
  return call.ReserveAnswer(bytes);
}

}  // namespace

template <typename Request>
absl::StatusOr<AskedRevision> QueryService::Pin(const Request& request) const {
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                            FindMap(facilities_, request.scope()));
  HYPERMAP_ASSIGN_OR_RETURN(const AsOf as_of, wire::DecodeAsOf(request.as_of()));
  return AskedRevision::Find(*session, as_of);
}

template <typename Request>
bool QueryService::AsksNewest(const Request& request) const {
  if (AsksPast(request)) return false;
  const absl::StatusOr<AsOf> as_of = wire::DecodeAsOf(request.as_of());
  if (!as_of.ok() || *as_of == AsOf()) return true;
  if (as_of->consistency == Consistency::kLinearizable) return false;
  const absl::StatusOr<std::shared_ptr<MapSession>> session = FindMap(facilities_, request.scope());
  if (!session.ok()) return true;  // The answer will be an error.
  return (*session)->snapshot()->revision >= as_of->AwaitedOf((*session)->incarnation());
}

template <typename Call>
grpc::ServerUnaryReactor* QueryService::AnswerLater(const std::shared_ptr<Call>& call,
                                                    WorkerPool* workers,
                                                    Answer<Call> answer) const {
  RevisionWait& wait = call->StartWait();
  const auto start = [this, call, workers, answer, &wait] {
    const auto& request = call->request();
    wait.Start(facilities_, request.scope(), request.as_of(),
               [this, call, workers, answer](const absl::StatusOr<Revision>& reached) {
                 if (reached.ok()) call->AskFor(*reached);
                 AnswerOn(
                     workers, call,
                     [this, call, answer, waited = reached.status()]() -> absl::StatusOr<int64_t> {
                       HYPERMAP_RETURN_IF_ERROR(waited);
                       HYPERMAP_ASSIGN_OR_RETURN(
                           const std::optional<int64_t> items,
                           (this->*answer)(*call, std::numeric_limits<int64_t>::max()));
                       return items.value_or(0);
                     });
               });
    return absl::OkStatus();
  };
  return call->is_parsed() ? StartAtOnce(call, start) : StartOn(workers, call, start);
}

template <typename Call>
grpc::ServerUnaryReactor* QueryService::AnswerAtOnce(const std::shared_ptr<Call>& call,
                                                     Answer<Call> answer) const {
  grpc::ServerUnaryReactor* const reactor = call->reactor();
  if (!call->admitted().ok()) {
    call->Finish(call->admitted());
    return reactor;
  }
  ShortTurn turn;
  absl::StatusOr<std::optional<int64_t>> items;
  {
    const ScopedCancellation here(&turn);
    items = UnlessMemoryFails([&] { return (this->*answer)(*call, kShortAnswerBytes); });
  }
  const bool is_long = !turn.status().ok() || (items.ok() && !items->has_value());
  if (is_long) {
    call->ForgetAnswer();
    return AnswerLater(call, &facilities_.workers->long_questions, answer);
  }
  call->Finish(items.status(), items.ok() ? **items : 0);
  return reactor;
}

template <typename Request, typename Response>
grpc::ServerWriteReactor<grpc::ByteBuffer>* QueryService::Begin(
    StreamedAnswer<Request, Response>* answer) const {
  answer->WhenParsed([this, answer] {
    const Request& request = answer->request();
    if (AsksNewest(request) && IsSmall(request.area())) return answer->BeginAtOnce();
    answer->BeginAfter(
        [this, &request](RevisionWait& wait, auto done) {
          wait.Start(facilities_, request.scope(), request.as_of(), std::move(done));
        },
        AsksPast(request) || NumVertices(request.area()) > kFewVertices);
  });
  return answer;
}

grpc::ServerUnaryReactor* QueryService::QueryPoint(grpc::CallbackServerContext* context,
                                                   const grpc::ByteBuffer* request,
                                                   grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::QueryPointRequest, v1::QueryPointResponse>(
      facilities_.for_calls(), context, Rpc::kQueryPoint, {request, response});
  const v1::QueryPointRequest& asked = call->request();
  const auto answer = &QueryService::AnswerPoint;
  if (!call->is_parsed() || AsksPast(asked) || !(asked.tolerance_m() <= kSmallTolerance_m)) {
    return AnswerLater(call, &facilities_.workers->long_questions, answer);
  }
  if (AsksNewest(asked)) return AnswerAtOnce(call, answer);
  return AnswerLater(call, &facilities_.workers->questions, answer);
}

absl::StatusOr<std::optional<int64_t>> QueryService::AnswerPoint(PointCall& call,
                                                                 int64_t max_bytes) const {
  const v1::QueryPointRequest& request = call.request();
  v1::QueryPointResponse* const response = call.response();
  HYPERMAP_ASSIGN_OR_RETURN(const AskedRevision asked, Pin(request));
  if (!request.has_point()) return absl::InvalidArgumentError("point is missing");
  HYPERMAP_ASSIGN_OR_RETURN(const Point point, wire::DecodePoint("point", request.point()));
  HYPERMAP_ASSIGN_OR_RETURN(const Scope scope,
                            wire::DecodeScope(request.scope(), facilities_.limits));
  HYPERMAP_ASSIGN_OR_RETURN(const SnapshotPtr snapshot,
                            asked.ForPoint(scope, point, request.tolerance_m()));
  absl::Status room;
  const auto tell = [&](const LayerPtr& layer, const PlanarTransform& caller_from_layer,
                        const PointContent& content) {
    if (room.ok()) room = ReserveObjects(call, content.objects);
    if (!room.ok() || call.answer_bytes() > max_bytes) return;
    wire::EncodeLayerContent(*layer, caller_from_layer, content, response->add_layers());
  };
  HYPERMAP_ASSIGN_OR_RETURN(const std::string frame,
                            VisitContentAt(*snapshot, scope, point, request.tolerance_m(), tell));
  HYPERMAP_RETURN_IF_ERROR(room);
  if (call.answer_bytes() > max_bytes) return std::nullopt;

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
      facilities_.for_calls(), context, Rpc::kQueryArea, *request, &facilities_.workers->questions,
      &facilities_.workers->long_questions,
      [this](const v1::QueryAreaRequest& asked, absl::string_view) { return OpenArea(asked); },
      CheckQuestionSize(*request, facilities_.limits)));
}

absl::StatusOr<std::unique_ptr<MessageSource<v1::QueryAreaResponse>>> QueryService::OpenArea(
    const v1::QueryAreaRequest& request) const {
  HYPERMAP_ASSIGN_OR_RETURN(const AskedRevision asked, Pin(request));
  if (!request.has_area()) return absl::InvalidArgumentError("area is missing");
  HYPERMAP_ASSIGN_OR_RETURN(Polygon decoded,
                            wire::DecodeQuestionArea("area", request.area(), facilities_.limits));
  std::optional<Polygon> area(std::move(decoded));
  HYPERMAP_ASSIGN_OR_RETURN(const Scope scope,
                            wire::DecodeScope(request.scope(), facilities_.limits));
  HYPERMAP_ASSIGN_OR_RETURN(SnapshotPtr snapshot, asked.ForArea(scope, area));
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<PartReader> reader,
                            ContentIn(std::move(snapshot), scope, *std::move(area)));
  return std::make_unique<PartSource<v1::QueryAreaResponse>>(
      std::move(reader), asked.revision(), asked.incarnation(), facilities_.limits);
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* QueryService::QueryValue(
    grpc::CallbackServerContext* context, const grpc::ByteBuffer* request) {
  return Begin(new StreamedAnswer<v1::QueryValueRequest, v1::QueryValueResponse>(
      facilities_.for_calls(), context, Rpc::kQueryValue, *request, &facilities_.workers->questions,
      &facilities_.workers->long_questions,
      [this](const v1::QueryValueRequest& asked, absl::string_view) { return OpenValue(asked); },
      CheckQuestionSize(*request, facilities_.limits)));
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
  HYPERMAP_ASSIGN_OR_RETURN(const Scope scope,
                            wire::DecodeScope(request.scope(), facilities_.limits));
  HYPERMAP_ASSIGN_OR_RETURN(SnapshotPtr snapshot, asked.ForArea(scope, area));
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<PartReader> reader,
                            Search(std::move(snapshot), scope, std::move(value), std::move(area)));
  return std::make_unique<PartSource<v1::QueryValueResponse>>(
      std::move(reader), asked.revision(), asked.incarnation(), facilities_.limits);
}

grpc::ServerUnaryReactor* QueryService::QueryNearest(grpc::CallbackServerContext* context,
                                                     const grpc::ByteBuffer* request,
                                                     grpc::ByteBuffer* response) {
  const auto call = BeginCall<v1::QueryNearestRequest, v1::QueryNearestResponse>(
      facilities_.for_calls(), context, Rpc::kQueryNearest, {request, response});
  const auto answer = &QueryService::AnswerNearest;
  const v1::QueryNearestRequest& asked = call->request();
  if (!call->is_parsed() || AsksPast(asked) || asked.k() > kFewNeighbours ||
      !AsksObjectsOnly(asked)) {
    return AnswerLater(call, &facilities_.workers->long_questions, answer);
  }
  if (AsksNewest(asked)) return AnswerAtOnce(call, answer);
  return AnswerLater(call, &facilities_.workers->questions, answer);
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

absl::StatusOr<std::optional<int64_t>> QueryService::AnswerNearest(NearestCall& call,
                                                                   int64_t max_bytes) const {
  const v1::QueryNearestRequest& request = call.request();
  v1::QueryNearestResponse* const response = call.response();
  HYPERMAP_ASSIGN_OR_RETURN(const AskedRevision asked, Pin(request));
  if (!request.has_point()) return absl::InvalidArgumentError("point is missing");
  HYPERMAP_ASSIGN_OR_RETURN(const Point point, wire::DecodePoint("point", request.point()));
  HYPERMAP_ASSIGN_OR_RETURN(const ValueQuery value, ParseValueQuery(request.value()));
  if (request.k() > facilities_.limits.max_nearest) {
    return absl::ResourceExhaustedError(
        absl::StrCat("k is ", request.k(), ", --max_nearest is ", facilities_.limits.max_nearest));
  }
  HYPERMAP_ASSIGN_OR_RETURN(const Scope scope,
                            wire::DecodeScope(request.scope(), facilities_.limits));
  HYPERMAP_ASSIGN_OR_RETURN(const NearestNeighbours answer,
                            asked.Nearest(scope, point, value, request.k()));
  HYPERMAP_ASSIGN_OR_RETURN(const std::string frame, asked.ResolveFrame(scope.frame_id));

  response->set_map(request.scope().map());
  response->set_revision(asked.revision());
  response->set_incarnation(asked.incarnation());
  response->set_frame_id(frame);
  for (const NearestNeighbours::Entry& entry : answer.entries) {
    if (entry.neighbour.object) {
      HYPERMAP_RETURN_IF_ERROR(ReserveObjects(call, {entry.neighbour.object}));
    }
  }
  if (call.answer_bytes() > max_bytes) return std::nullopt;
  wire::EncodeNearestAnswer(answer, response);
  return static_cast<int64_t>(answer.entries.size());
}

grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* QueryService::QueryPoints(
    grpc::CallbackServerContext* context) {
  return new PointsCall(context, &facilities_, &points_calls_);
}

grpc::ServerUnaryReactor* QueryService::EstimateTransform(grpc::CallbackServerContext* context,
                                                          const grpc::ByteBuffer* request,
                                                          grpc::ByteBuffer* response) {
  return server::EstimateTransform(facilities_, context, {request, response});
}

}  // namespace hypermap::server
