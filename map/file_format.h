// The formats of the files that a map is imported from and exported to.
#ifndef HYPERMAP_MAP_FILE_FORMAT_H_
#define HYPERMAP_MAP_FILE_FORMAT_H_

namespace hypermap {

enum class FileFormat {
  kHmap,     // A zip archive of several layers and transforms.
  kNav2,     // The map_server YAML file of an occupancy layer, and its image.
  kGeoJson,  // The objects of semantic layers.
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_FILE_FORMAT_H_
