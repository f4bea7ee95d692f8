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

Connection::Connection(const std::string& targets, const ClientOptions& options)
    : options_(options), servers_(std::make_shared<Servers>(targets, options)) {}

bool Retries::ShallTryAgain(const Server& server, const grpc::Status& status,
                            const grpc::ClientContext& context) {
  servers_->NoteEnd(server, status);
  if (status.error_code() == grpc::StatusCode::UNAVAILABLE) {
    if (num_untried_ == 0) return Wait(backoff_.Next(), until_);
    --num_untried_;
    return Wait(backoff_.Next(), deadline_);
  }
  if (status.error_code() != grpc::StatusCode::RESOURCE_EXHAUSTED) return false;
  const std::optional<absl::string_view> pushback = FindTrailing(context, kPushbackKey);
  int pause_ms = 0;
  if (!pushback || !absl::SimpleAtoi(*pushback, &pause_ms) || pause_ms < 0) return false;
  return Wait(absl::Milliseconds(pause_ms), until_);
}

bool Retries::Wait(absl::Duration pause, const Deadline& end) {
  if (pause >= end.left()) return false;
  Pause(servers_->current().channel(), pause);
  return true;
}

Deadline Connection::DeadlineOf(const CallOptions& options) const {
  return Deadline(options.timeout.value_or(options_.timeout));
}

Retries Connection::RetriesOf(const CallOptions& options, const Deadline& deadline) const {
  return {servers_, options.retry_for.value_or(options_.retry_for), deadline};
}

std::unique_ptr<grpc::ClientContext> Connection::NewContext(const Deadline& deadline) {
  auto context = std::make_unique<grpc::ClientContext>();
  context->set_deadline(GrpcTime(deadline));
  return context;
}

}  // namespace hypermap::client
