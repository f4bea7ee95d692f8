// Archives made by hand for tests.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_TESTING_ARCHIVE_H_
#define HYPERMAP_STORAGE_INTERCHANGE_TESTING_ARCHIVE_H_

#include <string>
#include <vector>

#include "gtest/gtest.h"
#include "storage/interchange/hmap.h"
#include "storage/interchange/imported_map.h"
#include "storage/interchange/zip_archive.h"

namespace hypermap::storage::testing {

inline std::string Zip(const std::vector<NamedFile>& members) {
  const absl::StatusOr<std::string> zip = MakeZip(members);
  EXPECT_TRUE(zip.ok()) << zip.status();
  return zip.value_or("");
}

// A .hmap of one semantic layer "semantic" in the frame "map", whose member is `yaml`.
inline std::string SemanticHmap(const std::string& yaml) {
  return Zip({{"hmap_config.yaml",
               "layers:\n"
               "  - {name: semantic, frame_id: map, load_file: true, file: semantic,"
               " class: SemanticLayer}\n"},
              {"semantic", yaml}});
}

// A .hmap of one occupancy layer "occupancy" in the frame "map".
inline std::string OccupancyHmap(const std::string& yaml, const std::string& image) {
  return Zip({{"hmap_config.yaml",
               "layers:\n"
               "  - {name: occupancy, frame_id: map, load_file: true, file: occupancy,"
               " class: OccupancyGridLayer}\n"},
              {"occupancy.yaml", yaml},
              {"occupancy.png", image}});
}

inline constexpr char kOccupancyYaml[] =
    "image: occupancy.png\nresolution: 0.5\norigin: [1, 2, 0]\nnegate: 0\n"
    "occupied_thresh: 1\nfree_thresh: 0\nmode: scale\n";

}  // namespace hypermap::storage::testing

#endif  // HYPERMAP_STORAGE_INTERCHANGE_TESTING_ARCHIVE_H_
