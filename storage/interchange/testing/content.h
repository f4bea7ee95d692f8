// Helpers for the tests of this folder: real files, and the comparison of maps by their content.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_TESTING_CONTENT_H_
#define HYPERMAP_STORAGE_INTERCHANGE_TESTING_CONTENT_H_

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "gtest/gtest.h"
#include "map/edits/apply.h"
#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"
#include "storage/interchange/imported_map.h"

namespace hypermap::storage::testing {

// The folder of real maps and sequences; empty where there is none.
inline std::filesystem::path DataFolder() {
  if (const char* folder = std::getenv("HYPERMAP_DATA")) return folder;
  const std::filesystem::path folder = HYPERMAP_SOURCE_DIR "/../shared/data";
  return std::filesystem::exists(folder) ? folder : "";
}

inline std::string ReadFile(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream content;
  content << file.rdbuf();
  return content.str();
}

// An empty map with the import's frame and then its edits; fails the test when they don't apply.
inline Snapshot MapOf(const ImportedMap& imported) {
  Snapshot empty;
  empty.map_name = "site";
  empty.frame_id = imported.frame_id;
  const absl::StatusOr<AppliedBatch> applied = Apply(empty, imported.batch);
  EXPECT_TRUE(applied.ok()) << applied.status();
  return applied.ok() ? *applied->snapshot : empty;
}

inline const GridLayer& Grid(const Snapshot& map, const std::string& name) {
  return dynamic_cast<const GridLayer&>(*map.FindLayer(name));
}

// The objects of a layer by id, without their ids.
inline std::vector<SemanticObject> Objects(const Snapshot& map, const std::string& layer) {
  std::vector<SemanticObject> objects;
  for (const ObjectPtr& object :
       dynamic_cast<const SemanticLayer&>(*map.FindLayer(layer)).Objects()) {
    objects.push_back(*object);
    objects.back().id = 0;
  }
  return objects;
}

// The extent's values, lowest row first.
inline std::vector<std::optional<double>> Values(const GridLayer& grid) {
  std::vector<std::optional<double>> values;
  const CellBox& box = grid.extent();
  for (int32_t row = box.row_begin; row < box.row_end; ++row) {
    for (int32_t col = box.col_begin; col < box.col_end; ++col) {
      values.push_back(grid.ValueAt({row, col}));
    }
  }
  return values;
}

// Layers, frames and content; cells are compared from the lower left corner of the extent.
inline void ExpectSameContent(const Snapshot& a, const Snapshot& b) {
  EXPECT_EQ(a.frame_id, b.frame_id);
  EXPECT_EQ(a.frames.transforms(), b.frames.transforms());
  ASSERT_EQ(a.layers.size(), b.layers.size());
  for (const auto& [name, layer] : a.layers) {
    SCOPED_TRACE(name);
    ASSERT_NE(b.FindLayer(name), nullptr);
    const LayerSpec& other = b.FindLayer(name)->spec();
    EXPECT_EQ(layer->spec().frame_id, other.frame_id);
    ASSERT_EQ(layer->spec().kind, other.kind);
    if (layer->spec().kind == LayerKind::kSemantic) {
      EXPECT_EQ(Objects(a, name), Objects(b, name));
      continue;
    }
    EXPECT_EQ(layer->Bounds(), b.FindLayer(name)->Bounds());
    EXPECT_EQ(Grid(a, name).extent().rows(), Grid(b, name).extent().rows());
    EXPECT_EQ(Grid(a, name).extent().cols(), Grid(b, name).extent().cols());
    EXPECT_EQ(Values(Grid(a, name)), Values(Grid(b, name)));
  }
}

}  // namespace hypermap::storage::testing

#endif  // HYPERMAP_STORAGE_INTERCHANGE_TESTING_CONTENT_H_
