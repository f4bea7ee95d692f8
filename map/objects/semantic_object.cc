#include "map/objects/semantic_object.h"

#include <cmath>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

namespace hypermap {
namespace {

constexpr size_t kMaxWordLength = 1024;
constexpr size_t kMaxTextLength = 1 << 20;
constexpr size_t kMaxEntries = 10000;

// Words are compared, listed and printed, so that control characters and blank words are refused.
absl::Status ValidateWord(absl::string_view field, absl::string_view word) {
  if (absl::StripAsciiWhitespace(word).empty()) {
    return absl::InvalidArgumentError(absl::StrCat(field, " is empty"));
  }
  if (word.size() > kMaxWordLength) {
    return absl::InvalidArgumentError(
        absl::StrCat(field, " is longer than ", kMaxWordLength, " bytes"));
  }
  for (const char c : word) {
    if (absl::ascii_iscntrl(c)) {
      return absl::InvalidArgumentError(absl::StrCat(field, " holds a control character"));
    }
  }
  return absl::OkStatus();
}

absl::Status ValidateProbability(absl::string_view field, double p) {
  if (p >= 0.0 && p <= 1.0) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(field, " must be in [0, 1]"));
}

absl::Status ValidateCount(absl::string_view field, size_t count) {
  if (count <= kMaxEntries) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, " has more than ", kMaxEntries, " entries"));
}

absl::Status ValidateAttribute(const std::string& name, const AttributeValue& value) {
  if (auto status = ValidateWord("object.attributes key", name); !status.ok()) return status;
  if (const auto* number = std::get_if<double>(&value); number && !std::isfinite(*number)) {
    return absl::InvalidArgumentError(absl::StrCat("object.attributes[", name, "] is not finite"));
  }
  if (const auto* text = std::get_if<std::string>(&value); text && text->size() > kMaxTextLength) {
    return absl::InvalidArgumentError(
        absl::StrCat("object.attributes[", name, "] is longer than ", kMaxTextLength, " bytes"));
  }
  return absl::OkStatus();
}

absl::Status ValidateHeight(const HeightRange& height) {
  if (!std::isfinite(height.low_m) || !std::isfinite(height.high_m)) {
    return absl::InvalidArgumentError("object.height is not finite");
  }
  if (height.low_m > height.high_m) {
    return absl::InvalidArgumentError("object.height.low_m is above high_m");
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status Validate(const SemanticObject& object) {
  if (auto status = ValidateWord("object.label", object.label); !status.ok()) return status;
  if (auto status = ValidateProbability("object.existence", object.existence); !status.ok()) {
    return status;
  }
  if (auto status = ValidateCount("object.classes", object.classes.size()); !status.ok()) {
    return status;
  }
  for (const auto& [label, confidence] : object.classes) {
    if (auto status = ValidateWord("object.classes key", label); !status.ok()) return status;
    const std::string field = absl::StrCat("object.classes[", label, "]");
    if (auto status = ValidateProbability(field, confidence); !status.ok()) return status;
  }
  if (auto status = ValidateCount("object.tags", object.tags.size()); !status.ok()) return status;
  for (const std::string& tag : object.tags) {
    if (auto status = ValidateWord("object.tags entry", tag); !status.ok()) return status;
  }
  if (auto status = ValidateCount("object.attributes", object.attributes.size()); !status.ok()) {
    return status;
  }
  for (const auto& [name, value] : object.attributes) {
    if (auto status = ValidateAttribute(name, value); !status.ok()) return status;
  }
  return object.height ? ValidateHeight(*object.height) : absl::OkStatus();
}

}  // namespace hypermap
