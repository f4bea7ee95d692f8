#include "map/objects/semantic_object.h"

#include <cmath>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/status/status_macros.h"

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
  HYPERMAP_RETURN_IF_ERROR(ValidateWord("object.attributes key", name));
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
  HYPERMAP_RETURN_IF_ERROR(ValidateWord("object.label", object.label));
  HYPERMAP_RETURN_IF_ERROR(ValidateProbability("object.existence", object.existence));
  HYPERMAP_RETURN_IF_ERROR(ValidateCount("object.classes", object.classes.size()));
  for (const auto& [label, confidence] : object.classes) {
    HYPERMAP_RETURN_IF_ERROR(ValidateWord("object.classes key", label));
    const std::string field = absl::StrCat("object.classes[", label, "]");
    HYPERMAP_RETURN_IF_ERROR(ValidateProbability(field, confidence));
  }
  HYPERMAP_RETURN_IF_ERROR(ValidateCount("object.tags", object.tags.size()));
  for (const std::string& tag : object.tags) {
    HYPERMAP_RETURN_IF_ERROR(ValidateWord("object.tags entry", tag));
  }
  HYPERMAP_RETURN_IF_ERROR(ValidateCount("object.attributes", object.attributes.size()));
  for (const auto& [name, value] : object.attributes) {
    HYPERMAP_RETURN_IF_ERROR(ValidateAttribute(name, value));
  }
  return object.height ? ValidateHeight(*object.height) : absl::OkStatus();
}

}  // namespace hypermap
