// The assignment problem: an optimal one-to-one matching of rows with columns.
#ifndef HYPERMAP_MAP_MATCHING_ASSIGNMENT_H_
#define HYPERMAP_MAP_MATCHING_ASSIGNMENT_H_

#include <compare>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace hypermap::evaluation {

// The cost of an assignment, compared lexicographically: the least difference in the first part
// outweighs any in the second. Integers, so that sums are exact and ties are recognised.
struct Cost {
  int64_t first = 0;
  int64_t second = 0;
  int64_t third = 0;

  Cost& operator+=(const Cost& b) {
    first += b.first;
    second += b.second;
    third += b.third;
    return *this;
  }
  Cost& operator-=(const Cost& b) {
    first -= b.first;
    second -= b.second;
    third -= b.third;
    return *this;
  }
  friend Cost operator-(Cost a, const Cost& b) { return a -= b; }
  friend auto operator<=>(const Cost&, const Cost&) = default;
};

// Returns the column of each row in the cheapest assignment of all rows to different columns.
// Hungarian method (Kuhn 1955), O(rows^2 columns). `costs` is row-major, with parts below 2^40 in
// magnitude. There must be at least as many columns as rows.
std::vector<size_t> CheapestAssignment(size_t rows, size_t columns, const std::vector<Cost>& costs);

}  // namespace hypermap::evaluation

#endif  // HYPERMAP_MAP_MATCHING_ASSIGNMENT_H_
