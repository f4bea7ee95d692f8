// The results of decoding and encoding interchange files.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_IMPORTED_MAP_H_
#define HYPERMAP_STORAGE_INTERCHANGE_IMPORTED_MAP_H_

#include <string>
#include <vector>

#include "map/edits/edit.h"

namespace hypermap::storage {

// A decoded file.
struct ImportedMap {
  // The edits that bring the file's content into a map.
  EditBatch batch;
  // The layers that they change.
  std::vector<std::string> layers;
  // One line for each departure from the format, with how it was understood: "semantic object 22
  // (tvmonitor): missing comma after vertex 2".
  std::vector<std::string> repairs;
  // The frame that a map made by this import should have as its own: "map" where the file uses it
  // or names none, else the frame of the file's first layer.
  std::string frame_id = "map";
};

// One file of a format that may consist of several.
struct NamedFile {
  std::string name;  // a base name, no folders
  std::string data;
};

// An encoded map.
struct ExportedFiles {
  std::vector<NamedFile> files;
  // One line for each part of the map that the format can't carry.
  std::vector<std::string> omissions;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_IMPORTED_MAP_H_
