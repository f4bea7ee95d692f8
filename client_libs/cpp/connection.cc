#include "client_libs/cpp/connection.h"

#include <chrono>

#include "absl/strings/numbers.h"
#include "absl/strings/string_view.h"
#include "base/sync/deadline.h"
#include "client_libs/cpp/channel.h"

namespace hypermap::client {
namespace {

// Trailing metadata by which a server tells when a refused call may come again (gRFC A6).
constexpr char kPushbackKey[] = "grpc-retry-pushback-ms";

}  // namespace

Connection::Connection(const std::string& target, const ClientOptions& options)
    : options_(options), channel_(MakeChannel(target, options)) {
  access_ = v1::AccessService::NewStub(channel_);
  catalog_ = v1::CatalogService::NewStub(channel_);
  query_ = v1::QueryService::NewStub(channel_);
  edit_ = v1::EditService::NewStub(channel_);
  exploration_ = v1::ExplorationService::NewStub(channel_);
  ingest_ = v1::IngestService::NewStub(channel_);
  watch_ = v1::WatchService::NewStub(channel_);
}

bool Retries::ShallTryAgain(const grpc::Status& status) {
  return status.error_code() == grpc::StatusCode::UNAVAILABLE && Wait(backoff_.Next());
}

bool Retries::ShallTryAgain(const grpc::Status& status, const grpc::ClientContext& context) {
  if (status.error_code() != grpc::StatusCode::RESOURCE_EXHAUSTED) return ShallTryAgain(status);
  const auto& metadata = context.GetServerTrailingMetadata();
  const auto pushback = metadata.find(kPushbackKey);
  int pause_ms = 0;
  if (pushback == metadata.end() ||
      !absl::SimpleAtoi(absl::string_view(pushback->second.data(), pushback->second.size()),
                        &pause_ms) ||
      pause_ms < 0) {
    return false;
  }
  return Wait(absl::Milliseconds(pause_ms));
}

bool Retries::Wait(absl::Duration pause) {
  if (pause >= until_.left()) return false;
  Pause(*channel_, pause);
  return true;
}

Deadline Connection::DeadlineOf(const CallOptions& options) const {
  return Deadline(options.timeout.value_or(options_.timeout));
}

Retries Connection::RetriesOf(const CallOptions& options, const Deadline& deadline) const {
  return {channel_, options.retry_for.value_or(options_.retry_for), deadline};
}

std::unique_ptr<grpc::ClientContext> Connection::NewContext(const Deadline& deadline) {
  auto context = std::make_unique<grpc::ClientContext>();
  context->set_deadline(GrpcTime(deadline));
  return context;
}

}  // namespace hypermap::client
