// The gRPC service hypermap.v1.IngestService.
#ifndef HYPERMAP_SERVER_SERVICES_INGEST_SERVICE_H_
#define HYPERMAP_SERVER_SERVICES_INGEST_SERVICE_H_

#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "hypermap/v1/ingest_service.grpc.pb.h"
#include "server/rpc/facilities.h"
#include "server/rpc/unary_call.h"
#include "server/services/open_streams.h"

namespace hypermap::server {

// All methods are raw: the memory of a request is charged before it is parsed.
class IngestService : public v1::IngestService::WithRawCallbackMethod_Observe<
                          v1::IngestService::WithRawCallbackMethod_RebuildLayer<
                              v1::IngestService::WithRawCallbackMethod_RetractSource<
                                  v1::IngestService::WithRawCallbackMethod_CorrectPoses<
                                      v1::IngestService::WithRawCallbackMethod_SmoothPoses<
                                          v1::IngestService::WithRawCallbackMethod_ExplainObject<
                                              v1::IngestService::Service>>>>>> {
 public:
  explicit IngestService(const Facilities& facilities) : facilities_(facilities) {}

  // Ends all streams, and refuses new ones.
  void StopStreams() { observe_calls_.Stop(); }

  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* Observe(
      grpc::CallbackServerContext* context) override;
  grpc::ServerUnaryReactor* RebuildLayer(grpc::CallbackServerContext* context,
                                         const grpc::ByteBuffer* request,
                                         grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* RetractSource(grpc::CallbackServerContext* context,
                                          const grpc::ByteBuffer* request,
                                          grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* CorrectPoses(grpc::CallbackServerContext* context,
                                         const grpc::ByteBuffer* request,
                                         grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* SmoothPoses(grpc::CallbackServerContext* context,
                                        const grpc::ByteBuffer* request,
                                        grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* ExplainObject(grpc::CallbackServerContext* context,
                                          const grpc::ByteBuffer* request,
                                          grpc::ByteBuffer* response) override;

 private:
  absl::StatusOr<int64_t> Smooth(UnaryCall& call, const v1::SmoothPosesRequest& request,
                                 v1::SmoothPosesResponse* response) const;
  absl::StatusOr<int64_t> Explain(const UnaryCall& call, const v1::ExplainObjectRequest& request,
                                  v1::ExplainObjectResponse* response) const;

  const Facilities facilities_;
  OpenStreams observe_calls_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_INGEST_SERVICE_H_
