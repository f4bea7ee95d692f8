#include "server/watch/difference_source.h"

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "map/watch/net_changes.h"
#include "server/watch/stored_revision.h"
#include "server/watch/watch_messages.h"
#include "wire/scope.h"

namespace hypermap::server {
namespace {

// Bounds the time of a step, so that a worker thread can serve other calls between two steps.
constexpr int kChangesPerStep = 1024;
constexpr int64_t kLooksPerStep = 4096;  // As NetChanges::Reader::looks() counts: 32 tiles.

absl::StatusOr<StructurePtr> StructureAt(storage::HistoryReader& history, Revision revision) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<storage::PastMap> past, history.At(revision));
  return past->structure();
}

absl::Status CheckLayers(const MapStructure& from, const MapStructure& to,
                         const std::vector<std::string>& layers) {
  for (const std::string& layer : layers) {
    if (from.FindLayer(layer) || to.FindLayer(layer)) continue;
    return to.GetLayer(layer).status();
  }
  return absl::OkStatus();
}

class DifferenceSource : public MessageSource<v1::ListChangesResponse> {
 public:
  DifferenceSource(const Limits& limits, uint64_t incarnation, HistoryPool::Lease history,
                   StructurePtr from, StructurePtr to, std::vector<std::string> layers,
                   std::string frame_id)
      : limits_(limits),
        incarnation_(incarnation),
        history_(std::move(history)),
        from_(std::move(from)),
        to_(std::move(to)),
        layers_(std::move(layers)),
        frame_id_(std::move(frame_id)),
        taken_(from_->revision) {}

  absl::StatusOr<Step> Next(v1::ListChangesResponse* message) override {
    if (taken_ < to_->revision) return Take();
    // Others may use the reader while this answer is sent, which may take its client long.
    history_.reset();
    if (!difference_) difference_ = std::move(net_).Read(from_, to_, layers_, frame_id_);
    HYPERMAP_RETURN_IF_ERROR(FillMessage(message));
    if (message->changes().empty()) {
      if (!difference_->done()) return Step::kNothingYet;
      if (told_any_) return Step::kEnd;
    }
    told_any_ = true;
    message->set_from_revision(from_->revision);
    message->set_to_revision(to_->revision);
    message->set_incarnation(incarnation_);
    return Step::kMessage;
  }

  int64_t items() const override { return items_; }

 private:
  // Adds the next commits to the net difference.
  absl::StatusOr<Step> Take() {
    HYPERMAP_ASSIGN_OR_RETURN(const std::vector<storage::PastCommit> commits,
                              (*history_)->Commits(taken_, kChangesPerStep));
    if (commits.empty()) return absl::InternalError("the history ends too early");
    for (const storage::PastCommit& commit : commits) {
      if (commit.record.revision > to_->revision) break;
      net_.Add(commit.changes);
      taken_ = commit.record.revision;
    }
    return Step::kNothingYet;
  }

  // Adds changes until the message is full or the step is over.
  absl::Status FillMessage(v1::ListChangesResponse* message) {
    ChangeEncoder encoder(limits_, message->mutable_changes());
    const int64_t end = difference_->looks() + kLooksPerStep;
    while (!difference_->done() && !encoder.full() && difference_->looks() < end) {
      HYPERMAP_ASSIGN_OR_RETURN(const std::optional<MapChange> change, difference_->Next());
      if (!change) continue;
      encoder.Add(*change);
      ++items_;
    }
    return absl::OkStatus();
  }

  const Limits limits_;
  const uint64_t incarnation_;
  std::optional<HistoryPool::Lease> history_;  // until all commits are in net_
  const StructurePtr from_;
  const StructurePtr to_;
  const std::vector<std::string> layers_;
  const std::string frame_id_;
  Revision taken_;  // newest revision in net_
  NetChanges net_;
  std::optional<NetChanges::Reader> difference_;  // once all commits are in net_
  bool told_any_ = false;
  int64_t items_ = 0;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MessageSource<v1::ListChangesResponse>>> OpenDifference(
    const Facilities& facilities, const v1::ListChangesRequest& request) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                            FindMap(facilities, request.scope()));
  HYPERMAP_ASSIGN_OR_RETURN(Scope scope, wire::DecodeScope(request.scope(), facilities.limits));
  const Revision newest = session->snapshot()->revision;
  const Revision to = request.has_to_revision() ? request.to_revision() : newest;
  if (request.from_revision() < 0) return absl::InvalidArgumentError("from_revision is negative");
  for (const Revision revision : {request.from_revision(), to}) {
    if (revision <= newest) continue;
    return FutureRevisionError(*session, "revision", revision, newest);
  }
  if (to < request.from_revision()) {
    return absl::InvalidArgumentError("to_revision is before from_revision");
  }
  HYPERMAP_ASSIGN_OR_RETURN(HistoryPool::Lease history, session->OpenHistory());
  HYPERMAP_ASSIGN_OR_RETURN(StructurePtr before, StructureAt(*history, request.from_revision()));
  HYPERMAP_ASSIGN_OR_RETURN(StructurePtr after, StructureAt(*history, to));
  HYPERMAP_ASSIGN_OR_RETURN(std::string frame, after->ResolveFrame(request.scope().frame_id()));
  std::vector<std::string> layers = std::move(scope.layers);
  HYPERMAP_RETURN_IF_ERROR(CheckLayers(*before, *after, layers));
  return std::make_unique<DifferenceSource>(facilities.limits, session->incarnation(),
                                            std::move(history), std::move(before), std::move(after),
                                            std::move(layers), std::move(frame));
}

}  // namespace hypermap::server
