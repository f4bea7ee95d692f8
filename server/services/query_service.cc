#include "server/services/query_service.h"

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "map/values/value_query.h"
#include "server/services/part_source.h"
#include "server/services/request_log.h"
#include "server/services/revision_wait.h"
#include "server/services/unary_call.h"
#include "wire/answer.h"
#include "wire/as_of.h"
#include "wire/geometry.h"

namespace hypermap::server {

template <typename Request>
absl::StatusOr<AskedRevision> QueryService::Pin(const Request& request) const {
  const absl::StatusOr<std::shared_ptr<MapSession>> session = FindMap(facilities_, request.map());
  if (!session.ok()) return session.status();
  const absl::StatusOr<AsOf> as_of = wire::DecodeAsOf(request);
  if (!as_of.ok()) return as_of.status();
  return AskedRevision::Find(**session, *as_of);
}

template <typename Request, typename Response>
grpc::ServerUnaryReactor* QueryService::AnswerUnary(
    grpc::CallbackServerContext* context, absl::string_view rpc, const Request* request,
    Response* response,
    absl::StatusOr<int64_t> (QueryService::*answer)(const Request&, Response*) const) const {
  auto* const reactor = new WaitingReactor();
  auto call = std::make_shared<UnaryCall>(context, reactor, rpc, request->map());
  reactor->wait().Start(facilities_, request->map(), request->min_revision(),
                        [this, call = std::move(call), request, response, answer] {
                          AnswerOn(facilities_.workers, call, [this, request, response, answer] {
                            return (this->*answer)(*request, response);
                          });
                        });
  return reactor;
}

grpc::ServerUnaryReactor* QueryService::QueryPoint(grpc::CallbackServerContext* context,
                                                   const v1::QueryPointRequest* request,
                                                   v1::QueryPointResponse* response) {
  return AnswerUnary(context, "QueryPoint", request, response, &QueryService::AnswerPoint);
}

absl::StatusOr<int64_t> QueryService::AnswerPoint(const v1::QueryPointRequest& request,
                                                  v1::QueryPointResponse* response) const {
  const absl::StatusOr<AskedRevision> asked = Pin(request);
  if (!asked.ok()) return asked.status();
  if (!request.has_point()) return absl::InvalidArgumentError("point is missing");
  const absl::StatusOr<Point> point = wire::DecodePoint("point", request.point());
  if (!point.ok()) return point.status();
  const Scope scope = wire::DecodeScope(request);
  const absl::StatusOr<SnapshotPtr> snapshot = asked->ForPoint(scope, *point);
  if (!snapshot.ok()) return snapshot.status();
  const absl::StatusOr<std::vector<LayerContent>> contents = ContentAt(**snapshot, scope, *point);
  if (!contents.ok()) return contents.status();
  const absl::StatusOr<std::string> frame = asked->ResolveFrame(request.frame_id());
  if (!frame.ok()) return frame.status();

  response->set_map(request.map());
  response->set_revision(asked->revision());
  response->set_frame_id(*frame);
  wire::EncodePoint(*point, response->mutable_point());
  for (const LayerContent& content : *contents) {
    wire::EncodeLayerContent(content, response->add_layers());
  }
  return response->layers_size();
}

grpc::ServerWriteReactor<v1::QueryAreaResponse>* QueryService::QueryArea(
    grpc::CallbackServerContext* context, const v1::QueryAreaRequest* request) {
  return new StreamedAnswer<v1::QueryAreaResponse>(
      context, RequestLog(*context, "QueryArea", request->map()), facilities_.workers,
      [this, request] { return OpenArea(*request); },
      [this, request](RevisionWait& wait, auto done) {
        wait.Start(facilities_, request->map(), request->min_revision(), std::move(done));
      });
}

absl::StatusOr<std::unique_ptr<MessageSource<v1::QueryAreaResponse>>> QueryService::OpenArea(
    const v1::QueryAreaRequest& request) const {
  const absl::StatusOr<AskedRevision> asked = Pin(request);
  if (!asked.ok()) return asked.status();
  if (!request.has_area()) return absl::InvalidArgumentError("area is missing");
  const absl::StatusOr<Polygon> area =
      wire::DecodePolygon("area", request.area(), facilities_.limits.decode);
  if (!area.ok()) return area.status();
  const Scope scope = wire::DecodeScope(request);
  absl::StatusOr<SnapshotPtr> snapshot = asked->ForArea(scope, *area);
  if (!snapshot.ok()) return snapshot.status();
  absl::StatusOr<std::unique_ptr<PartReader>> reader =
      ContentIn(*std::move(snapshot), scope, *area);
  if (!reader.ok()) return reader.status();
  return std::make_unique<PartSource<v1::QueryAreaResponse>>(*std::move(reader), asked->revision(),
                                                             facilities_.limits);
}

grpc::ServerWriteReactor<v1::QueryValueResponse>* QueryService::QueryValue(
    grpc::CallbackServerContext* context, const v1::QueryValueRequest* request) {
  return new StreamedAnswer<v1::QueryValueResponse>(
      context, RequestLog(*context, "QueryValue", request->map()), facilities_.workers,
      [this, request] { return OpenValue(*request); },
      [this, request](RevisionWait& wait, auto done) {
        wait.Start(facilities_, request->map(), request->min_revision(), std::move(done));
      });
}

absl::StatusOr<std::unique_ptr<MessageSource<v1::QueryValueResponse>>> QueryService::OpenValue(
    const v1::QueryValueRequest& request) const {
  const absl::StatusOr<AskedRevision> asked = Pin(request);
  if (!asked.ok()) return asked.status();
  const absl::StatusOr<ValueQuery> value = ParseValueQuery(request.value());
  if (!value.ok()) return value.status();
  std::optional<Polygon> area;
  if (request.has_area()) {
    absl::StatusOr<Polygon> decoded =
        wire::DecodePolygon("area", request.area(), facilities_.limits.decode);
    if (!decoded.ok()) return decoded.status();
    area = *std::move(decoded);
  }
  const Scope scope = wire::DecodeScope(request);
  absl::StatusOr<SnapshotPtr> snapshot = asked->ForArea(scope, area);
  if (!snapshot.ok()) return snapshot.status();
  absl::StatusOr<std::unique_ptr<PartReader>> reader =
      Search(*std::move(snapshot), scope, *value, area);
  if (!reader.ok()) return reader.status();
  return std::make_unique<PartSource<v1::QueryValueResponse>>(*std::move(reader), asked->revision(),
                                                              facilities_.limits);
}

grpc::ServerUnaryReactor* QueryService::QueryNearest(grpc::CallbackServerContext* context,
                                                     const v1::QueryNearestRequest* request,
                                                     v1::QueryNearestResponse* response) {
  return AnswerUnary(context, "QueryNearest", request, response, &QueryService::AnswerNearest);
}

absl::StatusOr<int64_t> QueryService::AnswerNearest(const v1::QueryNearestRequest& request,
                                                    v1::QueryNearestResponse* response) const {
  const absl::StatusOr<AskedRevision> asked = Pin(request);
  if (!asked.ok()) return asked.status();
  if (!request.has_point()) return absl::InvalidArgumentError("point is missing");
  const absl::StatusOr<Point> point = wire::DecodePoint("point", request.point());
  if (!point.ok()) return point.status();
  const absl::StatusOr<ValueQuery> value = ParseValueQuery(request.value());
  if (!value.ok()) return value.status();
  if (request.k() > facilities_.limits.max_nearest) {
    return absl::ResourceExhaustedError(
        absl::StrCat("k is ", request.k(), ", --max_nearest is ", facilities_.limits.max_nearest));
  }
  const absl::StatusOr<NearestAnswer> answer =
      asked->Nearest(wire::DecodeScope(request), *point, *value, request.k());
  if (!answer.ok()) return answer.status();
  const absl::StatusOr<std::string> frame = asked->ResolveFrame(request.frame_id());
  if (!frame.ok()) return frame.status();

  response->set_map(request.map());
  response->set_revision(asked->revision());
  response->set_frame_id(*frame);
  wire::EncodeNearestAnswer(*answer, response);
  return response->matches_size();
}

}  // namespace hypermap::server
