// The gRPC service hypermap.v1.CatalogService.
#ifndef HYPERMAP_SERVER_SERVICES_CATALOG_SERVICE_H_
#define HYPERMAP_SERVER_SERVICES_CATALOG_SERVICE_H_

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "hypermap/v1/catalog_service.grpc.pb.h"
#include "server/rpc/facilities.h"
#include "server/rpc/unary_call.h"

namespace hypermap::server {

class CatalogService : public v1::CatalogService::WithRawCallbackMethod_ExportMap<
                           v1::CatalogService::WithRawCallbackMethod_BackupMap<
                               v1::CatalogService::CallbackService>> {
 public:
  explicit CatalogService(const Facilities& facilities) : facilities_(facilities) {}

  grpc::ServerUnaryReactor* CreateMap(grpc::CallbackServerContext* context,
                                      const v1::CreateMapRequest* request,
                                      v1::CreateMapResponse* response) override;
  grpc::ServerUnaryReactor* GetMap(grpc::CallbackServerContext* context,
                                   const v1::GetMapRequest* request,
                                   v1::GetMapResponse* response) override;
  grpc::ServerUnaryReactor* ListMaps(grpc::CallbackServerContext* context,
                                     const v1::ListMapsRequest* request,
                                     v1::ListMapsResponse* response) override;
  grpc::ServerUnaryReactor* DeleteMap(grpc::CallbackServerContext* context,
                                      const v1::DeleteMapRequest* request,
                                      v1::DeleteMapResponse* response) override;
  grpc::ServerUnaryReactor* CreateLayer(grpc::CallbackServerContext* context,
                                        const v1::CreateLayerRequest* request,
                                        v1::CreateLayerResponse* response) override;
  grpc::ServerUnaryReactor* GetLayer(grpc::CallbackServerContext* context,
                                     const v1::GetLayerRequest* request,
                                     v1::GetLayerResponse* response) override;
  grpc::ServerUnaryReactor* ListLayers(grpc::CallbackServerContext* context,
                                       const v1::ListLayersRequest* request,
                                       v1::ListLayersResponse* response) override;
  grpc::ServerUnaryReactor* DeleteLayer(grpc::CallbackServerContext* context,
                                        const v1::DeleteLayerRequest* request,
                                        v1::DeleteLayerResponse* response) override;
  grpc::ServerUnaryReactor* SetTransform(grpc::CallbackServerContext* context,
                                         const v1::SetTransformRequest* request,
                                         v1::SetTransformResponse* response) override;
  grpc::ServerUnaryReactor* ListTransforms(grpc::CallbackServerContext* context,
                                           const v1::ListTransformsRequest* request,
                                           v1::ListTransformsResponse* response) override;
  grpc::ServerReadReactor<v1::ImportMapRequest>* ImportMap(
      grpc::CallbackServerContext* context, v1::ImportMapResponse* response) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* ExportMap(grpc::CallbackServerContext* context,
                                                        const grpc::ByteBuffer* request) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* BackupMap(grpc::CallbackServerContext* context,
                                                        const grpc::ByteBuffer* request) override;

 private:
  absl::Status MakeMap(const RequestLog& log, const v1::CreateMapRequest& request,
                       v1::CreateMapResponse* response) const;
  absl::Status RemoveMap(const RequestLog& log, const v1::DeleteMapRequest& request) const;
  absl::Status StartCreateLayer(UnaryCallPtr call, const v1::CreateLayerRequest& request,
                                v1::CreateLayerResponse* response) const;
  absl::Status StartSetTransform(UnaryCallPtr call, const v1::SetTransformRequest& request,
                                 v1::SetTransformResponse* response) const;

  // Submits a batch of one edit to the map that the request names, and fills the response's map and
  // incarnation. `respond(receipt)` fills the rest.
  template <typename Request, typename Response, typename Respond>
  absl::Status SubmitEdit(UnaryCallPtr call, const Request& request, Response* response, Edit edit,
                          Respond respond) const;

  // Answers from the newest snapshot of the map that the request names: `fill(snapshot)` fills the
  // response and returns the number of items in it.
  template <typename Request, typename Response, typename Fill>
  grpc::ServerUnaryReactor* AnswerFromSnapshot(grpc::CallbackServerContext* context,
                                               absl::string_view rpc, const Request* request,
                                               Response* response, Fill fill) const;

  const Facilities facilities_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_CATALOG_SERVICE_H_
