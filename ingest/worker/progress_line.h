// How far something is, on one line of a terminal.
#ifndef HYPERMAP_INGEST_WORKER_PROGRESS_LINE_H_
#define HYPERMAP_INGEST_WORKER_PROGRESS_LINE_H_

#include <ostream>
#include <string>

#include "ingest/worker/replay.h"

namespace hypermap::ingest {

// "[#####-----]  50 %" of 0.5.
std::string ProgressBar(double share);
// "[#####-----]  50 %  335/670 frames  41.2/s  0:08 left  3 skipped".
std::string ProgressText(const ReplaySummary& summary);

// Writes the line over the one before. One thread.
class ProgressLine {
 public:
  explicit ProgressLine(std::ostream& terminal) : terminal_(terminal) {}
  // Ends the line.
  ~ProgressLine();

  void Show(std::string text);

 private:
  std::ostream& terminal_;
  size_t shown_width_ = 0;
};

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_PROGRESS_LINE_H_
