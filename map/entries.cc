#include "map/entries.h"

namespace hypermap {

absl::string_view MapStateName(MapState state) {
  switch (state) {
    case MapState::kServing:
      return "serving";
    case MapState::kDamaged:
      return "damaged";
    case MapState::kReadOnly:
      return "read_only";
    case MapState::kClosed:
      return "closed";
  }
  return "unknown";
}

}  // namespace hypermap
