// The default strategy: a Bayesian tracker of objects with a grid of evidence for each shape. See
// docs/fusion.md.
#ifndef HYPERMAP_MAP_FUSION_EVIDENCE_STRATEGY_H_
#define HYPERMAP_MAP_FUSION_EVIDENCE_STRATEGY_H_

#include <memory>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/fusion/strategy.h"

namespace hypermap::fusion {

absl::StatusOr<std::unique_ptr<Strategy>> MakeEvidenceStrategy(absl::string_view parameters);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_EVIDENCE_STRATEGY_H_
