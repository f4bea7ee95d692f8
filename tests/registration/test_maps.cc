#include "tests/registration/test_maps.h"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "map/edits/apply.h"
#include "map/layers/layer_registry.h"
#include "storage/interchange/geojson.h"
#include "storage/interchange/hmap.h"
#include "storage/interchange/nav2.h"

namespace hypermap::registration {
namespace {

absl::StatusOr<std::string> ReadFile(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return absl::NotFoundError(absl::StrCat("can't read ", path.string()));
  std::ostringstream content;
  content << file.rdbuf();
  return content.str();
}

// Returns the first occupancy layer of `before` with the edits of `batch`.
absl::StatusOr<TestMap> FirstGrid(const std::string& name, const Snapshot& before,
                                  const EditBatch& batch) {
  HYPERMAP_ASSIGN_OR_RETURN(const AppliedBatch applied, Apply(before, batch));
  for (const auto& [layer_name, layer] : applied.snapshot->layers) {
    if (layer->spec().kind == LayerKind::kOccupancy) return TestMap{name, AsGrid(layer)};
  }
  return absl::NotFoundError(absl::StrCat(name, " has no occupancy layer"));
}

absl::StatusOr<storage::ImportedMap> Decode(const std::filesystem::path& file) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string data, ReadFile(file));
  if (file.extension() == ".hmap") return storage::DecodeHmap(data, Limits());
  std::vector<storage::NamedFile> files = {{file.filename().string(), data}};
  for (const char* extension : {".pgm", ".png"}) {
    std::filesystem::path image = file;
    image.replace_extension(extension);
    absl::StatusOr<std::string> pixels = ReadFile(image);
    if (pixels.ok()) files.push_back({image.filename().string(), *std::move(pixels)});
  }
  return storage::DecodeNav2(files, "occupancy", "map", Limits());
}

}  // namespace

absl::StatusOr<TestMap> LoadMap(const std::filesystem::path& file) {
  HYPERMAP_ASSIGN_OR_RETURN(const storage::ImportedMap imported, Decode(file));
  Snapshot empty;
  empty.frame_id = imported.frame_id;
  return FirstGrid(file.stem().string(), empty, imported.batch);
}

absl::StatusOr<TestMap> TourOffice() {
  Snapshot empty;
  empty.frame_id = "map";
  const LayerSpec spec{.name = "occupancy",
                       .kind = LayerKind::kOccupancy,
                       .frame_id = "map",
                       .grid = GridGeometry{.resolution_m = 0.05}};
  HYPERMAP_ASSIGN_OR_RETURN(const AppliedBatch created,
                            Apply(empty, EditBatch{.edits = {CreateLayer{spec}}}));
  HYPERMAP_ASSIGN_OR_RETURN(const std::string walls,
                            ReadFile(HYPERMAP_SOURCE_DIR "/demo/office/floor.geojson"));
  HYPERMAP_ASSIGN_OR_RETURN(
      const storage::ImportedMap imported,
      storage::DecodeGeoJson(walls, "occupancy", created.snapshot.get(), Limits()));
  return FirstGrid("tour_office", *created.snapshot, imported.batch);
}

absl::StatusOr<std::vector<TestMap>> RealMaps(const std::filesystem::path& data) {
  std::vector<TestMap> maps;
  std::vector<std::filesystem::path> files;
  if (std::filesystem::exists(data / "maps")) {
    for (const auto& entry : std::filesystem::directory_iterator(data / "maps")) {
      if (entry.path().extension() == ".hmap") files.push_back(entry.path());
    }
  }
  const std::filesystem::path office = data / "rgbd" / "office_small" / "occupancy.yaml";
  if (std::filesystem::exists(office)) files.push_back(office);
  std::sort(files.begin(), files.end());
  for (const std::filesystem::path& file : files) {
    HYPERMAP_ASSIGN_OR_RETURN(TestMap map, LoadMap(file));
    if (map.name == "occupancy") map.name = file.parent_path().filename();
    maps.push_back(std::move(map));
  }
  return maps;
}

}  // namespace hypermap::registration
