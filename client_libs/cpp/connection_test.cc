// The TCP connections of clients, and how their calls end.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/sync/mutex.h"
#include "client_libs/cpp/client.h"
#include "hypermap/v1/catalog_service.grpc.pb.h"

namespace hypermap::client {
namespace {

// Serves one service on loopback until it is destroyed.
class LoopbackServer {
 public:
  explicit LoopbackServer(grpc::Service* service) {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(service);
    server_ = builder.BuildAndStart();
  }
  ~LoopbackServer() { server_->Shutdown(); }

  std::string address() const { return absl::StrCat("127.0.0.1:", port_); }

 private:
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

// Records the addresses from which its calls come.
class PeerService : public v1::CatalogService::Service {
 public:
  grpc::Status ListMaps(grpc::ServerContext* context, const v1::ListMapsRequest* /*request*/,
                        v1::ListMapsResponse* /*response*/) override {
    const MutexLock lock(&mutex_);
    peers_.insert(context->peer());
    return grpc::Status::OK;
  }

  std::set<std::string> peers() const {
    const MutexLock lock(&mutex_);
    return peers_;
  }

 private:
  mutable Mutex mutex_;
  std::set<std::string> peers_ ABSL_GUARDED_BY(mutex_);
};

TEST(ConnectionTest, ClientsWithOwnConnectionsShareThemWithTheirCopiesOnly) {
  PeerService service;
  const LoopbackServer server(&service);
  const ClientOptions options{.own_connection = true};
  Client first(server.address(), options);
  Client copy = first;
  Client second(server.address(), options);
  for (Client* client : {&first, &copy, &second}) ASSERT_TRUE(client->ListMaps().ok());
  EXPECT_EQ(service.peers().size(), 2U);
}

// Ends its calls with one status, and tells their names.
class FailingService : public v1::CatalogService::Service {
 public:
  explicit FailingService(grpc::StatusCode code) : code_(code) {}

  grpc::Status ListMaps(grpc::ServerContext* context, const v1::ListMapsRequest* /*request*/,
                        v1::ListMapsResponse* /*response*/) override {
    return Fail(context);
  }
  grpc::Status ExportMap(grpc::ServerContext* context, const v1::ExportMapRequest* /*request*/,
                         grpc::ServerWriter<v1::ExportMapResponse>* /*writer*/) override {
    return Fail(context);
  }

 private:
  grpc::Status Fail(grpc::ServerContext* context) const {
    context->AddTrailingMetadata("x-request-id", "0123456789abcdef");
    return {code_, "no luck"};
  }

  const grpc::StatusCode code_;
};

TEST(ConnectionTest, FaultsOfTheServerTellTheNameOfTheCallInItsLog) {
  const auto errors = [](grpc::StatusCode code) {
    FailingService service(code);
    const LoopbackServer server(&service);
    Client client(server.address(), {});
    return std::vector<absl::Status>{client.ListMaps().status(),
                                     client.ExportMap("site", FileFormat::kGeoJson, {}).status()};
  };
  for (const absl::Status& error : errors(grpc::StatusCode::INTERNAL)) {
    EXPECT_EQ(error, absl::InternalError("no luck (call 0123456789abcdef in the server's log)"));
  }
  for (const absl::Status& error : errors(grpc::StatusCode::NOT_FOUND)) {
    EXPECT_EQ(error, absl::NotFoundError("no luck"));
  }
}

}  // namespace
}  // namespace hypermap::client
