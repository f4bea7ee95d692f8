// The common value of a query, written as one string:
//
//   free, occupied, unknown, explored, unexplored     keywords, any case
//   >0.65  >=0.65  <0.2  <=0.2  =1  0.2..0.5           comparisons; a range includes both ends
//   anything else                                      a class label, any case
//   tag:furniture                                      objects that have the tag, any case
//
// Each layer translates it into its own kind of value (the u of the paper's definition), or answers
// that it does not support it.
#ifndef HYPERMAP_MAP_VALUES_VALUE_QUERY_H_
#define HYPERMAP_MAP_VALUES_VALUE_QUERY_H_

#include <cstddef>
#include <limits>
#include <string>
#include <variant>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace hypermap {

enum class ValueKeyword { kFree, kOccupied, kUnknown, kExplored, kUnexplored };

// The numbers v with low <= v <= high, without the ends that are marked as open.
struct ValueRange {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false;
  bool high_open = false;

  bool Contains(double value) const {
    return (low_open ? value > low : value >= low) && (high_open ? value < high : value <= high);
  }
  friend bool operator==(const ValueRange&, const ValueRange&) = default;
};

// Folded, see FoldLabel.
struct ValueLabel {
  std::string label;
  friend bool operator==(const ValueLabel&, const ValueLabel&) = default;
};

struct ValueTag {
  std::string tag;
  friend bool operator==(const ValueTag&, const ValueTag&) = default;
};

using ValueQuery = std::variant<ValueKeyword, ValueRange, ValueLabel, ValueTag>;

// INVALID_ARGUMENT for an empty string, a comparison without a finite number, or a range whose ends
// are in the wrong order.
absl::StatusOr<ValueQuery> ParseValueQuery(absl::string_view text);

// Bytes of a word that things are found or listed by: a label, an alias, a tag, an attribute's
// name.
inline constexpr size_t kMaxWordLength = 1024;

// Returns the form in which labels and tags are compared: lower case, without leading and trailing
// blanks, and with single blanks between words.
std::string FoldLabel(absl::string_view label);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_VALUES_VALUE_QUERY_H_
