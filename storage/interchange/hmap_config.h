// hmap_config.yaml, the table of contents of a .hmap file.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_HMAP_CONFIG_H_
#define HYPERMAP_STORAGE_INTERCHANGE_HMAP_CONFIG_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/frames/frame_tree.h"
#include "map/layers/layer_spec.h"
#include "storage/interchange/repair_log.h"

namespace hypermap::storage {

inline constexpr char kHmapConfigMember[] = "hmap_config.yaml";

struct HmapLayer {
  std::string name;
  LayerKind kind = LayerKind::kSemantic;  // or kOccupancy
  std::string frame_id;                   // empty: the file names none
  // The place of the content in the archive: for kOccupancy the base name of `<file>.yaml`, for
  // kSemantic the name of a member. Empty: the layer has no content (load_file: false).
  std::string file;
};

struct HmapConfig {
  std::vector<HmapLayer> layers;
  std::vector<FrameTransform> transforms;
};

// Names of layers and frames that the domain refuses are changed, with a line in `repairs`; unknown
// keys are ignored. INVALID_ARGUMENT naming the layer or transform and the key; errors of ParseYaml
// and CheckCancelled.
absl::StatusOr<HmapConfig> ParseHmapConfig(absl::string_view text, RepairLog& repairs);

std::string FormatHmapConfig(const HmapConfig& config);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_HMAP_CONFIG_H_
