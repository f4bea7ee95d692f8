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

constexpr int64_t kMaxLabels = 10000;
// Bytes of a node of a std::set of strings, with the bookkeeping of its allocation.
constexpr int64_t kLabelBytes = 80;

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
    if (folded.contains(word)) {
      return absl::InvalidArgumentError(absl::StrCat("aliases holds \"", word, "\" twice"));
    }
    std::set<std::string> folded_labels;
    for (const std::string& label : labels) {
      std::string folded_label = FoldLabel(label);
      const std::string field = absl::StrCat("aliases[\"", word, "\"] entry");
      HYPERMAP_RETURN_IF_ERROR(ValidateWord(field, folded_label));
      folded_labels.insert(std::move(folded_label));
    }
    folded.insert_or_assign(word, std::move(folded_labels));
  }
  return folded;
}

absl::Status Validate(const ValueAliases& aliases) {
  HYPERMAP_ASSIGN_OR_RETURN(const ValueAliases folded, FoldAliases(aliases));
  if (folded != aliases) return absl::InvalidArgumentError("aliases are not folded");
  for (const auto& [alias, labels] : aliases) {
    if (labels.empty()) {
      return absl::InvalidArgumentError(absl::StrCat("aliases[\"", alias, "\"] is empty"));
    }
  }
  return CheckNumLabels(NumLabels(aliases));
}

int64_t NumLabels(const ValueAliases& aliases) {
  int64_t num_labels = 0;
  for (const auto& [alias, labels] : aliases) num_labels += static_cast<int64_t>(labels.size());
  return num_labels;
}

absl::Status CheckNumLabels(int64_t num_labels) {
  if (num_labels <= kMaxLabels) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat("aliases stand for more than ", kMaxLabels, " labels"));
}

int64_t UnsharedBytes(const ValueAliases& aliases, const ValueAliases& older) {
  int64_t bytes = 0;
  aliases.VisitUnshared(older, [&](const auto& entry, const auto* before) {
    bytes += ValueAliases::kNodeBytes;
    if (before == &entry) return;
    bytes += static_cast<int64_t>(sizeof entry + entry.first.size());
    for (const std::string& label : entry.second) {
      bytes += kLabelBytes + static_cast<int64_t>(label.size());
    }
  });
  return bytes;
}

void Update(ValueAliases& aliases, const ValueAliases& changes) {
  for (const auto& [alias, labels] : changes) {
    if (labels.empty()) {
      aliases.erase(alias);
    } else {
      aliases.insert_or_assign(alias, labels);
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
