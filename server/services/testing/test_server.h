// A server for tests, on a free port and with maps in memory, and stubs of its services.
#ifndef HYPERMAP_SERVER_SERVICES_TESTING_TEST_SERVER_H_
#define HYPERMAP_SERVER_SERVICES_TESTING_TEST_SERVER_H_

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/limits/limits.h"
#include "hypermap/v1/catalog_service.grpc.pb.h"
#include "hypermap/v1/edit_service.grpc.pb.h"
#include "hypermap/v1/exploration_service.grpc.pb.h"
#include "hypermap/v1/ingest_service.grpc.pb.h"
#include "hypermap/v1/query_service.grpc.pb.h"
#include "hypermap/v1/robot_service.grpc.pb.h"
#include "hypermap/v1/watch_service.grpc.pb.h"
#include "map/edits/edit.h"
#include "server/forward/forwarder.h"
#include "server/fusion/testing/tally_strategy.h"
#include "server/rpc/facilities.h"
#include "server/services/evidence_codec.h"
#include "server/services/grpc_server.h"
#include "server/session/site.h"
#include "server/session/testing/memory_map_store.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::server {

// Who may call a server, and what it shows to others.
struct TestAccess {
  std::string access_file = "";  // empty: everybody may do everything
  tls::ServerFiles tls = {};
  std::vector<std::string> trusted_peers = {};
  // With which it passes calls on.
  std::shared_ptr<grpc::ChannelCredentials> credentials = grpc::InsecureChannelCredentials();
};

class TestServer {
 public:
  // With a `server_id` the store is one that several servers may share.
  explicit TestServer(const Limits& limits = {}, int max_message_bytes = 1 << 20,
                      SessionOptions options = {}, const TestAccess& access = {},
                      const std::string& server_id = "")
      : budgets_(limits), forwarder_(access.credentials, max_message_bytes) {
    options.fusion.codec = WireEvidenceCodec();
    options.fusion.make_strategy = MakeTallyStrategy;
    options.fusion.default_strategy = "tally";
    auto site = Site::Open(std::make_unique<MemoryMapStore>(&disk_, server_id), options);
    EXPECT_TRUE(site.ok()) << site.status();
    site_ = *std::move(site);
    if (!access.access_file.empty()) {
      auto control = AccessControl::OfFile(access.access_file, kExpiryAuthor, &site_->clock());
      EXPECT_TRUE(control.ok()) << control.status();
      access_ = *std::move(control);
    }
    access_->TrustPeers(access.trusted_peers);
    auto server = GrpcServer::Start({"127.0.0.1:0", max_message_bytes, access.tls},
                                    {site_.get(), limits, &workers_, scratch_.path(), &budgets_,
                                     access_.get(), &meters_, &timers_, &forwarder_});
    EXPECT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
    channel_ = grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials());
    catalog = v1::CatalogService::NewStub(channel_);
    query = v1::QueryService::NewStub(channel_);
    edit = v1::EditService::NewStub(channel_);
    watch = v1::WatchService::NewStub(channel_);
    exploration = v1::ExplorationService::NewStub(channel_);
    ingest = v1::IngestService::NewStub(channel_);
    robots = v1::RobotService::NewStub(channel_);
  }
  ~TestServer() {
    disk_.Release();
    disk_.ReleaseNewest();
    Shutdown(absl::Seconds(10));
  }

  // Names of the scratch files that calls have left behind.
  std::vector<std::string> ScratchFiles() const { return scratch_.Names(); }
  MemoryDisk& disk() { return disk_; }
  Budgets& budgets() { return budgets_; }
  WorkerPools& workers() { return workers_; }
  Site& site() { return *site_; }
  const RpcMeters& meters() const { return meters_; }
  const std::string& address() const { return server_->address(); }
  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }

  // Creates a map with the content of `batch`.
  void MakeMap(const std::string& name, EditBatch batch) {
    const auto made = site_->CreateFilled({name, "map", ""}, [&](MapSession& session) {
      return session.SubmitAndWait({std::move(batch), "test", ""}).status();
    });
    EXPECT_TRUE(made.ok()) << made.status();
  }

  void Shutdown(absl::Duration grace) {
    if (!shut_down_) server_->Shutdown(grace);
    shut_down_ = true;
  }

 private:
  hypermap::testing::TemporaryFolder scratch_;
  MemoryDisk disk_;
  Budgets budgets_;
  std::unique_ptr<AccessControl> access_ = std::make_unique<AccessControl>();
  RpcMeters meters_;
  TimerQueue timers_;
  Forwarder forwarder_;
  std::unique_ptr<Site> site_;
  WorkerPools workers_{2};
  std::unique_ptr<GrpcServer> server_;
  std::shared_ptr<grpc::Channel> channel_;
  bool shut_down_ = false;

 public:
  std::unique_ptr<v1::CatalogService::Stub> catalog;
  std::unique_ptr<v1::QueryService::Stub> query;
  std::unique_ptr<v1::EditService::Stub> edit;
  std::unique_ptr<v1::WatchService::Stub> watch;
  std::unique_ptr<v1::ExplorationService::Stub> exploration;
  std::unique_ptr<v1::IngestService::Stub> ingest;
  std::unique_ptr<v1::RobotService::Stub> robots;
};

// A semantic layer `name` with unit squares labelled "cup" at x = 0, 2, 4, ...
inline EditBatch LayerOfCups(const std::string& name, int num_cups) {
  EditBatch batch;
  LayerSpec spec;
  spec.name = name;
  batch.edits.push_back(hypermap::CreateLayer{spec});
  for (int i = 0; i < num_cups; ++i) {
    hypermap::PutObject put{name, {}, ""};
    put.object.label = "cup";
    put.object.shape = Polygon::FromBox({{2.0 * i, 0}, {2.0 * i + 1, 1}});
    batch.edits.push_back(std::move(put));
  }
  return batch;
}

// An occupancy layer `name` of rows x cols cells of 1 m; free and occupied alternate in each row.
inline EditBatch LayerOfCells(const std::string& name, int rows, int cols) {
  LayerSpec spec;
  spec.name = name;
  spec.kind = LayerKind::kOccupancy;
  spec.grid = GridGeometry{PlanarTransform(), 1.0};
  hypermap::WriteCells write{name, {0, rows, 0, cols}, {}};
  for (int i = 0; i < rows * cols; ++i) write.values.push_back((i % cols) % 2 == 0 ? 0.0 : 1.0);
  EditBatch batch;
  batch.edits.push_back(hypermap::CreateLayer{spec});
  batch.edits.push_back(std::move(write));
  return batch;
}

// Reads all messages of a stream.
template <typename Response>
std::vector<Response> ReadAll(grpc::ClientReader<Response>& reader) {
  std::vector<Response> responses;
  for (Response response; reader.Read(&response);) responses.push_back(response);
  return responses;
}

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_TESTING_TEST_SERVER_H_
