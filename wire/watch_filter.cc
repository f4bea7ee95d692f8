#include "wire/watch_filter.h"

#include <utility>

#include "base/status/status_macros.h"
#include "wire/geometry.h"
#include "wire/scope.h"

namespace hypermap::wire {
namespace {

// Decodes the fields that both requests have.
template <typename Request>
absl::StatusOr<WatchFilter> DecodePlace(const Request& request, WatchFilter::Frames frames,
                                        const Limits& limits) {
  WatchFilter filter;
  HYPERMAP_ASSIGN_OR_RETURN(Scope scope, DecodeScope(request.scope(), limits));
  filter.layers = std::move(scope.layers);
  filter.frame_id = std::move(scope.frame_id);
  filter.frames = frames;
  if (request.has_area()) {
    HYPERMAP_ASSIGN_OR_RETURN(filter.area, DecodeQuestionArea("area", request.area(), limits));
  }
  return filter;
}

}  // namespace

absl::StatusOr<WatchFilter> DecodeWatchFilter(const v1::WatchRequest& request,
                                              const Limits& limits) {
  HYPERMAP_ASSIGN_OR_RETURN(WatchFilter filter,
                            DecodePlace(request, WatchFilter::Frames::kCaller, limits));
  filter.classes.assign(request.classes().begin(), request.classes().end());
  return filter;
}

absl::StatusOr<WatchFilter> DecodeWatchFilter(const v1::ReplicateRequest& request,
                                              const Limits& limits) {
  return DecodePlace(request, WatchFilter::Frames::kAsStored, limits);
}

}  // namespace hypermap::wire
