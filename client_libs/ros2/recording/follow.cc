#include "client_libs/ros2/recording/follow.h"

#include <optional>

#include "base/status/status_macros.h"

namespace hypermap::ros2 {

absl::Status Follow(client::Client& client, const HistoryScope& scope, Revision begin, Revision end,
                    absl::FunctionRef<absl::Status(const client::WatchEvent&)> take) {
  client::ReplicateOptions options;
  options.scope.layers = scope.layers;
  options.start_revision = begin;
  options.incarnation = scope.map.incarnation;
  client::Watcher watcher = client.Replicate(scope.map.name, options, {.timeout = scope.timeout});
  while (const std::optional<client::WatchEvent> event = watcher.Next()) {
    if (event->snapshot) return absl::InternalError("the server sent the map instead of changes");
    HYPERMAP_RETURN_IF_ERROR(take(*event));
    if (event->revision >= end) return absl::OkStatus();
  }
  if (!watcher.status().ok()) return watcher.status();
  return absl::UnavailableError("the server ended the call");
}

}  // namespace hypermap::ros2
