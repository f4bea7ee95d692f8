// What an interchange file becomes.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_IMPORTED_MAP_H_
#define HYPERMAP_STORAGE_INTERCHANGE_IMPORTED_MAP_H_

#include <cstdint>
#include <string>
#include <vector>

#include "map/edits/edit.h"

namespace hypermap::storage {

// Edits that bring the file's content into a map, and one line for each thing that was not as the
// format has it and how it was understood ("semantic object 22 (tvmonitor): missing comma after
// vertex 2").
struct ImportedMap {
  EditBatch batch;
  std::vector<std::string> layers;
  std::vector<std::string> repairs;
  // The frame that a map made by this import should have as its own: "map" where the file uses it
  // or names none, else the frame of the file's first layer.
  std::string frame_id = "map";
};

// One named file of an interchange format that consists of several.
struct NamedFile {
  std::string name;  // a base name, no folders
  std::string data;
};

// What an export made, and one line for each thing that the format can't carry.
struct ExportedFiles {
  std::vector<NamedFile> files;
  std::vector<std::string> omissions;
};

// Past one of these a file is refused with RESOURCE_EXHAUSTED naming the limit.
struct ImportLimits {
  int64_t max_unpacked_bytes = int64_t{1} << 30;
  int max_archive_members = 10000;
  int64_t max_image_pixels = int64_t{1} << 28;
  int64_t max_objects = 5'000'000;
  int max_vertices_per_polygon = 100'000;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_IMPORTED_MAP_H_
