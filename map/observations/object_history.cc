#include "map/observations/object_history.h"

namespace hypermap {

absl::string_view ObjectEventKindName(ObjectEventKind kind) {
  switch (kind) {
    case ObjectEventKind::kFounded:
      return "founded";
    case ObjectEventKind::kSeen:
      return "seen";
    case ObjectEventKind::kMissed:
      return "missed";
    case ObjectEventKind::kMerged:
      return "merged";
    case ObjectEventKind::kPinned:
      return "pinned";
    case ObjectEventKind::kRemoved:
      return "removed";
  }
  return "unknown";
}

}  // namespace hypermap
