#include "ingest/worker/replay.h"

#include <algorithm>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/status/status_macros.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"
#include "ingest/perception/observer.h"
#include "ingest/worker/ordered_pipeline.h"

namespace hypermap::ingest {
namespace {

constexpr absl::Duration kProgressInterval = absl::Milliseconds(100);
constexpr absl::Duration kReconnectInterval = absl::Milliseconds(500);

// Returns the part of an error message before the first colon, which is the same for all frames
// with this error (see RgbdDataset::Load).
std::string ReasonOf(const absl::Status& status) {
  const std::vector<std::string> parts =
      absl::StrSplit(absl::string_view(status.message()), absl::MaxSplits(':', 1));
  return parts[0];
}

void Add(const SkipCounts& counts, SkipCounts& sum) {
  for (const auto& [reason, count] : counts) sum[reason] += count;
}

// The result of perception for one frame.
struct Worked {
  absl::StatusOr<Observation> observation = absl::UnknownError("");
  FrameReport report;
  SkipCounts skipped;
};

class Replayer {
 public:
  Replayer(const ReplayOptions& options, const client::Client& client, const RgbdDataset& dataset,
           const Interruption& interruption, const ReplayProgress& progress)
      : options_(options),
        dataset_(dataset),
        interruption_(interruption),
        progress_(progress),
        observer_(options.make_segmenter(), options.occupancy, ObserverOptions()),
        client_(client) {
    for (size_t i = options.first; i < std::min(options.end, dataset.size()); i += options.stride) {
      pending_.push_back(i);
    }
    summary_.frames = static_cast<int64_t>(pending_.size());
    summary_.skipped_input = dataset.skipped();
  }

  absl::StatusOr<ReplaySummary> Run();

 private:
  // Sends the pending frames over one stream, until all are sent or the stream breaks.
  absl::Status RunStream();
  void LeaveOutKnown(const client::OpenedLayer& opened);
  void Send(client::ObserveStream& stream);
  void ReadAcknowledgements(client::ObserveStream& stream);
  Worked Work(size_t i) const;
  // Adds frame `i` to the summary, once. Returns whether it has an observation to send.
  bool Count(size_t i, const Worked& worked);
  void Note(const client::Acknowledgement& acknowledgement);
  bool WaitForTurn(size_t i);
  void ShowProgress(bool always);

  const ReplayOptions& options_;
  const RgbdDataset& dataset_;
  const Interruption& interruption_;
  const ReplayProgress& progress_;
  const Observer observer_;
  client::Client client_;
  // Frames that are not finished, ascending. This and the members up to the mutex are used by the
  // sending thread only.
  std::vector<size_t> pending_;
  std::vector<bool> counted_ = std::vector<bool>(dataset_.size(), false);
  std::vector<bool> skipped_ = std::vector<bool>(dataset_.size(), false);
  SteadyTime begin_ = SteadyTime::Now();
  std::optional<SteadyTime> first_sent_at_;
  absl::Time first_stamp_;
  SteadyTime shown_at_ = SteadyTime::InfinitePast();

