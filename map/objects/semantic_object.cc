#include "map/objects/semantic_object.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/status/status_macros.h"
#include "map/values/value_query.h"

namespace hypermap {
namespace {

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

// Bytes of the heap that an allocation of `size` bytes takes.
int64_t Allocated(size_t size) {
  constexpr int64_t kHeader = 8;
  constexpr int64_t kUnit = 16;
  constexpr int64_t kLeast = 32;
  if (size == 0) return 0;
  return std::max(kLeast, (static_cast<int64_t>(size) + kHeader + kUnit - 1) / kUnit * kUnit);
}

// Bytes that a text takes beyond sizeof.
int64_t BytesOf(const std::string& text) {
  constexpr size_t kLongestInPlace = 15;
  return text.size() <= kLongestInPlace ? 0 : Allocated(text.size() + 1);
}

// Bytes of the entries of a B-tree with their nodes, which are about two thirds full.
template <typename Tree>
int64_t BytesOfNodes(const Tree& tree) {
  constexpr size_t kNode = 24;
  return Allocated(tree.empty() ? 0 : kNode + tree.size() * (sizeof *tree.begin() * 3 / 2 + 8));
}

int64_t BytesOf(const Shape& shape) {
  switch (shape.kind()) {
    case ShapeKind::kPolygon: {
      const Rings& rings = shape.polygon().rings();
      int64_t bytes = rings.size() > 1 ? Allocated(rings.size() * sizeof(Ring)) : 0;
      for (const Ring& ring : rings) bytes += Allocated(ring.size() * sizeof(Point));
      return bytes;
    }
    case ShapeKind::kLineString:
      return Allocated(shape.line_string().vertices().size() * sizeof(Point));
    case ShapeKind::kPoint:
      break;
  }
  return 0;
}

}  // namespace

int64_t ByteSize(const SemanticObject& object) {
  constexpr size_t kSharedCount = 16;
  int64_t bytes = Allocated(sizeof object + kSharedCount) + BytesOf(object.label) +
                  BytesOf(object.shape) + BytesOfNodes(object.classes) +
                  Allocated(object.tags.size() * sizeof(std::string)) +
                  BytesOfNodes(object.attributes);
  for (const auto& [word, score] : object.classes) bytes += BytesOf(word);
  for (const std::string& tag : object.tags) bytes += BytesOf(tag);
  for (const auto& [name, value] : object.attributes) {
    bytes += BytesOf(name);
    if (const auto* text = std::get_if<std::string>(&value)) bytes += BytesOf(*text);
  }
  return bytes;
}

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
