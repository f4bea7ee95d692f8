// Additional words for the labels of a layer, stored with the layer. They are the u of the Hypermap
// definition where the common value is not the layer's own word: "tv" may stand for "tvmonitor",
// and "furniture" for "chair", "couch" and "diningtable". A query for a word matches objects with
// that label, and objects with a label that the word stands for. An alias stands for labels, not
// for other aliases.
#ifndef HYPERMAP_MAP_VALUES_VALUE_ALIASES_H_
#define HYPERMAP_MAP_VALUES_VALUE_ALIASES_H_

#include <cstdint>
#include <set>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/containers/shared_map.h"

namespace hypermap {

// From alias to labels, all of them folded (FoldLabel). Copies share their entries, so that each of
// many revisions of a layer can keep its aliases.
using ValueAliases = SharedMap<std::string, std::set<std::string>>;

// Folds all words. INVALID_ARGUMENT names the alias that is empty, cannot be queried as a label (a
// keyword, a comparison, "tag:..."), contains a control character, is too long or occurs twice; or
// that has a label that is empty, too long or contains a control character.
absl::StatusOr<ValueAliases> FoldAliases(const ValueAliases& aliases);

// Checks the aliases of a layer: folded words as above, with at least one label each.
// INVALID_ARGUMENT names the alias; RESOURCE_EXHAUSTED for more than 10,000 labels in total.
absl::Status Validate(const ValueAliases& aliases);

// Returns the number of labels that all aliases stand for together.
int64_t NumLabels(const ValueAliases& aliases);

// RESOURCE_EXHAUSTED if a layer's aliases may not stand for as many labels as this.
absl::Status CheckNumLabels(int64_t num_labels);

// Bytes of memory of `aliases` that they do not share with `older`.
int64_t UnsharedBytes(const ValueAliases& aliases, const ValueAliases& older);

// Replaces the labels of each alias in `changes`, and removes those without labels.
void Update(ValueAliases& aliases, const ValueAliases& changes);

// Returns the labels that the folded `word` stands for, including itself.
std::set<std::string> LabelsFor(const ValueAliases& aliases, const std::string& word);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_VALUES_VALUE_ALIASES_H_
