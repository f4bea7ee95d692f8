#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "storage/interchange/hmap.h"
#include "storage/interchange/hmap_config.h"
#include "storage/interchange/occupancy_member.h"
#include "storage/interchange/repair_log.h"
#include "storage/interchange/semantic_objects.h"
#include "storage/interchange/semantic_yaml.h"
#include "storage/interchange/status_context.h"
#include "storage/interchange/zip_archive.h"

namespace hypermap::storage {
namespace {

// The own frame of a map when its file uses this frame or names none.
constexpr char kDefaultFrame[] = "map";

std::string OwnFrame(const HmapConfig& config) {
  std::vector<std::string> frames;
  for (const HmapLayer& layer : config.layers) {
    if (!layer.frame_id.empty()) frames.push_back(layer.frame_id);
  }
  std::string first = frames.empty() ? kDefaultFrame : frames.front();
  for (const FrameTransform& t : config.transforms) {
    frames.push_back(t.parent_frame_id);
    frames.push_back(t.child_frame_id);
  }
  const bool uses_default = std::find(frames.begin(), frames.end(), kDefaultFrame) != frames.end();
  return uses_default ? kDefaultFrame : first;
}

// Takes an archive apart, layer by layer.
class HmapDecoder {
 public:
  HmapDecoder(ZipArchive archive, const Limits& limits)
      : archive_(std::move(archive)), limits_(limits), pixels_left_(limits.max_cells) {}

  absl::StatusOr<ImportedMap> Decode() && {
    HYPERMAP_ASSIGN_OR_RETURN(const std::string text, archive_.Read(kHmapConfigMember));
    const absl::StatusOr<HmapConfig> config = ParseHmapConfig(text, repairs_);
    if (!config.ok()) return At(kHmapConfigMember, config.status());
    imported_.frame_id = OwnFrame(*config);
    for (const FrameTransform& t : config->transforms) edits().push_back(SetTransform{t});
    for (const HmapLayer& layer : config->layers) {
      const absl::Status status =
          layer.kind == LayerKind::kOccupancy ? DecodeOccupancy(layer) : DecodeSemantic(layer);
      if (!status.ok()) return At(absl::StrCat("layer \"", layer.name, "\""), status);
      imported_.layers.push_back(layer.name);
    }
    imported_.repairs = std::move(repairs_).Take();
    return std::move(imported_);
  }

 private:
  std::vector<Edit>& edits() { return imported_.batch.edits; }

  absl::Status DecodeOccupancy(const HmapLayer& layer) {
    if (layer.file.empty()) {
      LayerSpec spec{.name = layer.name, .kind = layer.kind, .frame_id = layer.frame_id};
      spec.grid = GridGeometry();
      edits().push_back(CreateLayer{std::move(spec)});
      return absl::OkStatus();
    }
    const std::string member = absl::StrCat(layer.file, ".yaml");
    HYPERMAP_ASSIGN_OR_RETURN(const std::string text, archive_.Read(member));
    const absl::StatusOr<MapServerYaml> yaml = ParseMapServerYaml(text);
    if (!yaml.ok()) return At(MemberPlace(member), yaml.status());
    HYPERMAP_ASSIGN_OR_RETURN(const std::string image, archive_.Read(yaml->image));
    const absl::Status status =
        AppendOccupancyLayer(layer.name, layer.frame_id, *yaml, image, pixels_left_, edits());
    return status.ok() ? status : At(MemberPlace(member), status);
  }

  absl::Status DecodeSemantic(const HmapLayer& layer) {
    edits().push_back(
        CreateLayer{LayerSpec{.name = layer.name, .kind = layer.kind, .frame_id = layer.frame_id}});
    if (layer.file.empty()) return absl::OkStatus();
    HYPERMAP_ASSIGN_OR_RETURN(const std::string text, archive_.Read(layer.file));
    SemanticObjectReader reader(layer.name, limits_, totals_, repairs_);
    const absl::Status status =
        ReadSemanticYaml(text, [&](const SemanticEntry& entry) { return reader.Take(entry); });
    if (!status.ok()) return At(MemberPlace(layer.file), status);
    for (SemanticObject& object : std::move(reader).Finish()) {
      HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
      edits().push_back(PutObject{layer.name, std::move(object), ""});
    }
    return absl::OkStatus();
  }

  static std::string MemberPlace(absl::string_view member) {
    return absl::StrCat("member \"", member, "\"");
  }

  ZipArchive archive_;
  const Limits limits_;
  int64_t pixels_left_;
  ImportTotals totals_;
  RepairLog repairs_;
  ImportedMap imported_;
};

}  // namespace

absl::StatusOr<ImportedMap> DecodeHmap(absl::string_view data, const Limits& limits) {
  HYPERMAP_ASSIGN_OR_RETURN(ZipArchive archive, ZipArchive::Open(data, limits));
  return HmapDecoder(std::move(archive), limits).Decode();
}

}  // namespace hypermap::storage
