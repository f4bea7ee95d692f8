#include "client_libs/cpp/connection.h"

#include <chrono>
#include <optional>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/sync/deadline.h"
#include "client_libs/cpp/channel.h"

namespace hypermap::client {
namespace {

// Trailing metadata by which a server tells when a refused call may come again (gRFC A6).
constexpr char kPushbackKey[] = "grpc-retry-pushback-ms";
// Trailing metadata with the name of the call in the server's log.
constexpr char kRequestIdKey[] = "x-request-id";

std::optional<absl::string_view> FindTrailing(const grpc::ClientContext& context, const char* key) {
  const auto& metadata = context.GetServerTrailingMetadata();
  const auto found = metadata.find(key);
  if (found == metadata.end()) return std::nullopt;
  return absl::string_view(found->second.data(), found->second.size());
}

// Errors that somebody looks up in the server's log.
bool IsFault(grpc::StatusCode code) {
  return code == grpc::StatusCode::INTERNAL || code == grpc::StatusCode::UNKNOWN ||
         code == grpc::StatusCode::DATA_LOSS;
}

}  // namespace

grpc::Status NamedStatus(const grpc::Status& status, const grpc::ClientContext& context) {
  if (!IsFault(status.error_code())) return status;
  const std::optional<absl::string_view> id = FindTrailing(context, kRequestIdKey);
  if (!id) return status;
  return {status.error_code(),
          absl::StrCat(status.error_message(), " (call ", *id, " in the server's log)"),
          status.error_details()};
}

Connection::Connection(const std::string& target, const ClientOptions& options)
    : options_(options), channel_(MakeChannel(target, options)) {
  access_ = v1::AccessService::NewStub(channel_);
  catalog_ = v1::CatalogService::NewStub(channel_);
  query_ = v1::QueryService::NewStub(channel_);
  edit_ = v1::EditService::NewStub(channel_);
  exploration_ = v1::ExplorationService::NewStub(channel_);
  ingest_ = v1::IngestService::NewStub(channel_);
  robots_ = v1::RobotService::NewStub(channel_);
  watch_ = v1::WatchService::NewStub(channel_);
}

bool Retries::ShallTryAgain(const grpc::Status& status) {
  return status.error_code() == grpc::StatusCode::UNAVAILABLE && Wait(backoff_.Next());
}

bool Retries::ShallTryAgain(const grpc::Status& status, const grpc::ClientContext& context) {
  if (status.error_code() != grpc::StatusCode::RESOURCE_EXHAUSTED) return ShallTryAgain(status);
  const std::optional<absl::string_view> pushback = FindTrailing(context, kPushbackKey);
  int pause_ms = 0;
  if (!pushback || !absl::SimpleAtoi(*pushback, &pause_ms) || pause_ms < 0) return false;
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
