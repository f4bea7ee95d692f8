#include "storage/interchange/hmap_config.h"

#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "storage/interchange/names.h"
#include "storage/interchange/number_text.h"
#include "storage/interchange/status_context.h"
#include "storage/interchange/yaml_document.h"

namespace hypermap::storage {
namespace {

constexpr char kOccupancyClass[] = "OccupancyGridLayer";
constexpr char kSemanticClass[] = "SemanticLayer";

void ReportRenamed(absl::string_view what, absl::string_view from, absl::string_view to,
                   RepairLog& repairs) {
  constexpr size_t kMaxBytes = 100;
  repairs.Add([&] {
    return absl::StrCat(what, " \"", CleanWord(CutText(from, kMaxBytes)), "\" renamed to \"", to,
                        "\"");
  });
}

// A frame that must be there.
absl::StatusOr<std::string> ReadFrame(const YAML::Node& map, const char* key, RepairLog& repairs) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string text, ReadText(map, key));
  std::string frame_id = SanitizeFrameId(text);
  HYPERMAP_RETURN_IF_ERROR(ValidateFrameId(key, frame_id));
  if (frame_id != text) ReportRenamed("frame", text, frame_id, repairs);
  return frame_id;
}

absl::StatusOr<LayerKind> ReadKind(const YAML::Node& map) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string text, ReadText(map, "class"));
  if (text == kOccupancyClass) return LayerKind::kOccupancy;
  if (text == kSemanticClass) return LayerKind::kSemantic;
  return absl::InvalidArgumentError(
      absl::StrCat("class \"", text, "\" is neither ", kOccupancyClass, " nor ", kSemanticClass));
}

absl::StatusOr<std::string> ReadFile(const YAML::Node& map) {
  if (Value(map, "load_file").IsDefined()) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool load_file, ReadFlag(map, "load_file"));
    if (!load_file) return std::string();
  } else if (!Value(map, "file").IsDefined()) {
    return std::string();
  }
  absl::StatusOr<std::string> file = ReadText(map, "file");
  if (file.ok() && file->empty()) return absl::InvalidArgumentError("file is empty");
  return file;
}

absl::StatusOr<HmapLayer> ReadLayer(const YAML::Node& map, RepairLog& repairs) {
  HYPERMAP_RETURN_IF_ERROR(CheckMap(map, "it"));
  HmapLayer layer;
  HYPERMAP_ASSIGN_OR_RETURN(const std::string name, ReadText(map, "name"));
  layer.name = SanitizeName(name);
  if (layer.name != name) ReportRenamed("layer", name, layer.name, repairs);

  HYPERMAP_ASSIGN_OR_RETURN(const LayerKind kind, ReadKind(map));
  layer.kind = kind;

  const YAML::Node frame = Value(map, "frame_id");
  const bool names_frame = frame.IsDefined() && !(frame.IsScalar() && frame.Scalar().empty());
  if (names_frame) {
    HYPERMAP_ASSIGN_OR_RETURN(std::string frame_id, ReadFrame(map, "frame_id", repairs));
    layer.frame_id = std::move(frame_id);
  } else {
    repairs.Add([&] {
      return absl::StrCat("layer \"", layer.name, "\": no frame_id, taken as the map's own");
    });
  }
  HYPERMAP_ASSIGN_OR_RETURN(std::string file, ReadFile(map));
  layer.file = std::move(file);
  return layer;
}

absl::StatusOr<FrameTransform> ReadTransform(const YAML::Node& map, RepairLog& repairs) {
  HYPERMAP_RETURN_IF_ERROR(CheckMap(map, "it"));
  HYPERMAP_ASSIGN_OR_RETURN(std::string parent, ReadFrame(map, "frame_id", repairs));
  HYPERMAP_ASSIGN_OR_RETURN(std::string child, ReadFrame(map, "child_frame_id", repairs));
  HYPERMAP_ASSIGN_OR_RETURN(const YamlPose pose, ReadPose(map, "transform_pose"));
  return FrameTransform{std::move(parent), std::move(child),
                        PlanarTransform(pose.x, pose.y, pose.yaw)};
}

