#include "client_libs/cpp/servers.h"

#include <utility>

#include "client_libs/cpp/channel.h"

namespace hypermap::client {

Server::Server(std::shared_ptr<grpc::Channel> channel)
    : channel_(std::move(channel)),
      stubs_(v1::AccessService::NewStub(channel_), v1::CatalogService::NewStub(channel_),
             v1::QueryService::NewStub(channel_), v1::EditService::NewStub(channel_),
             v1::ExplorationService::NewStub(channel_), v1::IngestService::NewStub(channel_),
             v1::RobotService::NewStub(channel_), v1::ServerService::NewStub(channel_),
             v1::WatchService::NewStub(channel_)) {}

Servers::Servers(const std::string& targets, const ClientOptions& options) {
  for (std::shared_ptr<grpc::Channel>& channel : MakeChannels(targets, options)) {
    servers_.push_back(std::make_unique<Server>(std::move(channel)));
  }
}

void Servers::Leave(const Server& server) {
  size_t left = current_;
  // Of calls that fail together, the first makes the next server the current one.
  if (servers_[left].get() != &server) return;
  current_.compare_exchange_strong(left, (left + 1) % servers_.size());
}

void Servers::NoteEnd(const Server& server, const grpc::Status& status) {
  if (status.error_code() == grpc::StatusCode::UNAVAILABLE) Leave(server);
}

}  // namespace hypermap::client
