// Other words for the labels of a layer, kept with it: the u of the Hypermap definition, where the
// common value is not the layer's own word. "tv" may stand for "tvmonitor", "furniture" for
// "chair", "couch" and "diningtable". Where a word is asked for, what has it as its label matches,
// and what has one of the labels it stands for. An alias stands for labels, not for other aliases.
#ifndef HYPERMAP_MAP_VALUES_VALUE_ALIASES_H_
#define HYPERMAP_MAP_VALUES_VALUE_ALIASES_H_

#include <map>
#include <set>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace hypermap {

// Alias -> labels, all of them folded (FoldLabel).
using ValueAliases = std::map<std::string, std::set<std::string>>;

// The same with all words folded. INVALID_ARGUMENT naming the alias that is empty, can't be asked
// for as a label (a keyword, a comparison, "tag:..."), holds a control character, is too long, or
// stands there twice; or that has such a label.
absl::StatusOr<ValueAliases> FoldAliases(const ValueAliases& aliases);

// What a layer may keep: folded words, as above, and at least one label each. INVALID_ARGUMENT
// naming the alias, RESOURCE_EXHAUSTED for more than 10,000 labels in all.
absl::Status Validate(const ValueAliases& aliases);

// Each alias of `changes` in place of what it was; those without labels are taken out.
void Update(ValueAliases& aliases, const ValueAliases& changes);

// The labels that the folded `word` stands for, itself among them.
std::set<std::string> LabelsFor(const ValueAliases& aliases, const std::string& word);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_VALUES_VALUE_ALIASES_H_
