// A server in this process that can be stopped and restarted on the same port, for tests.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_REPLICA_TESTING_SITE_SERVER_H_
#define HYPERMAP_CLIENT_LIBS_CPP_REPLICA_TESTING_SITE_SERVER_H_

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "absl/time/time.h"
#include "base/limits/limits.h"
#include "server/services/evidence_codec.h"
#include "server/services/grpc_server.h"
#include "server/session/site.h"
#include "storage/geopackage/geopackage_store.h"

namespace hypermap::client {

// Longest time that a test waits for a replica.
inline constexpr absl::Duration kPatience = absl::Seconds(60);

class SiteServer {
 public:
  using OpenStore = std::function<absl::StatusOr<std::unique_ptr<storage::MapStore>>()>;

  // Serves the maps of a folder.
  explicit SiteServer(const std::string& folder)
      : SiteServer(folder, [folder] { return storage::OpenGeoPackageStore(folder); }) {}
  // Serves the maps of another store, which is opened at each start. `scratch` is a folder for
  // temporary files.
  SiteServer(std::string scratch, OpenStore open_store, const server::SessionOptions& options = {})
      : scratch_(std::move(scratch)), open_store_(std::move(open_store)) {
    Start(options);
  }
  ~SiteServer() { Stop(); }

  void Start(server::SessionOptions options = {}) {
    options.fusion.codec = server::WireEvidenceCodec();
    auto store = open_store_();
    ASSERT_TRUE(store.ok()) << store.status();
    auto site = server::Site::Open(*std::move(store), options);
    ASSERT_TRUE(site.ok()) << site.status();
    site_ = *std::move(site);
    auto server = server::GrpcServer::Start(
        {.listen = address_.empty() ? "127.0.0.1:0" : address_},
        {site_.get(), limits, &workers_, scratch_, &budgets_, &access_, &meters_});
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
    address_ = server_->address();
  }

  // Calls in progress have `grace` to finish.
  void Stop(absl::Duration grace = absl::Seconds(10)) {
    if (!server_) return;
    server_->Shutdown(grace);
    server_.reset();
    site_.reset();
  }

  // HOST:PORT.
  const std::string& address() const { return address_; }
  server::Site& site() { return *site_; }

  void MakeMap(const std::string& name, const EditBatch& batch) {
    const auto made = site_->CreateFilled({name, "map", ""}, [&](server::MapSession& session) {
      return session.SubmitAndWait({batch, "test", ""}).status();
    });
    EXPECT_TRUE(made.ok()) << made.status();
  }
  // Returns the revision that the edits made.
  Revision Edit(const std::string& map, EditBatch batch) {
    const auto receipt = (*site_->Find(map))->SubmitAndWait({std::move(batch), "test", ""});
    EXPECT_TRUE(receipt.ok()) << receipt.status();
    return receipt.ok() ? receipt->revision : 0;
  }
  SnapshotPtr SnapshotOf(const std::string& map) { return (*site_->Find(map))->snapshot(); }

  // Limits from the next start on.
  Limits limits;

 private:
  const std::string scratch_;
  const OpenStore open_store_;
  std::string address_;
  server::Budgets budgets_{Limits()};
  server::AccessControl access_;
  server::RpcMeters meters_;
  server::WorkerPools workers_{2};
  std::unique_ptr<server::Site> site_;
  std::unique_ptr<server::GrpcServer> server_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_REPLICA_TESTING_SITE_SERVER_H_
