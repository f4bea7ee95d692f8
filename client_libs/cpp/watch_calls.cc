// Calls of Client about revisions and changes.
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/time/time.h"
#include "base/status/status_macros.h"
#include "base/sync/deadline.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/connection.h"
#include "client_libs/cpp/decode.h"
#include "client_libs/cpp/grpc_part_stream.h"
#include "client_libs/cpp/replicate_request.h"
#include "client_libs/cpp/watch.h"
#include "client_libs/cpp/watch_stream.h"
#include "wire/change.h"
#include "wire/geometry.h"
#include "wire/scope.h"
#include "wire/time.h"

namespace hypermap::client {
namespace {

absl::StatusOr<ChangeReader::Part> DecodeDifference(v1::ListChangesResponse&& message) {
  ChangeReader::Part part{
      message.from_revision(), message.to_revision(), {}, message.incarnation()};
  HYPERMAP_RETURN_IF_ERROR(wire::AppendChanges(message.changes(), part.changes));
  return part;
}

v1::WatchRequest EncodeWatch(const std::string& map, const WatchOptions& options) {
  v1::WatchRequest request;
  wire::EncodeScope(map, options.scope, request.mutable_scope());
  request.mutable_scope()->set_incarnation(options.incarnation);
  if (options.area) wire::EncodePolygon(*options.area, request.mutable_area());
  request.mutable_classes()->Assign(options.classes.begin(), options.classes.end());
  if (options.start_revision) request.set_start_revision(*options.start_revision);
  request.set_coalesce(options.coalesce);
  return request;
}

using WatchCall = WatchStream<v1::WatchRequest, v1::WatchResponse>;
using ReplicateCall = WatchStream<v1::ReplicateRequest, v1::ReplicateResponse>;

}  // namespace

v1::ReplicateRequest EncodeReplicate(const std::string& map, const ReplicateOptions& options) {
  v1::ReplicateRequest request;
  wire::EncodeScope(map, options.scope, request.mutable_scope());
  request.mutable_scope()->set_incarnation(options.incarnation);
  if (options.area) wire::EncodePolygon(*options.area, request.mutable_area());
  if (options.start_revision) request.set_start_revision(*options.start_revision);
  if (options.start_time) wire::EncodeTime(*options.start_time, request.mutable_start_time());
  return request;
}

Watcher::Watcher(std::unique_ptr<Call> call) : call_(std::move(call)) {}
Watcher::Watcher(Watcher&&) noexcept = default;
Watcher& Watcher::operator=(Watcher&&) noexcept = default;
Watcher::~Watcher() = default;

std::optional<WatchEvent> Watcher::Next() { return call_->Next(); }
const absl::Status& Watcher::status() const { return call_->status(); }
std::optional<Revision> Watcher::revision() const { return call_->revision(); }
uint64_t Watcher::incarnation() const { return call_->incarnation(); }
int Watcher::num_resumed() const { return call_->num_resumed(); }
void Watcher::Cancel() { call_->Cancel(); }

ChangeReader::ChangeReader(std::unique_ptr<PartStream<Part>> source) : source_(std::move(source)) {}

std::optional<MapChange> ChangeReader::Next() {
  while (next_ == part_.changes.size()) {
    std::optional<Part> part = source_->Next();
    if (!part) return std::nullopt;
    part_ = *std::move(part);
    next_ = 0;
  }
  return std::move(part_.changes[next_++]);
}

Watcher Client::Watch(const std::string& map, const WatchOptions& watch_options,
                      const CallOptions& options) {
  const Deadline deadline(options.timeout.value_or(absl::InfiniteDuration()));
  const WatchCall::Options stream_options{
      .resume = watch_options.resume,
      .retry_for = watch_options.retry_for,
      .idle_timeout = watch_options.idle_timeout,
      .snapshot_when_compacted = watch_options.snapshot_when_compacted,
      .with_changes = watch_options.with_changes};
  return Watcher(std::make_unique<WatchCall>(connection_, &v1::WatchService::Stub::Watch,
                                             EncodeWatch(map, watch_options), stream_options,
                                             deadline));
}

Watcher Client::Replicate(const std::string& map, const ReplicateOptions& replicate_options,
                          const CallOptions& options) {
  const Deadline deadline(options.timeout.value_or(absl::InfiniteDuration()));
  const ReplicateCall::Options stream_options{.resume = false,
                                              .retry_for = absl::ZeroDuration(),
                                              .idle_timeout = replicate_options.idle_timeout,
                                              .with_changes = replicate_options.with_changes};
  return Watcher(std::make_unique<ReplicateCall>(connection_, &v1::WatchService::Stub::Replicate,
                                                 EncodeReplicate(map, replicate_options),
                                                 stream_options, deadline));
}

ChangeReader Client::ListChanges(const std::string& map, Revision from, std::optional<Revision> to,
                                 const Scope& scope, const CallOptions& options) {
  v1::ListChangesRequest request;
  wire::EncodeScope(map, scope, request.mutable_scope());
  request.mutable_scope()->set_incarnation(options.incarnation);
  request.set_from_revision(from);
  if (to) request.set_to_revision(*to);
  return ChangeReader(MakeGrpcPartStream(connection_, &v1::WatchService::Stub::ListChanges,
                                         std::move(request), options, &DecodeDifference));
}

absl::StatusOr<RevisionList> Client::ListRevisions(const std::string& map, const RevisionPage& page,
                                                   const CallOptions& options) {
  v1::ListRevisionsRequest request;
  request.set_map(map);
  request.set_after_revision(page.after);
  request.set_before_revision(page.before);
  request.set_page_size(page.size);
  request.set_newest_first(page.newest_first);
  request.set_incarnation(options.incarnation);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto response,
      connection_->Call(&v1::WatchService::Stub::ListRevisions, request, options));
  return DecodeRevisionList(response);
}

}  // namespace hypermap::client
