#include "server/exploration/exploration_calls.h"

#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::server {

absl::Status CheckKind(const LayerSpec& spec, LayerKind kind) {
  if (spec.kind == kind) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat("layer \"", spec.name, "\" is of the kind ",
                                                    LayerKindName(spec.kind), ", not ",
                                                    LayerKindName(kind)));
}

absl::Status SetFrame(const Snapshot& snapshot, const std::string& layer_frame,
                      const std::string& frame_id, ExplorationAnswer* answer) {
  HYPERMAP_ASSIGN_OR_RETURN(std::string frame, snapshot.ResolveFrame(frame_id));
  HYPERMAP_ASSIGN_OR_RETURN(const PlanarTransform transform,
                            snapshot.frames.Lookup(frame, layer_frame));
  answer->revision = snapshot.revision;
  answer->frame_id = std::move(frame);
  answer->frame_from_layer = transform;
  return absl::OkStatus();
}

}  // namespace hypermap::server
