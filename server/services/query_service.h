// The gRPC service hypermap.v1.QueryService.
#ifndef HYPERMAP_SERVER_SERVICES_QUERY_SERVICE_H_
#define HYPERMAP_SERVER_SERVICES_QUERY_SERVICE_H_

#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "hypermap/v1/query_service.grpc.pb.h"
#include "map/query/query.h"
#include "server/rpc/arena_messages.h"
#include "server/rpc/asked_revision.h"
#include "server/rpc/facilities.h"
#include "server/rpc/streamed_answer.h"
#include "server/services/points_call.h"

namespace hypermap::server {

class QueryService
    : public v1::QueryService::WithRawCallbackMethod_QueryArea<
          v1::QueryService::WithRawCallbackMethod_QueryValue<v1::QueryService::CallbackService>> {
 public:
  explicit QueryService(const Facilities& facilities);

  grpc::ServerUnaryReactor* QueryPoint(grpc::CallbackServerContext* context,
                                       const v1::QueryPointRequest* request,
                                       v1::QueryPointResponse* response) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* QueryArea(grpc::CallbackServerContext* context,
                                                        const grpc::ByteBuffer* request) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* QueryValue(grpc::CallbackServerContext* context,
                                                         const grpc::ByteBuffer* request) override;
  grpc::ServerUnaryReactor* QueryNearest(grpc::CallbackServerContext* context,
                                         const v1::QueryNearestRequest* request,
                                         v1::QueryNearestResponse* response) override;
  grpc::ServerBidiReactor<v1::QueryPointsRequest, v1::QueryPointsResponse>* QueryPoints(
      grpc::CallbackServerContext* context) override;

  // Ends all QueryPoints streams, and refuses new ones.
  void StopStreams() { points_calls_.Stop(); }

 private:
  // These fill the response and return the number of items in it.
  absl::StatusOr<int64_t> AnswerPoint(const v1::QueryPointRequest& request,
                                      v1::QueryPointResponse* response) const;
  absl::StatusOr<int64_t> AnswerNearest(const v1::QueryNearestRequest& request,
                                        v1::QueryNearestResponse* response) const;

  absl::StatusOr<std::unique_ptr<MessageSource<v1::QueryAreaResponse>>> OpenArea(
      const v1::QueryAreaRequest& request) const;
  absl::StatusOr<std::unique_ptr<MessageSource<v1::QueryValueResponse>>> OpenValue(
      const v1::QueryValueRequest& request) const;

  // The revision that the request asks for (its `as_of`).
  template <typename Request>
  absl::StatusOr<AskedRevision> Pin(const Request& request) const;

  template <typename Request, typename Response>
  using Answer = absl::StatusOr<int64_t> (QueryService::*)(const Request&, Response*) const;

  // Answers on a worker, once the map has the revision that the request waits for.
  template <typename Request, typename Response>
  grpc::ServerUnaryReactor* AnswerUnary(grpc::CallbackServerContext* context, absl::string_view rpc,
                                        const Request* request, Response* response,
                                        Answer<Request, Response> answer) const;

  // Answers on gRPC's thread, because waking a worker costs more than a short answer.
  template <typename Request, typename Response>
  grpc::ServerUnaryReactor* AnswerAtOnce(grpc::CallbackServerContext* context,
                                         absl::string_view rpc, const Request* request,
                                         Response* response,
                                         Answer<Request, Response> answer) const;

  // Begins a streamed answer: at once if it is likely to be short, otherwise on a worker, once the
  // map has the revision that the request waits for.
  template <typename Request, typename Response>
  grpc::ServerWriteReactor<grpc::ByteBuffer>* Begin(
      StreamedAnswer<Request, Response>* answer) const;

  // Whether all layers in scope contain objects, whose index gives the nearest at once. The search
  // in a grid may be long.
  bool AsksObjectsOnly(const v1::QueryNearestRequest& request) const;

  const Facilities facilities_;
  ArenaMessages<v1::QueryPointRequest, v1::QueryPointResponse> point_messages_;
  ArenaMessages<v1::QueryNearestRequest, v1::QueryNearestResponse> nearest_messages_;
  OpenPointsCalls points_calls_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_QUERY_SERVICE_H_
