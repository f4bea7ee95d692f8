// The TCP connections of clients.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "base/sync/mutex.h"
#include "client_libs/cpp/client.h"
#include "hypermap/v1/catalog_service.grpc.pb.h"

namespace hypermap::client {
namespace {

// A server that records the addresses from which its calls come.
class PeerServer : public v1::CatalogService::Service {
 public:
  PeerServer() {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
  }
  ~PeerServer() override { server_->Shutdown(); }

  grpc::Status ListMaps(grpc::ServerContext* context, const v1::ListMapsRequest* /*request*/,
                        v1::ListMapsResponse* /*response*/) override {
    const MutexLock lock(&mutex_);
    peers_.insert(context->peer());
    return grpc::Status::OK;
  }

  std::string address() const { return absl::StrCat("127.0.0.1:", port_); }
  std::set<std::string> peers() const {
    const MutexLock lock(&mutex_);
    return peers_;
  }

 private:
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
  mutable Mutex mutex_;
  std::set<std::string> peers_ ABSL_GUARDED_BY(mutex_);
};

TEST(ConnectionTest, ClientsWithOwnConnectionsShareThemWithTheirCopiesOnly) {
  PeerServer server;
  const ClientOptions options{.own_connection = true};
  Client first(server.address(), options);
  Client copy = first;
  Client second(server.address(), options);
  for (Client* client : {&first, &copy, &second}) ASSERT_TRUE(client->ListMaps().ok());
  EXPECT_EQ(server.peers().size(), 2U);
}

}  // namespace
}  // namespace hypermap::client
