#include "client_libs/cpp/connection.h"

#include <chrono>

#include "client_libs/cpp/channel.h"

namespace hypermap::client {

Connection::Connection(const std::string& target, const ClientOptions& options)
    : options_(options), channel_(MakeChannel(target, options)) {
  catalog_ = v1::CatalogService::NewStub(channel_);
  query_ = v1::QueryService::NewStub(channel_);
  edit_ = v1::EditService::NewStub(channel_);
  exploration_ = v1::ExplorationService::NewStub(channel_);
  ingest_ = v1::IngestService::NewStub(channel_);
  watch_ = v1::WatchService::NewStub(channel_);
}

bool Retries::ShallTryAgain(const grpc::Status& status) {
  if (status.error_code() != grpc::StatusCode::UNAVAILABLE) return false;
  const absl::Duration pause = backoff_.Next();
  if (absl::Now() + pause >= until_) return false;
  Pause(*channel_, pause);
  return true;
}

absl::Time Connection::DeadlineOf(const CallOptions& options) const {
  return absl::Now() + options.timeout.value_or(options_.timeout);
}

Retries Connection::RetriesOf(const CallOptions& options, absl::Time deadline) const {
  return {channel_, options.retry_for.value_or(options_.retry_for), deadline};
}

std::unique_ptr<grpc::ClientContext> Connection::NewContext(absl::Time deadline) {
  auto context = std::make_unique<grpc::ClientContext>();
  if (deadline != absl::InfiniteFuture()) context->set_deadline(absl::ToChronoTime(deadline));
  return context;
}

}  // namespace hypermap::client
