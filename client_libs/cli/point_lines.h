// Reads points from lines of text.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_POINT_LINES_H_
#define HYPERMAP_CLIENT_LIBS_CLI_POINT_LINES_H_

#include <cstddef>
#include <cstdint>
#include <istream>
#include <vector>

#include "absl/status/status.h"
#include "map/geometry/point.h"

namespace hypermap::cli {

// Reads one point per line, "X Y" or "X,Y". Empty lines and a header line "x,y" are skipped.
class PointLines {
 public:
  // `in` must outlive this.
  explicit PointLines(std::istream& in) : in_(in) {}

  // Returns the next points, at most `max_points`, and fewer if the input pauses. Blocks until
  // there is one. Empty at the end and before an invalid line.
  std::vector<Point> Next(size_t max_points);
  // After Next returned nothing: OK at the end, INVALID_ARGUMENT naming an invalid line.
  const absl::Status& status() const { return status_; }
  // Returns whether Next would wait for input.
  bool paused() const { return in_.rdbuf()->in_avail() == 0; }

 private:
  std::istream& in_;
  int64_t line_number_ = 0;
  absl::Status status_;
};

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_POINT_LINES_H_
