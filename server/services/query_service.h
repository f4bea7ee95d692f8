// The gRPC service hypermap.v1.QueryService.
#ifndef HYPERMAP_SERVER_SERVICES_QUERY_SERVICE_H_
#define HYPERMAP_SERVER_SERVICES_QUERY_SERVICE_H_

#include <cstdint>
#include <memory>
#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "hypermap/v1/query_service.grpc.pb.h"
#include "map/query/query.h"
#include "server/rpc/asked_revision.h"
#include "server/rpc/facilities.h"
#include "server/rpc/streamed_answer.h"
#include "server/rpc/unary_call.h"
#include "server/services/points_call.h"

namespace hypermap::server {

// All methods are raw: the memory of a request is charged before it is parsed.
class QueryService : public v1::QueryService::WithRawCallbackMethod_QueryPoint<
                         v1::QueryService::WithRawCallbackMethod_QueryArea<
                             v1::QueryService::WithRawCallbackMethod_QueryValue<
                                 v1::QueryService::WithRawCallbackMethod_QueryNearest<
                                     v1::QueryService::WithRawCallbackMethod_QueryPoints<
                                         v1::QueryService::WithRawCallbackMethod_EstimateTransform<
                                             v1::QueryService::Service>>>>>> {
 public:
  explicit QueryService(const Facilities& facilities) : facilities_(facilities) {}

  grpc::ServerUnaryReactor* QueryPoint(grpc::CallbackServerContext* context,
                                       const grpc::ByteBuffer* request,
                                       grpc::ByteBuffer* response) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* QueryArea(grpc::CallbackServerContext* context,
                                                        const grpc::ByteBuffer* request) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* QueryValue(grpc::CallbackServerContext* context,
                                                         const grpc::ByteBuffer* request) override;
  grpc::ServerUnaryReactor* QueryNearest(grpc::CallbackServerContext* context,
                                         const grpc::ByteBuffer* request,
                                         grpc::ByteBuffer* response) override;
  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* QueryPoints(
      grpc::CallbackServerContext* context) override;
  grpc::ServerUnaryReactor* EstimateTransform(grpc::CallbackServerContext* context,
                                              const grpc::ByteBuffer* request,
                                              grpc::ByteBuffer* response) override;

  // Ends all QueryPoints streams, and refuses new ones.
  void StopStreams() { points_calls_.Stop(); }

 private:
  using PointCall = UnaryCallOf<v1::QueryPointRequest, v1::QueryPointResponse>;
  using NearestCall = UnaryCallOf<v1::QueryNearestRequest, v1::QueryNearestResponse>;

  // These fill the response and return the number of items in it; or nullopt, if it would be larger
  // than `max_bytes`, which the call has reserved then.
  absl::StatusOr<std::optional<int64_t>> AnswerPoint(PointCall& call, int64_t max_bytes) const;
  absl::StatusOr<std::optional<int64_t>> AnswerNearest(NearestCall& call, int64_t max_bytes) const;

  absl::StatusOr<std::unique_ptr<MessageSource<v1::QueryAreaResponse>>> OpenArea(
      const v1::QueryAreaRequest& request) const;
  absl::StatusOr<std::unique_ptr<MessageSource<v1::QueryValueResponse>>> OpenValue(
      const v1::QueryValueRequest& request) const;

  // The revision that the request asks for (its `as_of`).
  template <typename Request>
  absl::StatusOr<AskedRevision> Pin(const Request& request) const;

  // Returns whether the query is answered from the newest snapshot without waiting.
  template <typename Request>
  bool AsksNewest(const Request& request) const;

  template <typename Call>
  using Answer = absl::StatusOr<std::optional<int64_t>> (QueryService::*)(Call&, int64_t) const;

  // Answers on a worker of the pool, once the map has the revision that the request waits for. A
  // request that is not parsed yet is parsed in the pool, too.
  template <typename Call>
  grpc::ServerUnaryReactor* AnswerLater(const std::shared_ptr<Call>& call, WorkerPool* workers,
                                        Answer<Call> answer) const;

  // Answers on gRPC's thread, because waking a worker costs more than a short answer. An
  // answer that is large or takes longer than a short turn is left to a worker.
  template <typename Call>
  grpc::ServerUnaryReactor* AnswerAtOnce(const std::shared_ptr<Call>& call,
                                         Answer<Call> answer) const;

  // Begins a streamed answer when its request is parsed: at once if it is likely to be short,
  // otherwise on a worker, once the map has the revision that the request waits for.
  template <typename Request, typename Response>
  grpc::ServerWriteReactor<grpc::ByteBuffer>* Begin(
      StreamedAnswer<Request, Response>* answer) const;

  // Returns whether all layers in scope contain objects, whose index gives the nearest at once. The
  // search in a grid may be long.
  bool AsksObjectsOnly(const v1::QueryNearestRequest& request) const;

  const Facilities facilities_;
  OpenStreams points_calls_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_QUERY_SERVICE_H_
