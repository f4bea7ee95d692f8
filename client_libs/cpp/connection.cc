#include "client_libs/cpp/connection.h"

#include <chrono>

namespace hypermap::client {

Connection::Connection(const std::string& target, const ClientOptions& options)
    : options_(options) {
  grpc::ChannelArguments arguments;
  // How large an answer may be is the server's to limit.
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  // A server that is back is found soon; how often a call is tried again is up to Backoff.
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 50);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 1000);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
  const std::shared_ptr<grpc::Channel> channel =
      grpc::CreateCustomChannel(target, grpc::InsecureChannelCredentials(), arguments);
  catalog_ = v1::CatalogService::NewStub(channel);
  query_ = v1::QueryService::NewStub(channel);
  edit_ = v1::EditService::NewStub(channel);
  exploration_ = v1::ExplorationService::NewStub(channel);
  ingest_ = v1::IngestService::NewStub(channel);
  watch_ = v1::WatchService::NewStub(channel);
}

bool Retries::ShallTryAgain(const grpc::Status& status) {
  if (status.error_code() != grpc::StatusCode::UNAVAILABLE) return false;
  const absl::Duration pause = backoff_.Next();
  if (absl::Now() + pause >= until_) return false;
  absl::SleepFor(pause);
  return true;
}

absl::Time Connection::DeadlineOf(const CallOptions& options) const {
  return absl::Now() + options.timeout.value_or(options_.timeout);
}

std::unique_ptr<grpc::ClientContext> Connection::NewContext(absl::Time deadline) {
  auto context = std::make_unique<grpc::ClientContext>();
  if (deadline != absl::InfiniteFuture()) context->set_deadline(absl::ToChronoTime(deadline));
  return context;
}

}  // namespace hypermap::client
