#include "server/rpc/request_log.h"

#include <spdlog/spdlog.h>

#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "base/sync/steady_time.h"
#include "server/rpc/author.h"

namespace hypermap::server {
namespace {

constexpr size_t kMaxLoggedLength = 200;

std::string_view View(absl::string_view s) { return {s.data(), s.size()}; }

}  // namespace

std::string LogQuoted(absl::string_view value) {
  const bool cut = value.size() > kMaxLoggedLength;
  return absl::StrCat("\"", absl::CHexEscape(value.substr(0, kMaxLoggedLength)), cut ? "..." : "",
                      "\"");
}

RequestLog::RequestLog(const grpc::CallbackServerContext& context, absl::string_view rpc,
                       std::string map)
    : context_(&context), rpc_(rpc), map_(std::move(map)), begin_(SteadyTime::Now()) {}

absl::StatusOr<std::string> RequestLog::author() const {
  const auto& metadata = context_->client_metadata();
  const auto it = metadata.find(kAuthorKey);
  if (it == metadata.end() || it->second.empty()) return context_->peer();
  std::string author(it->second.data(), it->second.size());
  HYPERMAP_RETURN_IF_ERROR(ValidateAuthor(author));
  return author;
}

void RequestLog::Edited(Revision revision, absl::string_view request_id, int64_t edits) const {
  spdlog::info("edit rpc={} map={} revision={} request_id={} edits={} author={} peer={}",
               View(rpc_), LogQuoted(map_), revision, LogQuoted(request_id), edits,
               LogQuoted(author().value_or("")), LogQuoted(context_->peer()));
}

void RequestLog::Finished(const absl::Status& status, int64_t items) const {
  if (!spdlog::should_log(spdlog::level::debug)) return;
  const std::string error =
      status.ok() ? "" : absl::StrCat(" error=", LogQuoted(std::string(status.message())));
  spdlog::debug("request rpc={} map={} peer={} status={} duration_ms={:.3f} items={}{}", View(rpc_),
                LogQuoted(map_), LogQuoted(context_->peer()),
                absl::StatusCodeToString(status.code()),
                absl::ToDoubleMilliseconds(SteadyTime::Now() - begin_), items, error);
}

}  // namespace hypermap::server