// The list behind a key; an absent one is empty.
absl::StatusOr<YAML::Node> ReadList(const YAML::Node& root, const char* key) {
  const YAML::Node list = Value(root, key);
  if (!list.IsDefined()) return YAML::Node(YAML::NodeType::Sequence);
  if (!list.IsSequence()) return absl::InvalidArgumentError(absl::StrCat(key, " is not a list"));
  return list;
}

absl::Status ReadLayers(const YAML::Node& root, HmapConfig& config, RepairLog& repairs) {
  HYPERMAP_ASSIGN_OR_RETURN(const YAML::Node list, ReadList(root, "layers"));
  absl::flat_hash_set<std::string> names;
  for (size_t i = 0; i < list.size(); ++i) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    absl::StatusOr<HmapLayer> layer = ReadLayer(list[i], repairs);
    if (!layer.ok()) return At(absl::StrCat("layers[", i, "]"), layer.status());
    if (!names.insert(layer->name).second) {
      return absl::InvalidArgumentError(
          absl::StrCat("layers[", i, "]: a second layer \"", layer->name, "\""));
    }
    config.layers.push_back(*std::move(layer));
  }
  return absl::OkStatus();
}

absl::Status ReadTransforms(const YAML::Node& root, HmapConfig& config, RepairLog& repairs) {
  HYPERMAP_ASSIGN_OR_RETURN(const YAML::Node list, ReadList(root, "transforms"));
  if (list.size() > FixedLimits::kMaxTransforms) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "transforms has ", list.size(), " entries, more than ", FixedLimits::kMaxTransforms));
  }
  FrameTree tree;  // refuses the transform that closes a cycle
  for (size_t i = 0; i < list.size(); ++i) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    const std::string place = absl::StrCat("transforms[", i, "]");
    absl::StatusOr<FrameTransform> transform = ReadTransform(list[i], repairs);
    if (!transform.ok()) return At(place, transform.status());
    if (auto status = tree.Set(*transform); !status.ok()) return At(place, status);
    config.transforms.push_back(*std::move(transform));
  }
  if (tree.transforms().size() < config.transforms.size()) {
    repairs.Add("several transforms of one child_frame_id: the last one holds");
    config.transforms = tree.transforms();
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<HmapConfig> ParseHmapConfig(absl::string_view text, RepairLog& repairs) {
  HYPERMAP_ASSIGN_OR_RETURN(const YAML::Node root, ParseYaml(text));
  HYPERMAP_RETURN_IF_ERROR(CheckMap(root, "the YAML"));
  if (!Value(root, "layers").IsDefined()) {
    return absl::InvalidArgumentError("layers is missing");
  }
  HmapConfig config;
  HYPERMAP_RETURN_IF_ERROR(ReadLayers(root, config, repairs));
  HYPERMAP_RETURN_IF_ERROR(ReadTransforms(root, config, repairs));
  return config;
}

std::string FormatHmapConfig(const HmapConfig& config) {
  std::string text = config.layers.empty() ? "layers: []\n" : "layers:\n";
  for (const HmapLayer& layer : config.layers) {
    const bool load_file = !layer.file.empty();
    absl::StrAppend(
        &text, "  - name: ", QuoteYaml(layer.name), "\n    frame_id: ", QuoteYaml(layer.frame_id),
        "\n    load_file: ", load_file ? "true" : "false",
        load_file ? absl::StrCat("\n    file: ", QuoteYaml(layer.file)) : "",
        "\n    class: ", layer.kind == LayerKind::kOccupancy ? kOccupancyClass : kSemanticClass,
        "\n");
  }
  if (config.transforms.empty()) return text;
  text += "transforms:\n";
  for (const FrameTransform& t : config.transforms) {
    const PlanarTransform& pose = t.parent_from_child;
    absl::StrAppend(&text, "  - frame_id: ", QuoteYaml(t.parent_frame_id),
                    "\n    child_frame_id: ", QuoteYaml(t.child_frame_id),
                    "\n    transform_pose: [", FormatNumber(pose.x()), ", ", FormatNumber(pose.y()),
                    ", ", FormatNumber(pose.yaw()), "]\n");
  }
  return text;
}

}  // namespace hypermap::storage
