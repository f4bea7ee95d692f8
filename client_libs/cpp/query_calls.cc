// Queries of Client.
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/status/status_macros.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/connection.h"
#include "client_libs/cpp/grpc_part_stream.h"
#include "wire/answer.h"
#include "wire/geometry.h"
#include "wire/registration.h"
#include "wire/scope.h"

namespace hypermap::client {
namespace {

template <typename Request>
Request MakeQuestion(const Connection& connection, const std::string& map, const Scope& scope,
                     const CallOptions& options) {
  Request request;
  wire::EncodeScope(map, scope, request.mutable_scope());
  request.mutable_scope()->set_incarnation(options.incarnation);
  connection.EncodeAsOf(map, options.as_of, &request);
  return request;
}

void EncodeSide(const Connection& connection, const TransformSide& side,
                v1::EstimateTransformSide* message) {
  Scope scope;
  if (!side.layer.empty()) scope.layers = {side.layer};
  scope.frame_id = side.frame_id;
  wire::EncodeScope(side.map, scope, message->mutable_scope());
  message->mutable_scope()->set_incarnation(side.incarnation);
  connection.EncodeAsOf(side.map, side.as_of, message);
}

template <typename Message>
absl::StatusOr<AnswerReader::RevisedPart> DecodeRevisedPart(Message&& message) {
  if (!message.has_part()) {
    return AnswerReader::RevisedPart{message.revision(), std::nullopt, message.incarnation()};
  }
  HYPERMAP_ASSIGN_OR_RETURN(LayerPart part, wire::DecodeLayerPart(message.part()));
  return AnswerReader::RevisedPart{message.revision(), std::move(part), message.incarnation()};
}

template <typename Request, typename Message>
AnswerReader MakeAnswerReader(std::shared_ptr<Connection> connection,
                              OpenStream<v1::QueryService::Stub, Request, Message> open,
                              Request request, const CallOptions& options) {
  return AnswerReader(MakeGrpcPartStream(std::move(connection), open, std::move(request), options,
                                         &DecodeRevisedPart<Message>));
}

}  // namespace

absl::StatusOr<PointAnswer> Client::QueryPoint(const std::string& map, const Point& p,
                                               const Scope& scope, const CallOptions& options) {
  auto request = MakeQuestion<v1::QueryPointRequest>(*connection_, map, scope, options);
  wire::EncodePoint(p, request.mutable_point());
  request.set_tolerance_m(options.tolerance_m);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::QueryService::Stub::QueryPoint, request, options));
  absl::StatusOr<PointAnswer> answer = wire::DecodePointAnswer(response);
  if (!answer.ok()) return BadAnswer(answer.status());
  return answer;
}

AnswerReader Client::QueryArea(const std::string& map, const Polygon& area, const Scope& scope,
                               const CallOptions& options) {
  auto request = MakeQuestion<v1::QueryAreaRequest>(*connection_, map, scope, options);
  wire::EncodePolygon(area, request.mutable_area());
  return MakeAnswerReader(connection_, &v1::QueryService::Stub::QueryArea, std::move(request),
                          options);
}

AnswerReader Client::QueryValue(const std::string& map, const std::string& value,
                                const std::optional<Polygon>& area, const Scope& scope,
                                const CallOptions& options) {
  auto request = MakeQuestion<v1::QueryValueRequest>(*connection_, map, scope, options);
  request.set_value(value);
  if (area.has_value()) wire::EncodePolygon(*area, request.mutable_area());
  return MakeAnswerReader(connection_, &v1::QueryService::Stub::QueryValue, std::move(request),
                          options);
}

absl::StatusOr<NearestAnswer> Client::QueryNearest(const std::string& map, const Point& p,
                                                   const std::string& value, int k,
                                                   const Scope& scope, const CallOptions& options) {
  auto request = MakeQuestion<v1::QueryNearestRequest>(*connection_, map, scope, options);
  wire::EncodePoint(p, request.mutable_point());
  request.set_value(value);
  request.set_k(k);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::QueryService::Stub::QueryNearest, request, options));
  absl::StatusOr<NearestAnswer> answer = wire::DecodeNearestAnswer(response);
  if (!answer.ok()) return BadAnswer(answer.status());
  return answer;
}

absl::StatusOr<TransformAnswer> Client::EstimateTransform(const TransformSide& source,
                                                          const TransformSide& target,
                                                          const CallOptions& options) {
  return EstimateTransformFromPairs(source, target, {}, options);
}

absl::StatusOr<TransformAnswer> Client::EstimateTransformFromPairs(
    const TransformSide& source, const TransformSide& target, const std::vector<NamedPair>& pairs,
    const CallOptions& options) {
  v1::EstimateTransformRequest request;
  EncodeSide(*connection_, source, request.mutable_source());
  EncodeSide(*connection_, target, request.mutable_target());
  wire::EncodePointPairs(pairs, &request);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::QueryService::Stub::EstimateTransform, request, options));
  connection_->Note(response.source().map(), response.source());
  connection_->Note(response.target().map(), response.target());
  absl::StatusOr<TransformAnswer> answer = wire::DecodeTransformAnswer(response);
  if (!answer.ok()) return BadAnswer(answer.status());
  return answer;
}

}  // namespace hypermap::client
