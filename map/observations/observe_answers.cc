#include "map/observations/observe_answers.h"

#include <algorithm>
#include <iterator>

namespace hypermap {

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

void AppendSequences(const SequenceRange& added, std::vector<SequenceRange>* ranges) {
  if (!ranges->empty() && ranges->back().last == added.first - 1) {
    ranges->back().last = added.last;
  } else {
    ranges->push_back(added);
  }
}

void AppendSequence(int64_t sequence, std::vector<SequenceRange>* ranges) {
  AppendSequences({sequence, sequence}, ranges);
}

bool OpenedLayer::Knows(int64_t sequence) const {
  const auto after =
      std::upper_bound(known.begin(), known.end(), sequence,
                       [](int64_t s, const SequenceRange& range) { return s < range.first; });
  return after != known.begin() && sequence <= std::prev(after)->last;
}

}  // namespace hypermap
