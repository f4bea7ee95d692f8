#include <array>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "map/fusion/evidence_parameters.h"
#include "map/fusion/evidence_strategy.h"
#include "map/fusion/paper_strategy.h"
#include "map/fusion/strategy.h"

namespace hypermap::fusion {

std::vector<std::string> StrategyNames() { return {"evidence", "paper"}; }

absl::StatusOr<std::unique_ptr<Strategy>> MakeStrategy(absl::string_view name,
                                                       absl::string_view parameters) {
  if (name == "evidence") return MakeEvidenceStrategy(parameters);
  if (name == "paper") return MakePaperStrategy(parameters);
  return absl::InvalidArgumentError(absl::StrCat("strategy: there is no '", name, "'; there are ",
                                                 absl::StrJoin(StrategyNames(), ", ")));
}

std::string ParametersOfNewLayer(absl::string_view strategy, absl::string_view parameters) {
  return strategy == "evidence" ? ForNewLayer(parameters) : std::string(parameters);
}

}  // namespace hypermap::fusion
