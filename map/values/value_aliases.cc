#include "map/values/value_aliases.h"

#include <algorithm>
#include <variant>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/status/status_macros.h"
#include "map/values/value_query.h"

namespace hypermap {
namespace {

constexpr size_t kMaxWordLength = 1024;
constexpr size_t kMaxLabels = 10000;

absl::Status ValidateWord(absl::string_view field, absl::string_view word) {
  if (word.empty()) return absl::InvalidArgumentError(absl::StrCat(field, " is empty"));
  if (word.size() > kMaxWordLength) {
    return absl::InvalidArgumentError(
        absl::StrCat(field, " is longer than ", kMaxWordLength, " bytes"));
  }
  const bool has_control =
      std::any_of(word.begin(), word.end(), [](unsigned char c) { return absl::ascii_iscntrl(c); });
  if (has_control) {
    return absl::InvalidArgumentError(absl::StrCat(field, " holds a control character"));
  }
  return absl::OkStatus();
}

absl::Status ValidateAlias(absl::string_view alias) {
  HYPERMAP_RETURN_IF_ERROR(ValidateWord("aliases key", alias));
  const absl::StatusOr<ValueQuery> asked = ParseValueQuery(alias);
  if (asked.ok() && std::holds_alternative<ValueLabel>(*asked)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("aliases key \"", alias, "\" has a meaning of its own in questions"));
}

}  // namespace

absl::StatusOr<ValueAliases> FoldAliases(const ValueAliases& aliases) {
  ValueAliases folded;
  for (const auto& [alias, labels] : aliases) {
    const std::string word = FoldLabel(alias);
    HYPERMAP_RETURN_IF_ERROR(ValidateAlias(word));
    const auto [entry, is_new] = folded.try_emplace(word);
    if (!is_new) {
      return absl::InvalidArgumentError(absl::StrCat("aliases holds \"", word, "\" twice"));
    }
    for (const std::string& label : labels) {
      std::string folded_label = FoldLabel(label);
      const std::string field = absl::StrCat("aliases[\"", word, "\"] entry");
      HYPERMAP_RETURN_IF_ERROR(ValidateWord(field, folded_label));
      entry->second.insert(std::move(folded_label));
    }
  }
  return folded;
}

absl::Status Validate(const ValueAliases& aliases) {
  HYPERMAP_ASSIGN_OR_RETURN(const ValueAliases folded, FoldAliases(aliases));
  if (folded != aliases) return absl::InvalidArgumentError("aliases are not folded");
  size_t num_labels = 0;
  for (const auto& [alias, labels] : aliases) {
    if (labels.empty()) {
      return absl::InvalidArgumentError(absl::StrCat("aliases[\"", alias, "\"] is empty"));
    }
    num_labels += labels.size();
  }
  if (num_labels <= kMaxLabels) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat("aliases stand for more than ", kMaxLabels, " labels"));
}

void Update(ValueAliases& aliases, const ValueAliases& changes) {
  for (const auto& [alias, labels] : changes) {
    if (labels.empty()) {
      aliases.erase(alias);
    } else {
      aliases[alias] = labels;
    }
  }
}

std::set<std::string> LabelsFor(const ValueAliases& aliases, const std::string& word) {
  std::set<std::string> labels{word};
  if (const auto it = aliases.find(word); it != aliases.end()) {
    labels.insert(it->second.begin(), it->second.end());
  }
  return labels;
}

}  // namespace hypermap
