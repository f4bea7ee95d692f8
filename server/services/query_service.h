// hypermap.v1.QueryService.
#ifndef HYPERMAP_SERVER_SERVICES_QUERY_SERVICE_H_
#define HYPERMAP_SERVER_SERVICES_QUERY_SERVICE_H_

#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "hypermap/v1/query_service.grpc.pb.h"
#include "map/query/query.h"
#include "server/services/asked_revision.h"
#include "server/services/facilities.h"
#include "server/services/streamed_answer.h"

namespace hypermap::server {

class QueryService : public v1::QueryService::CallbackService {
 public:
  explicit QueryService(const Facilities& facilities) : facilities_(facilities) {}

  grpc::ServerUnaryReactor* QueryPoint(grpc::CallbackServerContext* context,
                                       const v1::QueryPointRequest* request,
                                       v1::QueryPointResponse* response) override;
  grpc::ServerWriteReactor<v1::QueryAreaResponse>* QueryArea(
      grpc::CallbackServerContext* context, const v1::QueryAreaRequest* request) override;
  grpc::ServerWriteReactor<v1::QueryValueResponse>* QueryValue(
      grpc::CallbackServerContext* context, const v1::QueryValueRequest* request) override;
  grpc::ServerUnaryReactor* QueryNearest(grpc::CallbackServerContext* context,
                                         const v1::QueryNearestRequest* request,
                                         v1::QueryNearestResponse* response) override;

 private:
  // These return the number of answers.
  absl::StatusOr<int64_t> AnswerPoint(const v1::QueryPointRequest& request,
                                      v1::QueryPointResponse* response) const;
  absl::StatusOr<int64_t> AnswerNearest(const v1::QueryNearestRequest& request,
                                        v1::QueryNearestResponse* response) const;

  absl::StatusOr<std::unique_ptr<MessageSource<v1::QueryAreaResponse>>> OpenArea(
      const v1::QueryAreaRequest& request) const;
  absl::StatusOr<std::unique_ptr<MessageSource<v1::QueryValueResponse>>> OpenValue(
      const v1::QueryValueRequest& request) const;

  // The revision of the map that the request is asked of.
  template <typename Request>
  absl::StatusOr<AskedRevision> Pin(const Request& request) const;

  // Answers when the map has the revision that the request waits for.
  template <typename Request, typename Response>
  grpc::ServerUnaryReactor* AnswerUnary(
      grpc::CallbackServerContext* context, absl::string_view rpc, const Request* request,
      Response* response,
      absl::StatusOr<int64_t> (QueryService::*answer)(const Request&, Response*) const) const;

  const Facilities facilities_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_QUERY_SERVICE_H_
