// The gRPC service hypermap.v1.CatalogService.
#ifndef HYPERMAP_SERVER_SERVICES_CATALOG_SERVICE_H_
#define HYPERMAP_SERVER_SERVICES_CATALOG_SERVICE_H_

#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "hypermap/v1/catalog_service.grpc.pb.h"
#include "server/rpc/facilities.h"
#include "server/rpc/unary_call.h"

namespace hypermap::server {

// All methods are raw: the memory of a request is charged before it is parsed.
class CatalogService
    : public v1::CatalogService::WithRawCallbackMethod_CreateMap<
          v1::CatalogService::WithRawCallbackMethod_GetMap<
              v1::CatalogService::WithRawCallbackMethod_ListMaps<
                  v1::CatalogService::WithRawCallbackMethod_DeleteMap<
                      v1::CatalogService::WithRawCallbackMethod_CreateLayer<
                          v1::CatalogService::WithRawCallbackMethod_GetLayer<
                              v1::CatalogService::WithRawCallbackMethod_ListLayers<
                                  v1::CatalogService::WithRawCallbackMethod_DeleteLayer<
                                      v1::CatalogService::WithRawCallbackMethod_SetTransform<
                                          v1::CatalogService::WithRawCallbackMethod_ListTransforms<
                                              v1::CatalogService::WithRawCallbackMethod_ImportMap<
                                                  v1::CatalogService::WithRawCallbackMethod_ExportMap<
                                                      v1::CatalogService::
                                                          WithRawCallbackMethod_BackupMap<
                                                              v1::CatalogService::WithRawCallbackMethod_CheckMap<
                                                                  v1::CatalogService::
                                                                      WithRawCallbackMethod_DigestMap<
                                                                          v1::CatalogService::WithRawCallbackMethod_RestoreMap<
                                                                              v1::CatalogService::
                                                                                  CallbackService>>>>>>>>>>>>>>>> {
 public:
  explicit CatalogService(const Facilities& facilities) : facilities_(facilities) {}

  grpc::ServerUnaryReactor* CreateMap(grpc::CallbackServerContext* context,
                                      const grpc::ByteBuffer* request,
                                      grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* GetMap(grpc::CallbackServerContext* context,
                                   const grpc::ByteBuffer* request,
                                   grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* ListMaps(grpc::CallbackServerContext* context,
                                     const grpc::ByteBuffer* request,
                                     grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* DeleteMap(grpc::CallbackServerContext* context,
                                      const grpc::ByteBuffer* request,
                                      grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* CreateLayer(grpc::CallbackServerContext* context,
                                        const grpc::ByteBuffer* request,
                                        grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* GetLayer(grpc::CallbackServerContext* context,
                                     const grpc::ByteBuffer* request,
                                     grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* ListLayers(grpc::CallbackServerContext* context,
                                       const grpc::ByteBuffer* request,
                                       grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* DeleteLayer(grpc::CallbackServerContext* context,
                                        const grpc::ByteBuffer* request,
                                        grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* SetTransform(grpc::CallbackServerContext* context,
                                         const grpc::ByteBuffer* request,
                                         grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* ListTransforms(grpc::CallbackServerContext* context,
                                           const grpc::ByteBuffer* request,
                                           grpc::ByteBuffer* response) override;
  grpc::ServerReadReactor<grpc::ByteBuffer>* ImportMap(grpc::CallbackServerContext* context,
                                                       grpc::ByteBuffer* response) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* ExportMap(grpc::CallbackServerContext* context,
                                                        const grpc::ByteBuffer* request) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* BackupMap(grpc::CallbackServerContext* context,
                                                        const grpc::ByteBuffer* request) override;
  grpc::ServerUnaryReactor* CheckMap(grpc::CallbackServerContext* context,
                                     const grpc::ByteBuffer* request,
                                     grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* DigestMap(grpc::CallbackServerContext* context,
                                      const grpc::ByteBuffer* request,
                                      grpc::ByteBuffer* response) override;
  grpc::ServerReadReactor<grpc::ByteBuffer>* RestoreMap(grpc::CallbackServerContext* context,
                                                        grpc::ByteBuffer* response) override;

 private:
  absl::Status MakeMap(const CallContext& context, const v1::CreateMapRequest& request,
                       v1::CreateMapResponse* response) const;
  absl::Status RemoveMap(const CallContext& context, const v1::DeleteMapRequest& request) const;
  // Submits a batch of one edit to the map that the request names, and fills the response's map and
  // incarnation. `respond(receipt, response)` fills the rest.
  template <typename Request, typename Response, typename Respond>
  absl::Status SubmitEdit(const std::shared_ptr<UnaryCallOf<Request, Response>>& call, Edit edit,
                          Respond respond) const;

  // Answers from the newest snapshot of the map that the request names: `fill(call, snapshot,
  // response)` fills the response and returns the number of items in it.
  template <typename Request, typename Response, typename Fill>
  grpc::ServerUnaryReactor* AnswerFromSnapshot(grpc::CallbackServerContext* context, Rpc rpc,
                                               const RawMessages& raw, Fill fill) const;

  const Facilities facilities_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_CATALOG_SERVICE_H_
