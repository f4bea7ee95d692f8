#include "client_libs/cpp/connection.h"

#include <chrono>

namespace hypermap::client {

Connection::Connection(const std::string& target, const ClientOptions& options)
    : options_(options) {
  grpc::ChannelArguments arguments;
  // How large an answer may be is the server's to limit.
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  const std::shared_ptr<grpc::Channel> channel =
      grpc::CreateCustomChannel(target, grpc::InsecureChannelCredentials(), arguments);
  catalog_ = v1::CatalogService::NewStub(channel);
  query_ = v1::QueryService::NewStub(channel);
  edit_ = v1::EditService::NewStub(channel);
  ingest_ = v1::IngestService::NewStub(channel);
}

std::unique_ptr<grpc::ClientContext> Connection::NewContext(const CallOptions& options) const {
  auto context = std::make_unique<grpc::ClientContext>();
  const absl::Duration timeout = options.timeout.value_or(options_.timeout);
  if (timeout != absl::InfiniteDuration()) {
    context->set_deadline(absl::ToChronoTime(absl::Now() + timeout));
  }
  return context;
}

}  // namespace hypermap::client
