#include "server/exploration/exploration_calls.h"

#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

namespace hypermap::server {

absl::Status CheckKind(const LayerSpec& spec, LayerKind kind) {
  if (spec.kind == kind) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat("layer \"", spec.name, "\" is of the kind ",
                                                    LayerKindName(spec.kind), ", not ",
                                                    LayerKindName(kind)));
}

absl::Status SetFrame(const Snapshot& snapshot, const std::string& layer_frame,
                      const std::string& frame_id, ExplorationAnswer* answer) {
  absl::StatusOr<std::string> frame = snapshot.ResolveFrame(frame_id);
  if (!frame.ok()) return frame.status();
  const absl::StatusOr<PlanarTransform> transform = snapshot.frames.Lookup(*frame, layer_frame);
  if (!transform.ok()) return transform.status();
  answer->revision = snapshot.revision;
  answer->frame_id = *std::move(frame);
  answer->frame_from_layer = *transform;
  return absl::OkStatus();
}

}  // namespace hypermap::server
