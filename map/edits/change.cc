#include "map/edits/change.h"

#include <utility>

namespace hypermap {

AliasesSet ChangeOfAliases(std::string layer, const ValueAliases& before,
                           const ValueAliases& after) {
  AliasesSet change{std::move(layer), {}, {}};
  after.VisitUnshared(before, [&](const auto& entry, const auto* was) {
    if (was != nullptr && was->second == entry.second) return;
    if (was != nullptr) change.before.insert_or_assign(was->first, was->second);
    change.after.insert_or_assign(entry.first, entry.second);
  });
  before.VisitUnshared(after, [&](const auto& entry, const auto* is) {
    if (is == nullptr) change.before.insert_or_assign(entry.first, entry.second);
  });
  return change;
}

void CarryOut(const AliasesSet& change, ValueAliases* aliases) {
  for (const auto& [alias, labels] : change.before) {
    if (!change.after.contains(alias)) aliases->erase(alias);
  }
  for (const auto& [alias, labels] : change.after) aliases->insert_or_assign(alias, labels);
}

}  // namespace hypermap
