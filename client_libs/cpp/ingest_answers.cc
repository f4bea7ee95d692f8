#include "client_libs/cpp/ingest_answers.h"

#include <algorithm>

namespace hypermap::client {

bool OpenedLayer::Knows(int64_t sequence) const {
  const auto after =
      std::upper_bound(known.begin(), known.end(), sequence,
                       [](int64_t s, const SequenceRange& range) { return s < range.first; });
  return after != known.begin() && sequence <= std::prev(after)->last;
}

absl::string_view ObservationOutcomeName(ObservationOutcome outcome) {
  switch (outcome) {
    case ObservationOutcome::kAccepted:
      return "accepted";
    case ObservationOutcome::kDuplicate:
      return "duplicate";
    case ObservationOutcome::kRefusedLate:
      return "refused_late";
    case ObservationOutcome::kInvalid:
      return "invalid";
    case ObservationOutcome::kConflict:
      return "conflict";
  }
  return "unknown";
}

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

}  // namespace hypermap::client
