// Points as lines of text.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_POINT_LINES_H_
#define HYPERMAP_CLIENT_LIBS_CLI_POINT_LINES_H_

#include <cstddef>
#include <cstdint>
#include <istream>
#include <vector>

#include "absl/status/status.h"
#include "map/geometry/point.h"

namespace hypermap::cli {

// Reads a point a line, "X Y" or "X,Y"; empty lines and a first line "x,y" don't count.
class PointLines {
 public:
  // `in` outlives this.
  explicit PointLines(std::istream& in) : in_(in) {}

  // The next points: at most `max_points`, fewer where the input pauses. None at the end and before
  // a line that is wrong. Blocks until there is one.
  std::vector<Point> Next(size_t max_points);
  // Why there are no more: OK at the end, INVALID_ARGUMENT naming the line that is wrong.
  const absl::Status& status() const { return status_; }
  // Whether Next would wait for input.
  bool paused() const { return in_.rdbuf()->in_avail() == 0; }

 private:
  std::istream& in_;
  int64_t line_number_ = 0;
  absl::Status status_;
};

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_POINT_LINES_H_
