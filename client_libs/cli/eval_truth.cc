#include "client_libs/cli/eval_truth.h"

#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "client_libs/cli/file_formats.h"
#include "client_libs/cli/file_io.h"
#include "map/layers/layer_properties.h"
#include "map/values/value_query.h"
#include "storage/interchange/geojson.h"
#include "storage/interchange/hmap.h"

namespace hypermap::cli {
namespace {

// Name of the layer to which the objects of a GeoJSON file are decoded.
constexpr char kGeoJsonLayer[] = "truth";

absl::StatusOr<storage::ImportedMap> Decode(client::FileFormat format, const std::string& data) {
  switch (format) {
    case client::FileFormat::kGeoJson:
      return storage::DecodeGeoJson(data, kGeoJsonLayer, /*snapshot=*/nullptr, {});
    case client::FileFormat::kHmap:
      return storage::DecodeHmap(data, {});
    case client::FileFormat::kNav2:
      break;
  }
  return absl::InvalidArgumentError("holds no objects");
}

// Finds the named layer, or the only one, among the layers that the file creates.
absl::StatusOr<LayerSpec> FindLayer(const EditBatch& batch, const std::string& name) {
  std::vector<LayerSpec> found;
  for (const Edit& edit : batch.edits) {
    const auto* create = std::get_if<CreateLayer>(&edit);
    if (create == nullptr || !PropertiesOf(create->spec).has_shapes) continue;
    if (name.empty() || create->spec.name == name) found.push_back(create->spec);
  }
  if (found.size() == 1) return found.front();
  if (!name.empty()) {
    return absl::NotFoundError(absl::StrCat("has no semantic layer \"", name, "\""));
  }
  return absl::InvalidArgumentError(
      absl::StrCat("has ", found.size(), " semantic layers: choose one with --truth-layer"));
}

absl::StatusOr<PlacedObjects> Collect(storage::ImportedMap imported, const std::string& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(const LayerSpec spec, FindLayer(imported.batch, layer));
  PlacedObjects placed{spec.frame_id, {}};
  for (Edit& edit : imported.batch.edits) {
    auto* put = std::get_if<PutObject>(&edit);
    if (put != nullptr && put->layer == spec.name) placed.objects.push_back(std::move(put->object));
  }
  return placed;
}

}  // namespace

absl::StatusOr<PlacedObjects> ReadTruth(const std::string& path, const std::string& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(const client::FileFormat format, ImportFormatOf("", path));
  HYPERMAP_ASSIGN_OR_RETURN(const std::string data, ReadFile(path));
  absl::StatusOr<storage::ImportedMap> imported = Decode(format, data);
  absl::StatusOr<PlacedObjects> placed =
      imported.ok() ? Collect(*std::move(imported),
                              format == client::FileFormat::kGeoJson ? kGeoJsonLayer : layer)
                    : imported.status();
  if (placed.ok()) return placed;
  return absl::Status(placed.status().code(), absl::StrCat(path, ": ", placed.status().message()));
}

bool Counts(const SemanticObject& object, int min_visible_frames) {
  if (const auto it = object.attributes.find("detectable"); it != object.attributes.end()) {
    const auto* detectable = std::get_if<bool>(&it->second);
    if (detectable != nullptr && !*detectable) return false;
  }
  if (const auto it = object.attributes.find("visible_frames"); it != object.attributes.end()) {
    const auto* frames = std::get_if<int64_t>(&it->second);
    if (frames != nullptr && *frames < min_visible_frames) return false;
  }
  return true;
}

evaluation::Object ToEvaluate(const SemanticObject& object, const ValueAliases& aliases) {
  std::string label = FoldLabel(object.label);
  if (const auto it = aliases.find(label); it != aliases.end() && it->second.size() == 1) {
    label = *it->second.begin();
  }
  return {std::move(label), object.shape.polygon(), object.existence};
}

}  // namespace hypermap::cli