  // The sending and the reading thread share the members below.
  Mutex mutex_;
  ReplaySummary summary_ ABSL_GUARDED_BY(mutex_);
  std::vector<bool> acknowledged_ ABSL_GUARDED_BY(mutex_) = std::vector<bool>(dataset_.size(),
                                                                              false);
  SteadyTime last_news_ ABSL_GUARDED_BY(mutex_) = SteadyTime::Now();
};

absl::StatusOr<ReplaySummary> Replayer::Run() {
  HYPERMAP_RETURN_IF_ERROR(EnsureTarget(client_, options_.target));
  absl::Status status;
  while (true) {
    status = RunStream();
    {
      const MutexLock lock(&mutex_);
      pending_.erase(std::remove_if(pending_.begin(), pending_.end(),
                                    [this](size_t i) {
                                      mutex_.AssertHeld();
                                      return skipped_[i] || acknowledged_[i];
                                    }),
                     pending_.end());
      // A server that is down may come back, and then continues where it was; other errors would
      // occur again.
      if (!absl::IsUnavailable(status)) break;
      if (SteadyTime::Now() - last_news_ > options_.patience) break;
    }
    if (interruption_.WaitUntil(SteadyTime::Now() + kReconnectInterval)) break;
  }
  const bool interrupted = interruption_.requested() && !pending_.empty();
  std::optional<client::SmoothingAnswer> smoothed;
  if (options_.smooth && status.ok() && !interrupted) {
    HYPERMAP_ASSIGN_OR_RETURN(smoothed,
                              client_.SmoothPoses(options_.target.map, options_.target.layer));
  }
  const MutexLock lock(&mutex_);
  summary_.interrupted = interrupted;
  summary_.smoothed = std::move(smoothed);
  if (summary_.smoothed) {
    summary_.revision = std::max(summary_.revision, int64_t{summary_.smoothed->revision});
  }
  summary_.time = SteadyTime::Now() - begin_;
  if (!status.ok() && !summary_.interrupted) return status;
  return summary_;
}

absl::Status Replayer::RunStream() {
  client::ObserveOptions observe = ObserveOptionsOf(options_.target);
  observe.robot = options_.dataset.robot;
  absl::StatusOr<std::unique_ptr<client::ObserveStream>> stream =
      client_.Observe(options_.target.map, options_.target.layer, observe);
  HYPERMAP_RETURN_IF_ERROR(stream.status());
  LeaveOutKnown((*stream)->opened());
  std::thread reader([this, &stream] { ReadAcknowledgements(**stream); });
  Send(**stream);
  (*stream)->WritesDone();
  reader.join();
  ShowProgress(true);
  return (*stream)->status();
}

void Replayer::LeaveOutKnown(const client::OpenedLayer& opened) {
  const auto end = std::remove_if(pending_.begin(), pending_.end(),
                                  [&](size_t i) { return opened.Knows(dataset_.sequence(i)); });
  const MutexLock lock(&mutex_);
  summary_.known += pending_.end() - end;
  pending_.erase(end, pending_.end());
  last_news_ = SteadyTime::Now();
}

void Replayer::Send(client::ObserveStream& stream) {
  OrderedPipeline<Worked> pipeline(pending_.size(), options_.threads,
                                   static_cast<size_t>(2 * options_.threads + 2),
                                   [this](size_t n) { return Work(pending_[n]); });
  for (const size_t i : pending_) {
    if (interruption_.requested()) return;
    const std::optional<Worked> worked = pipeline.Next();
    if (!worked) return;
    if (!Count(i, *worked)) {
      skipped_[i] = true;
    } else if (!WaitForTurn(i) || !stream.Write(*worked->observation)) {
      return;
    }
    ShowProgress(false);
  }
}

void Replayer::ReadAcknowledgements(client::ObserveStream& stream) {
  while (const std::optional<client::Acknowledgement> acknowledgement = stream.Read()) {
    Note(*acknowledgement);
  }
}

Worked Replayer::Work(size_t i) const {
  Worked worked;
  const absl::StatusOr<Frame> frame = dataset_.Load(i, worked.skipped);
  worked.observation = frame.ok() ? observer_.Observe(*frame, &worked.report)
                                  : absl::StatusOr<Observation>(frame.status());
  return worked;
}

bool Replayer::Count(size_t i, const Worked& worked) {
  const MutexLock lock(&mutex_);
  // Frames that were not acknowledged before a stream broke are processed again, but count once.
  if (counted_[i]) return worked.observation.ok();
  counted_[i] = true;
  if (!worked.observation.ok()) {
    ++summary_.skipped_frames[ReasonOf(worked.observation.status())];
    return false;
  }
  Add(worked.skipped, summary_.skipped_instances);
  const FrameReport& report = worked.report;
  summary_.instances += report.instances;
  summary_.detections += report.detections;
  if (report.without_points > 0) {
    summary_.skipped_instances["too few points with depth"] += report.without_points;
  }
  if (report.suppressed > 0) {
    summary_.skipped_instances["detection of a thing that another stands for"] += report.suppressed;
  }
  return true;
}

void Replayer::Note(const client::Acknowledgement& acknowledgement) {
  using Outcome = client::ObservationOutcome;
  const MutexLock lock(&mutex_);
  const auto i = static_cast<size_t>(acknowledgement.sequence);
  if (i >= acknowledged_.size() || acknowledged_[i]) return;
  acknowledged_[i] = true;
  last_news_ = SteadyTime::Now();
  summary_.revision = std::max(summary_.revision, acknowledgement.revision);
  switch (acknowledgement.outcome) {
    case Outcome::kAccepted:
      ++summary_.accepted;
      return;
    case Outcome::kDuplicate:
      ++summary_.duplicates;
      return;
    case Outcome::kRefusedLate:
      ++summary_.refused_late;
      break;
    case Outcome::kInvalid:
      ++summary_.invalid;
      break;
    case Outcome::kConflict:
      ++summary_.conflicts;
      break;
  }
  if (summary_.first_refusal.empty()) {
    summary_.first_refusal = absl::StrCat("frame ", i, ": ", acknowledgement.message);
  }
}

bool Replayer::WaitForTurn(size_t i) {
  if (options_.rate <= 0.0) return true;
  if (!first_sent_at_) {
    first_sent_at_ = SteadyTime::Now();
    first_stamp_ = dataset_.stamp(i);
  }
  const absl::Duration after = (dataset_.stamp(i) - first_stamp_) / options_.rate;
  return !interruption_.WaitUntil(*first_sent_at_ + after);
}

void Replayer::ShowProgress(bool always) {
  if (!progress_ || (!always && SteadyTime::Now() - shown_at_ < kProgressInterval)) return;
  shown_at_ = SteadyTime::Now();
  ReplaySummary summary;
  {
    const MutexLock lock(&mutex_);
    summary = summary_;
  }
  summary.time = SteadyTime::Now() - begin_;
  progress_(summary);
}

}  // namespace

int64_t ReplaySummary::num_skipped() const {
  int64_t sum = 0;
  for (const auto& [reason, count] : skipped_frames) sum += count;
  return sum;
}

int64_t ReplaySummary::finished() const {
  return known + accepted + duplicates + refused_late + invalid + conflicts + num_skipped();
}

absl::StatusOr<ReplaySummary> Replay(const ReplayOptions& options, const Interruption& interruption,
                                     const ReplayProgress& progress) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<RgbdDataset> dataset,
                            RgbdDataset::Open(options.folder, options.dataset));
  HYPERMAP_ASSIGN_OR_RETURN(
      const client::Client client,
      client::MakeClient(options.target.connection, {.retry_for = absl::ZeroDuration()}));
  return Replayer(options, client, *dataset, interruption, progress).Run();
}

}  // namespace hypermap::ingest
