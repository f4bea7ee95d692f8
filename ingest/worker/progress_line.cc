#include "ingest/worker/progress_line.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace hypermap::ingest {

std::string ProgressBar(double share) {
  constexpr int kBar = 24;
  const int filled = std::clamp(static_cast<int>(share * kBar), 0, kBar);
  return absl::StrFormat("[%s%s] %3.0f %%", std::string(filled, '#'),
                         std::string(kBar - filled, '-'), 100 * share);
}

std::string ProgressText(const ReplaySummary& summary) {
  const int64_t finished = summary.finished();
  const double share = summary.frames > 0
                           ? static_cast<double>(finished) / static_cast<double>(summary.frames)
                           : 1.0;
  std::string text =
      absl::StrFormat("%s  %d/%d frames", ProgressBar(share), finished, summary.frames);
  const double seconds = absl::ToDoubleSeconds(summary.time);
  const double done = static_cast<double>(finished - summary.known);
  if (seconds > 0.5 && done > 0.0) {
    const double rate = done / seconds;
    const int left = static_cast<int>(static_cast<double>(summary.frames - finished) / rate);
    absl::StrAppendFormat(&text, "  %.1f/s  %d:%02d left", rate, left / 60, left % 60);
  }
  if (summary.num_skipped() > 0) absl::StrAppend(&text, "  ", summary.num_skipped(), " skipped");
  return text;
}

ProgressLine::~ProgressLine() {
  if (shown_width_ > 0) terminal_ << std::endl;
}

void ProgressLine::Show(std::string text) {
  const size_t width = text.size();
  if (width < shown_width_) text.append(shown_width_ - width, ' ');
  shown_width_ = width;
  terminal_ << '\r' << text << std::flush;
}

}  // namespace hypermap::ingest
