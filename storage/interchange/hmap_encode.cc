#include <algorithm>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/limits/limits.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"
#include "storage/interchange/hmap.h"
#include "storage/interchange/hmap_config.h"
#include "storage/interchange/occupancy_member.h"
#include "storage/interchange/occupancy_pixels.h"
#include "storage/interchange/png_codec.h"
#include "storage/interchange/semantic_objects.h"
#include "storage/interchange/semantic_yaml.h"
#include "storage/interchange/zip_archive.h"

namespace hypermap::storage {
namespace {

// Puts an archive together, layer by layer.
class HmapEncoder {
 public:
  explicit HmapEncoder(const Snapshot& snapshot) : snapshot_(snapshot) {
    names_.insert(kHmapConfigMember);
  }

  absl::StatusOr<ExportedFiles> Encode() && {
    for (const LayerPtr& layer : OwnFrameFirst()) {
      HYPERMAP_RETURN_IF_ERROR(AddLayer(*layer));
      HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    }
    config_.transforms = snapshot_.frames.transforms();
    ReportOwnFrame();
    members_.insert(members_.begin(), {kHmapConfigMember, FormatHmapConfig(config_)});
    HYPERMAP_ASSIGN_OR_RETURN(std::string archive, MakeZip(members_));
    exported_.files.push_back({snapshot_.map_name + ".hmap", std::move(archive)});
    return std::move(exported_);
  }

 private:
  // Readers take the frame of the first layer as the map's own.
  std::vector<LayerPtr> OwnFrameFirst() const {
    std::vector<LayerPtr> layers;
    for (const auto& [name, layer] : snapshot_.layers) layers.push_back(layer);
    std::stable_partition(layers.begin(), layers.end(), [&](const LayerPtr& layer) {
      return layer->spec().frame_id == snapshot_.frame_id;
    });
    return layers;
  }

  absl::Status AddLayer(const Layer& layer) {
    switch (layer.spec().kind) {
      case LayerKind::kOccupancy:
        return AddOccupancy(*AsGrid(&layer));
      case LayerKind::kSemantic:
        return AddSemantic(*AsSemantic(&layer));
      default:
        Omit(layer, absl::StrCat("left out, the format has no layers of the kind ",
                                 LayerKindName(layer.spec().kind)));
        return absl::OkStatus();
    }
  }

  absl::Status AddOccupancy(const GridLayer& layer) {
    const LayerSpec& spec = layer.spec();
    ReportLostByImage(layer, exported_.omissions);
    if (layer.extent().empty()) {
      config_.layers.push_back({spec.name, spec.kind, spec.frame_id, ""});
      if (layer.geometry() != GridGeometry()) Omit(layer, "its resolution and origin, being empty");
      return absl::OkStatus();
    }
    HYPERMAP_ASSIGN_OR_RETURN(const GridPicture picture,
                              TakePicture(layer, FixedLimits::kMaxExportPixels));
    if (picture.num_rounded > 0) {
      Omit(layer, absl::StrCat(picture.num_rounded, " values rounded to 1/100"));
    }
    HYPERMAP_ASSIGN_OR_RETURN(std::string png,
                              EncodePng(ScaleImage(picture), PngChannels::kGreyAlpha));

    const std::string file = FreeBaseName(spec.name);
    const MapServerYaml yaml{.image = file + ".png",
                             .geometry = picture.geometry,
                             .negate = false,
                             .occupied_thresh = 1.0,
                             .free_thresh = 0.0,
                             .mode = OccupancyMode::kScale};
    AddMember(file + ".yaml", FormatMapServerYaml(yaml));
    AddMember(file + ".png", std::move(png));
    config_.layers.push_back({spec.name, spec.kind, spec.frame_id, file});
    return absl::OkStatus();
  }

