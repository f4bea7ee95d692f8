#include "server/rpc/request_log.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"

namespace hypermap::server {
namespace {

constexpr size_t kMaxLoggedLength = 200;
constexpr size_t kMaxAuthorLength = 128;
constexpr char kAuthorKey[] = "x-hypermap-author";

std::string_view View(absl::string_view s) { return {s.data(), s.size()}; }

}  // namespace

std::string LogQuoted(absl::string_view value) {
  const bool cut = value.size() > kMaxLoggedLength;
  return absl::StrCat("\"", absl::CHexEscape(value.substr(0, kMaxLoggedLength)), cut ? "..." : "",
                      "\"");
}

RequestLog::RequestLog(const grpc::CallbackServerContext& context, absl::string_view rpc,
                       std::string map)
    : context_(&context), rpc_(rpc), map_(std::move(map)), begin_(absl::Now()) {}

std::string RequestLog::author() const {
  const auto& metadata = context_->client_metadata();
  const auto it = metadata.find(kAuthorKey);
  if (it == metadata.end() || it->second.empty()) return context_->peer();
  return std::string(it->second.data(), std::min(it->second.size(), kMaxAuthorLength));
}

void RequestLog::Edited(Revision revision, absl::string_view request_id, int64_t edits) const {
  spdlog::info("edit rpc={} map={} revision={} request_id={} edits={} author={} peer={}",
               View(rpc_), LogQuoted(map_), revision, LogQuoted(request_id), edits,
               LogQuoted(author()), LogQuoted(context_->peer()));
}

void RequestLog::Finished(const absl::Status& status, int64_t items) const {
  if (!spdlog::should_log(spdlog::level::debug)) return;
  const std::string error =
      status.ok() ? "" : absl::StrCat(" error=", LogQuoted(std::string(status.message())));
  spdlog::debug("request rpc={} map={} peer={} status={} duration_ms={:.3f} items={}{}", View(rpc_),
                LogQuoted(map_), LogQuoted(context_->peer()),
                absl::StatusCodeToString(status.code()),
                absl::ToDoubleMilliseconds(absl::Now() - begin_), items, error);
}

}  // namespace hypermap::server
