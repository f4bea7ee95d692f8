// The servers that a client may ask. Only for the sources of this folder.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_SERVERS_H_
#define HYPERMAP_CLIENT_LIBS_CPP_SERVERS_H_

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <cstddef>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "client_libs/cpp/client.h"
#include "hypermap/v1/access_service.grpc.pb.h"
#include "hypermap/v1/catalog_service.grpc.pb.h"
#include "hypermap/v1/edit_service.grpc.pb.h"
#include "hypermap/v1/exploration_service.grpc.pb.h"
#include "hypermap/v1/ingest_service.grpc.pb.h"
#include "hypermap/v1/query_service.grpc.pb.h"
#include "hypermap/v1/robot_service.grpc.pb.h"
#include "hypermap/v1/server_service.grpc.pb.h"
#include "hypermap/v1/watch_service.grpc.pb.h"

namespace hypermap::client {

// The channel to a server, and its stubs. Thread safe.
class Server {
 public:
  explicit Server(std::shared_ptr<grpc::Channel> channel);

  grpc::Channel& channel() { return *channel_; }
  // `Stub` is one of the stubs below, such as v1::QueryService::Stub.
  template <typename Stub>
  Stub& stub() {
    return *std::get<std::unique_ptr<Stub>>(stubs_);
  }

 private:
  std::shared_ptr<grpc::Channel> channel_;
  std::tuple<std::unique_ptr<v1::AccessService::Stub>, std::unique_ptr<v1::CatalogService::Stub>,
             std::unique_ptr<v1::QueryService::Stub>, std::unique_ptr<v1::EditService::Stub>,
             std::unique_ptr<v1::ExplorationService::Stub>,
             std::unique_ptr<v1::IngestService::Stub>, std::unique_ptr<v1::RobotService::Stub>,
             std::unique_ptr<v1::ServerService::Stub>, std::unique_ptr<v1::WatchService::Stub>>
      stubs_;
};

// Servers that share their maps, so that each can answer each call. All calls go to one of them, at
// the beginning the first, until it fails. gRPC's own list of addresses (pick_first) would not do:
// it takes no host names, and stays with a server that is connected but UNAVAILABLE. Thread safe.
class Servers {
 public:
  // `targets` is HOST:PORT,HOST:PORT and so on.
  Servers(const std::string& targets, const ClientOptions& options);

  size_t size() const { return servers_.size(); }
  // The server for the next call.
  Server& current() { return *servers_[current_]; }
  // Call when a call of `server` has ended so that another server may do better: makes the next one
  // the current one.
  void Leave(const Server& server);
  // Call with the status of each call: leaves the server if the call was UNAVAILABLE.
  void NoteEnd(const Server& server, const grpc::Status& status);

 private:
  std::vector<std::unique_ptr<Server>> servers_;  // at least one
  std::atomic<size_t> current_ = 0;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_SERVERS_H_
