#include "map/matching/assignment.h"

#include <limits>

namespace hypermap::evaluation {
namespace {

constexpr Cost kInfinite{std::numeric_limits<int64_t>::max() / 4, 0, 0};

// Extends an assignment row by row, each time along the cheapest augmenting path. Potentials keep
// all reduced costs at or above zero, and those of assigned pairs at zero. Rows and columns count
// from 1; column 0 stands for the row that is being added.
class HungarianMethod {
 public:
  HungarianMethod(size_t rows, size_t columns, const std::vector<Cost>& costs)
      : columns_(columns),
        costs_(costs),
        row_potential_(rows + 1),
        column_potential_(columns + 1),
        row_of_(columns + 1, 0),
        before_(columns + 1, 0) {}

  void AddRow(size_t row) {
    row_of_[0] = row;
    std::vector<Cost> slack(columns_ + 1, kInfinite);
    std::vector<bool> reached(columns_ + 1, false);
    size_t column = 0;
    do {
      reached[column] = true;
      column = Reach(column, slack, reached);
    } while (row_of_[column] != 0);
    for (; column != 0; column = before_[column]) row_of_[column] = row_of_[before_[column]];
  }

  size_t RowOf(size_t column) const { return row_of_[column]; }

 private:
  // Relaxes the edges from the row of `from`, changes the potentials until one more column has no
  // slack, and returns that column.
  size_t Reach(size_t from, std::vector<Cost>& slack, const std::vector<bool>& reached) {
    const size_t row = row_of_[from];
    size_t nearest = 0;
    Cost least = kInfinite;
    for (size_t column = 1; column <= columns_; ++column) {
      if (reached[column]) continue;
      Cost reduced = costs_[(row - 1) * columns_ + column - 1];
      reduced -= row_potential_[row];
      reduced -= column_potential_[column];
      if (reduced < slack[column]) {
        slack[column] = reduced;
        before_[column] = from;
      }
      if (slack[column] < least) {
        least = slack[column];
        nearest = column;
      }
    }
    for (size_t column = 0; column <= columns_; ++column) {
      if (reached[column]) {
        row_potential_[row_of_[column]] += least;
        column_potential_[column] -= least;
      } else {
        slack[column] -= least;
      }
    }
    return nearest;
  }

  const size_t columns_;
  const std::vector<Cost>& costs_;
  std::vector<Cost> row_potential_;
  std::vector<Cost> column_potential_;
  std::vector<size_t> row_of_;  // 0: none.
  std::vector<size_t> before_;  // The previous column on the path.
};

}  // namespace

std::vector<size_t> CheapestAssignment(size_t rows, size_t columns,
                                       const std::vector<Cost>& costs) {
  HungarianMethod method(rows, columns, costs);
  for (size_t row = 1; row <= rows; ++row) method.AddRow(row);
  std::vector<size_t> column_of(rows);
  for (size_t column = 1; column <= columns; ++column) {
    if (const size_t row = method.RowOf(column); row != 0) column_of[row - 1] = column - 1;
  }
  return column_of;
}

}  // namespace hypermap::evaluation
