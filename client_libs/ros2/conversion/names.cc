#include "client_libs/ros2/conversion/names.h"

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"

namespace hypermap::ros2 {

std::string NameInRos(const std::string& text) {
  std::string name;
  for (const char c : text) {
    name.push_back(absl::ascii_isalnum(static_cast<unsigned char>(c)) ? c : '_');
  }
  // A name of ROS does not begin with a digit.
  return absl::ascii_isdigit(static_cast<unsigned char>(name.front())) ? absl::StrCat("_", name)
                                                                       : name;
}

std::string GridTopicOf(const std::string& layer) {
  return absl::StrCat("grids/", NameInRos(layer));
}

std::string SemanticTopicOf(const std::string& layer) {
  return absl::StrCat(NameInRos(layer), "_semmap");
}

std::shared_ptr<const GridLayer> OccupancyLayerOf(const Snapshot& snapshot,
                                                  const std::string& name) {
  for (const auto& [layer_name, layer] : snapshot.layers) {
    const bool is_wanted = name.empty() || layer_name == name;
    if (is_wanted && layer->spec().kind == LayerKind::kOccupancy) return AsGrid(layer);
  }
  return nullptr;
}

}  // namespace hypermap::ros2