  absl::Status AddSemantic(const SemanticLayer& layer) {
    const LayerSpec& spec = layer.spec();
    const std::vector<ObjectPtr> polygons = Polygons(layer);
    std::string text;
    for (const ObjectPtr& object : polygons) {
      HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
      std::string entry;
      AppendSemanticEntry(ToSemanticEntry(*object), entry);
      // A string that grows takes up to twice its length.
      HYPERMAP_RETURN_IF_ERROR(TakeMemory(2 * static_cast<int64_t>(entry.size())));
      text += entry;
    }
    // A reader needs a list, also when it is empty.
    if (text.empty()) text = "[]\n";
    std::string member = spec.name;
    while (names_.contains(member)) member += "_";
    AddMember(member, std::move(text));
    config_.layers.push_back({spec.name, spec.kind, spec.frame_id, member});
    ReportLostProperties(layer, polygons);
    if (!spec.aliases.empty()) Omit(layer, absl::StrCat(spec.aliases.size(), " aliases"));
    if (!spec.shape_kinds.ContainsAll()) Omit(layer, "which kinds of shape it takes");
    return CheckCancelled();
  }

  // The objects that the original can read, which are those with polygons. The others are
  // omissions.
  std::vector<ObjectPtr> Polygons(const SemanticLayer& layer) {
    std::vector<ObjectPtr> polygons;
    int64_t num_line_strings = 0;
    int64_t num_points = 0;
    for (ObjectPtr& object : layer.Objects()) {
      switch (object->shape.kind()) {
        case ShapeKind::kPolygon:
          polygons.push_back(std::move(object));
          break;
        case ShapeKind::kLineString:
          ++num_line_strings;
          break;
        case ShapeKind::kPoint:
          ++num_points;
          break;
      }
    }
    const auto omit = [&](int64_t count, const char* what) {
      if (count == 0) return;
      Omit(layer, absl::StrCat(count, what, " left out, the format has polygons only"));
    };
    omit(num_line_strings, " objects with line strings");
    omit(num_points, " objects with points");
    return polygons;
  }

  // Breaks off when the work of this thread is cancelled.
  void ReportLostProperties(const SemanticLayer& layer, const std::vector<ObjectPtr>& objects) {
    int64_t classes = 0;
    int64_t existence = 0;
    int64_t height = 0;
    int64_t attributes = 0;
    for (const ObjectPtr& object : objects) {
      if (IsCancelled()) return;
      const LostInEntry lost = LostBy(*object);
      classes += lost.classes ? 1 : 0;
      existence += lost.existence ? 1 : 0;
      height += lost.height ? 1 : 0;
      attributes += lost.attributes ? 1 : 0;
    }
    std::string line;
    const auto add = [&](int64_t count, const char* what) {
      if (count > 0) absl::StrAppend(&line, line.empty() ? "" : ", ", what, " of ", count);
    };
    add(classes, "classes");
    add(existence, "existence");
    add(height, "height");
    add(attributes, "attributes");
    if (!line.empty()) Omit(layer, absl::StrCat(line, " objects"));
  }

  void ReportOwnFrame() {
    if (snapshot_.frame_id == "map") return;
    const bool told = !config_.layers.empty() &&
                      config_.layers.front().frame_id == snapshot_.frame_id &&
                      !snapshot_.KnowsFrame("map");
    if (told) return;
    exported_.omissions.push_back(
        absl::StrCat("that the map's own frame is \"", snapshot_.frame_id, "\""));
  }

  // A name under which both files of an occupancy layer can be written.
  std::string FreeBaseName(std::string name) const {
    while (names_.contains(name + ".yaml") || names_.contains(name + ".png")) name += "_";
    return name;
  }

  void AddMember(const std::string& name, std::string data) {
    names_.insert(name);
    members_.push_back({name, std::move(data)});
  }

  void Omit(const Layer& layer, absl::string_view what) {
    exported_.omissions.push_back(absl::StrCat("layer \"", layer.spec().name, "\": ", what));
  }

  const Snapshot& snapshot_;
  HmapConfig config_;
  std::vector<NamedFile> members_;
  absl::flat_hash_set<std::string> names_;  // of members, taken
  ExportedFiles exported_;
};

}  // namespace

absl::StatusOr<ExportedFiles> EncodeHmap(const Snapshot& snapshot) {
  return HmapEncoder(snapshot).Encode();
}

}  // namespace hypermap::storage
