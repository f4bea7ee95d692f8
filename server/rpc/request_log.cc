#include "server/rpc/request_log.h"

#include <optional>

#include "base/status/status_macros.h"
#include "server/auth/metadata.h"
#include "server/rpc/author.h"
#include "server/rpc/correlation.h"

namespace hypermap::server {
namespace {

using logging::Level;

absl::string_view MessageOf(Level level) {
  if (level == Level::kDebug) return "call";
  return level == Level::kWarning ? "call refused" : "call failed";
}

}  // namespace

Level LevelOf(absl::StatusCode code) {
  switch (code) {
    case absl::StatusCode::kOk:
    case absl::StatusCode::kCancelled:
      return Level::kDebug;
    case absl::StatusCode::kUnauthenticated:
    case absl::StatusCode::kPermissionDenied:
      return Level::kWarning;
    case absl::StatusCode::kUnknown:
    case absl::StatusCode::kInternal:
    case absl::StatusCode::kDataLoss:
      return Level::kError;
    default:
      return Level::kInfo;
  }
}

RequestLog::RequestLog(const grpc::CallbackServerContext& context, Rpc rpc)
    : context_(&context), rpc_(rpc), begin_(SteadyTime::Now()) {}

absl::StatusOr<std::string> RequestLog::author() const {
  std::string author(MetadataOf(*context_, kAuthorKey));
  if (author.empty()) return context_->peer();
  HYPERMAP_RETURN_IF_ERROR(ValidateAuthor(author));
  return author;
}

void RequestLog::Edited(Revision revision, absl::string_view edit_id, int64_t edits,
                        absl::string_view author) const {
  if (!logging::IsLogged(Level::kInfo)) return;
  std::vector<logging::Field> fields = Fields();
  fields.emplace_back("identity", author);
  fields.emplace_back("revision", revision);
  fields.emplace_back("edits", edits);
  fields.emplace_back("edit_id", edit_id);
  logging::Log(Level::kInfo, "edit", fields);
}

void RequestLog::Finished(const absl::Status& status, int64_t items, const Caller& caller,
                          const std::string& host, LogPace& pace) const {
  const Level level = LevelOf(status.code());
  if (!logging::IsLogged(level)) return;
  const std::optional<int64_t> left_out = level == Level::kDebug ? 0 : pace.Take(host);
  if (!left_out) return;
  std::vector<logging::Field> fields = Fields();
  fields.emplace_back("code", absl::StatusCodeToString(status.code()));
  if (caller.identity) fields.emplace_back("identity", caller.identity->name);
  if (!caller.token_id.empty()) fields.emplace_back("token", caller.token_id);
  fields.emplace_back("duration_ms", absl::ToDoubleMilliseconds(duration()));
  fields.emplace_back("items", items);
  if (!status.ok()) fields.emplace_back("error", status.message());
  if (*left_out > 0) fields.emplace_back("lines_left_out", *left_out);
  logging::Log(level, MessageOf(level), fields);
}

std::string RequestLog::request_id() const {
  const absl::string_view given = MetadataOf(*context_, kRequestIdKey);
  return IsRequestId(given) ? std::string(given) : made_id_;
}

std::string RequestLog::Name() const {
  std::string id = request_id();
  if (id.empty()) id = made_id_ = MakeRequestId();
  return id;
}

std::vector<logging::Field> RequestLog::Fields() const {
  std::vector<logging::Field> fields = {
      {"rpc", InfoOf(rpc_).method}, {"peer", context_->peer()}, {"request_id", Name()}};
  if (!map_.empty()) fields.emplace_back("map", map_);
  if (!source_map_.empty()) fields.emplace_back("source_map", source_map_);
  if (!forwarded_to_.empty()) fields.emplace_back("forwarded_to", forwarded_to_);
  const absl::string_view trace_id = TraceIdOf(MetadataOf(*context_, kTraceParentKey));
  if (!trace_id.empty()) fields.emplace_back("trace_id", trace_id);
  return fields;
}

}  // namespace hypermap::server
