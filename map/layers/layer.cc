#include "map/layers/layer.h"

namespace hypermap {

absl::string_view AnswerStatusName(AnswerStatus status) {
  switch (status) {
    case AnswerStatus::kValue:
      return "value";
    case AnswerStatus::kUnknown:
      return "unknown";
    case AnswerStatus::kOutside:
      return "outside";
    case AnswerStatus::kNoTransform:
      return "no_transform";
    case AnswerStatus::kUnsupportedValue:
      return "unsupported_value";
    case AnswerStatus::kDamaged:
      return "damaged";
  }
  return "unknown";
}

void PointsContent::Clear() {
  statuses.clear();
  values.clear();
  hits.clear();
}

}  // namespace hypermap
