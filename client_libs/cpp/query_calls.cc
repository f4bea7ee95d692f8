// The questions of Client.
#include <memory>
#include <utility>

#include "client_libs/cpp/client.h"
#include "client_libs/cpp/connection.h"
#include "client_libs/cpp/decode.h"
#include "client_libs/cpp/grpc_source.h"
#include "wire/answer.h"
#include "wire/as_of.h"
#include "wire/geometry.h"

namespace hypermap::client {
namespace {

template <typename Message>
absl::StatusOr<AnswerReader::RevisedPart> DecodeRevisedPart(Message message) {
  if (!message.has_part()) return AnswerReader::RevisedPart{message.revision(), std::nullopt};
  absl::StatusOr<LayerPart> part = DecodeLayerPart(message.part());
  if (!part.ok()) return part.status();
  return AnswerReader::RevisedPart{message.revision(), *std::move(part)};
}

template <typename Request, typename Message>
AnswerReader MakeAnswerReader(std::shared_ptr<Connection> connection,
                              OpenStream<v1::QueryService::Stub, Request, Message> open,
                              Request request, const CallOptions& options) {
  v1::QueryService::Stub& stub = connection->query();
  return AnswerReader(MakeGrpcSource(std::move(connection), stub, open, std::move(request), options,
                                     &DecodeRevisedPart<Message>));
}

}  // namespace

absl::StatusOr<PointAnswer> Client::QueryPoint(const std::string& map, const Point& p,
                                               const Scope& scope, const CallOptions& options) {
  v1::QueryPointRequest request;
  request.set_map(map);
  wire::EncodeScope(scope, &request);
  wire::EncodeAsOf(options.as_of, &request);
  wire::EncodePoint(p, request.mutable_point());
  const auto response = connection_->Call(connection_->query(), &v1::QueryService::Stub::QueryPoint,
                                          request, options);
  if (!response.ok()) return response.status();
  absl::StatusOr<PointAnswer> answer = DecodePointAnswer(*response);
  if (!answer.ok()) return BadAnswer(answer.status());
  return answer;
}

AnswerReader Client::QueryArea(const std::string& map, const Polygon& area, const Scope& scope,
                               const CallOptions& options) {
  v1::QueryAreaRequest request;
  request.set_map(map);
  wire::EncodeScope(scope, &request);
  wire::EncodeAsOf(options.as_of, &request);
  wire::EncodePolygon(area, request.mutable_area());
  return MakeAnswerReader(connection_, &v1::QueryService::Stub::QueryArea, std::move(request),
                          options);
}

AnswerReader Client::QueryValue(const std::string& map, const std::string& value,
                                const std::optional<Polygon>& area, const Scope& scope,
                                const CallOptions& options) {
  v1::QueryValueRequest request;
  request.set_map(map);
  wire::EncodeScope(scope, &request);
  wire::EncodeAsOf(options.as_of, &request);
  request.set_value(value);
  if (area.has_value()) wire::EncodePolygon(*area, request.mutable_area());
  return MakeAnswerReader(connection_, &v1::QueryService::Stub::QueryValue, std::move(request),
                          options);
}

absl::StatusOr<NearestAnswer> Client::QueryNearest(const std::string& map, const Point& p,
                                                   const std::string& value, int k,
                                                   const Scope& scope, const CallOptions& options) {
  v1::QueryNearestRequest request;
  request.set_map(map);
  wire::EncodeScope(scope, &request);
  wire::EncodeAsOf(options.as_of, &request);
  wire::EncodePoint(p, request.mutable_point());
  request.set_value(value);
  request.set_k(k);
  const auto response = connection_->Call(connection_->query(),
                                          &v1::QueryService::Stub::QueryNearest, request, options);
  if (!response.ok()) return response.status();
  absl::StatusOr<NearestAnswer> answer = DecodeNearestAnswer(*response);
  if (!answer.ok()) return BadAnswer(answer.status());
  return answer;
}

}  // namespace hypermap::client
