#include "tests/robustness/judge.h"

#include <algorithm>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"

namespace hypermap::robustness {
namespace {

// The part, or a text that no part has.
std::string PartOf(const Description& description, const std::string& name) {
  const auto found = description.find(name);
  return found == description.end() ? "(none)" : found->second;
}

std::set<std::string> NamesOf(const Description& a, const Description& b) {
  std::set<std::string> names;
  for (const auto& [name, text] : a) names.insert(name);
  for (const auto& [name, text] : b) names.insert(name);
  return names;
}

std::string Difference(const Description& found, const Description& expected) {
  std::string parts;
  for (const std::string& name : NamesOf(found, expected)) {
    const std::string is = PartOf(found, name);
    const std::string should = PartOf(expected, name);
    if (is == should) continue;
    const auto at = std::mismatch(is.begin(), is.end(), should.begin(), should.end()).first;
    const auto begin = static_cast<size_t>(std::max<ptrdiff_t>(at - is.begin() - 30, 0));
    absl::StrAppend(&parts, parts.empty() ? "" : "; ", name, " is \"", is.substr(begin, 100),
                    "\" instead of \"", should.substr(std::min(begin, should.size()), 100), "\"");
    if (parts.size() > 600) break;
  }
  return parts;
}

void EraseNotes(Description* description) {
  std::erase_if(*description, [](const auto& part) { return part.first.ends_with("/notes"); });
}

// Whether each part is that of one of the states.
bool IsMixtureOf(const Description& found, const std::vector<const Description*>& states) {
  std::set<std::string> names;
  for (const auto& [name, text] : found) names.insert(name);
  for (const Description* state : states) {
    for (const auto& [name, text] : *state) names.insert(name);
  }
  return std::all_of(names.begin(), names.end(), [&](const std::string& name) {
    return std::any_of(states.begin(), states.end(), [&](const Description* state) {
      return PartOf(found, name) == PartOf(*state, name);
    });
  });
}

}  // namespace

std::string NameOf(Outcome outcome) {
  switch (outcome) {
    case Outcome::kWhole:
      return "whole";
    case Outcome::kLost:
      return "lost";
    case Outcome::kHalfDone:
      return "half-done";
    case Outcome::kWrong:
      return "wrong";
    case Outcome::kWedged:
      return "wedged";
  }
  return "?";
}

Judgement Judge(absl::StatusOr<Description> found, const std::vector<Description>& states,
                int acknowledged, int begun, bool with_notes) {
  if (!found.ok()) return {Outcome::kWedged, found.status().ToString()};
  if (!with_notes) {
    std::vector<Description> plain = states;
    for (Description& state : plain) EraseNotes(&state);
    EraseNotes(&*found);
    return Judge(std::move(found), plain, acknowledged, begun, /*with_notes=*/true);
  }
  std::vector<const Description*> allowed;
  for (int i = acknowledged; i <= begun; ++i) {
    if (*found == states[i]) return {};
    allowed.push_back(&states[i]);
  }
  const std::string difference =
      absl::StrCat("after ", acknowledged, " steps: ", Difference(*found, states[acknowledged]));
  for (int i = 0; i < acknowledged; ++i) {
    if (*found == states[i]) {
      return {Outcome::kLost, absl::StrCat("as after ", i, " steps, ", difference)};
    }
  }
  if (IsMixtureOf(*found, allowed)) return {Outcome::kHalfDone, difference};
  for (int i = 0; i < acknowledged; ++i) allowed.push_back(&states[i]);
  if (IsMixtureOf(*found, allowed)) return {Outcome::kLost, difference};
  return {Outcome::kWrong, difference};
}

Judgement JudgeParts(const absl::StatusOr<Description>& found, const Description& state) {
  if (!found.ok()) return {Outcome::kWedged, found.status().ToString()};
  Description expected;
  for (const auto& [name, text] : *found) expected[name] = PartOf(state, name);
  if (*found == expected) return {};
  return {Outcome::kWrong, Difference(*found, expected)};
}

}  // namespace hypermap::robustness
