#include "server/services/query_service.h"

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "map/values/value_query.h"
#include "server/services/part_source.h"
#include "server/services/request_log.h"
#include "server/services/unary_call.h"
#include "wire/answer.h"
#include "wire/geometry.h"

namespace hypermap::server {

absl::StatusOr<SnapshotPtr> QueryService::Pin(const std::string& map) const {
  const absl::StatusOr<std::shared_ptr<MapSession>> session = FindMap(facilities_, map);
  if (!session.ok()) return session.status();
  return (*session)->snapshot();
}

grpc::ServerUnaryReactor* QueryService::QueryPoint(grpc::CallbackServerContext* context,
                                                   const v1::QueryPointRequest* request,
                                                   v1::QueryPointResponse* response) {
  auto call = std::make_shared<UnaryCall>(context, "QueryPoint", request->map());
  return AnswerOn(facilities_.workers, std::move(call),
                  [this, request, response] { return AnswerPoint(*request, response); });
}

absl::StatusOr<int64_t> QueryService::AnswerPoint(const v1::QueryPointRequest& request,
                                                  v1::QueryPointResponse* response) const {
  const absl::StatusOr<SnapshotPtr> snapshot = Pin(request.map());
  if (!snapshot.ok()) return snapshot.status();
  if (!request.has_point()) return absl::InvalidArgumentError("point is missing");
  const absl::StatusOr<Point> point = wire::DecodePoint("point", request.point());
  if (!point.ok()) return point.status();
  const absl::StatusOr<std::vector<LayerContent>> contents =
      ContentAt(**snapshot, wire::DecodeScope(request), *point);
  if (!contents.ok()) return contents.status();
  const absl::StatusOr<std::string> frame = (*snapshot)->ResolveFrame(request.frame_id());
  if (!frame.ok()) return frame.status();

  response->set_map(request.map());
  response->set_revision((*snapshot)->revision);
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
      [this, request] { return OpenArea(*request); });
}

absl::StatusOr<std::unique_ptr<MessageSource<v1::QueryAreaResponse>>> QueryService::OpenArea(
    const v1::QueryAreaRequest& request) const {
  const absl::StatusOr<SnapshotPtr> snapshot = Pin(request.map());
  if (!snapshot.ok()) return snapshot.status();
  if (!request.has_area()) return absl::InvalidArgumentError("area is missing");
  const absl::StatusOr<Polygon> area =
      wire::DecodePolygon("area", request.area(), facilities_.limits.decode);
  if (!area.ok()) return area.status();
  absl::StatusOr<std::unique_ptr<PartReader>> reader =
      ContentIn(*snapshot, wire::DecodeScope(request), *area);
  if (!reader.ok()) return reader.status();
  return std::make_unique<PartSource<v1::QueryAreaResponse>>(
      *std::move(reader), (*snapshot)->revision, facilities_.limits);
}

grpc::ServerWriteReactor<v1::QueryValueResponse>* QueryService::QueryValue(
    grpc::CallbackServerContext* context, const v1::QueryValueRequest* request) {
  return new StreamedAnswer<v1::QueryValueResponse>(
      context, RequestLog(*context, "QueryValue", request->map()), facilities_.workers,
      [this, request] { return OpenValue(*request); });
}

absl::StatusOr<std::unique_ptr<MessageSource<v1::QueryValueResponse>>> QueryService::OpenValue(
    const v1::QueryValueRequest& request) const {
  const absl::StatusOr<SnapshotPtr> snapshot = Pin(request.map());
  if (!snapshot.ok()) return snapshot.status();
  const absl::StatusOr<ValueQuery> value = ParseValueQuery(request.value());
  if (!value.ok()) return value.status();
  std::optional<Polygon> area;
  if (request.has_area()) {
    absl::StatusOr<Polygon> decoded =
        wire::DecodePolygon("area", request.area(), facilities_.limits.decode);
    if (!decoded.ok()) return decoded.status();
    area = *std::move(decoded);
  }
  absl::StatusOr<std::unique_ptr<PartReader>> reader =
      Search(*snapshot, wire::DecodeScope(request), *value, area);
  if (!reader.ok()) return reader.status();
  return std::make_unique<PartSource<v1::QueryValueResponse>>(
      *std::move(reader), (*snapshot)->revision, facilities_.limits);
}

grpc::ServerUnaryReactor* QueryService::QueryNearest(grpc::CallbackServerContext* context,
                                                     const v1::QueryNearestRequest* request,
                                                     v1::QueryNearestResponse* response) {
  auto call = std::make_shared<UnaryCall>(context, "QueryNearest", request->map());
  return AnswerOn(facilities_.workers, std::move(call),
                  [this, request, response] { return AnswerNearest(*request, response); });
}

absl::StatusOr<int64_t> QueryService::AnswerNearest(const v1::QueryNearestRequest& request,
                                                    v1::QueryNearestResponse* response) const {
  const absl::StatusOr<SnapshotPtr> snapshot = Pin(request.map());
  if (!snapshot.ok()) return snapshot.status();
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
      Nearest(**snapshot, wire::DecodeScope(request), *point, *value, request.k());
  if (!answer.ok()) return answer.status();
  const absl::StatusOr<std::string> frame = (*snapshot)->ResolveFrame(request.frame_id());
  if (!frame.ok()) return frame.status();

  response->set_map(request.map());
  response->set_revision((*snapshot)->revision);
  response->set_frame_id(*frame);
  wire::EncodeNearestAnswer(*answer, response);
  return response->matches_size();
}

}  // namespace hypermap::server
