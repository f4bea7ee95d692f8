// A progress bar on one line of a terminal.
#ifndef HYPERMAP_INGEST_WORKER_PROGRESS_LINE_H_
#define HYPERMAP_INGEST_WORKER_PROGRESS_LINE_H_

#include <ostream>
#include <string>

#include "ingest/worker/replay.h"

namespace hypermap::ingest {

// Returns "[#####-----]  50 %" for a share of 0.5.
std::string ProgressBar(double share);
// Returns "[#####-----]  50 %  335/670 frames  41.2/s  0:08 left  3 skipped" or the like. Frames
// that the server already had do not count towards the rate.
std::string ProgressText(const ReplaySummary& summary);

// A line of a terminal that is overwritten by each Show(). For use by one thread.
class ProgressLine {
 public:
  explicit ProgressLine(std::ostream& terminal) : terminal_(terminal) {}
  // Ends the line if anything was shown.
  ~ProgressLine();

  void Show(std::string text);

 private:
  std::ostream& terminal_;
  size_t shown_width_ = 0;
};

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_PROGRESS_LINE_H_
