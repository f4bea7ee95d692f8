// Maps, layers and revisions as the lists of a server name them, without their content.
#ifndef HYPERMAP_MAP_ENTRIES_H_
#define HYPERMAP_MAP_ENTRIES_H_

#include <cstdint>
#include <optional>
#include <string>

#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "map/grid/grid_geometry.h"
#include "map/layers/layer_properties.h"
#include "map/layers/layer_spec.h"
#include "map/snapshot.h"

namespace hypermap {

// What a server does with a map at the moment.
enum class MapState {
  kServing,   // everything
  kDamaged,   // some of the stored content can't be read; all else is answered and can be changed
  kReadOnly,  // changes can't be stored; queries are answered
  kClosed,    // nothing
};

inline constexpr MapState kMapStates[] = {MapState::kServing, MapState::kDamaged,
                                          MapState::kReadOnly, MapState::kClosed};

// Returns "serving", "damaged", "read_only" or "closed".
absl::string_view MapStateName(MapState state);

struct MapEntry {
  std::string name;
  std::string frame_id;
  Revision revision = 0;
  absl::Time create_time;
  int layer_count = 0;
  // Reason why the state is not kServing. Of a closed map only the name is known besides.
  std::string problem;
  // Distinguishes the history of the map from all others: revisions can be compared within one
  // incarnation only.
  uint64_t incarnation = 0;
  MapState state = MapState::kServing;

  friend bool operator==(const MapEntry&, const MapEntry&) = default;
};

struct LayerEntry {
  LayerSpec spec;
  // Number of objects of a semantic layer, or of cells in the extent of a grid.
  int64_t size = 0;
  // For grids: the box around all cells ever written. Absent if there are none.
  std::optional<CellBox> extent;
  // The newest revision that changed the layer or its content.
  Revision version = 0;
  // Describes the content, well enough to draw and print a layer of any kind.
  LayerProperties properties;
  // Why the stored content can't be read. Empty if it can.
  std::string problem = {};
};

struct RevisionRecord {
  Revision revision = 0;
  absl::Time time;
  std::string author;
  int64_t num_changes = 0;

  friend bool operator==(const RevisionRecord&, const RevisionRecord&) = default;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_ENTRIES_H_
