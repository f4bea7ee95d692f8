#include "tests/prove/follower.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "tests/prove/writer.h"

namespace hypermap::prove {
namespace {

Thing ThingOf(const SemanticObject& object) { return {object.label, object.shape.bounds()}; }

void SetCells(const std::vector<CellRun>& runs, State& state) {
  for (const CellRun& run : runs) {
    for (int col = run.col_begin; col < run.col_end; ++col) {
      if (run.value) {
        state.cells[{run.row, col}] = *run.value;
      } else {
        state.cells.erase({run.row, col});
      }
    }
  }
}

}  // namespace

Faults& Faults::operator+=(const Faults& other) {
  gaps += other.gaps;
  repeats += other.repeats;
  reorders += other.reorders;
  wrong += other.wrong;
  return *this;
}

std::shared_ptr<client::Watcher> Follower::Open() {
  client::WatchOptions options;
  if (selection_.area) options.area = Polygon::FromBox(*selection_.area);
  options.classes.assign(selection_.classes.begin(), selection_.classes.end());
  options.start_revision = stretches_.back().reached;
  options.incarnation = stretches_.back().incarnation;
  options.coalesce = coalesce_;
  auto watcher = std::make_shared<client::Watcher>(client_.Watch(kMap, options));
  const MutexLock lock(&mutex_);
  watcher_ = watcher;
  return watcher;
}

void Follower::Cut() {
  std::shared_ptr<client::Watcher> watcher;
  {
    const MutexLock lock(&mutex_);
    watcher = watcher_;
  }
  if (watcher) watcher->Cancel();
}

absl::Status Follower::Run(const std::atomic<Revision>& last) {
  std::shared_ptr<client::Watcher> watcher = Open();
  while (last < 0 || !stretches_.back().reached || *stretches_.back().reached < last) {
    const std::optional<client::WatchEvent> event = watcher->Next();
    if (event) {
      HYPERMAP_RETURN_IF_ERROR(Take(*event));
      continue;
    }
    absl::Status status = watcher->status();
    num_resumed_ += watcher->num_resumed();
    if (absl::IsCancelled(status)) {
      ++num_resumed_;
    } else if ((absl::IsOutOfRange(status) || absl::IsAborted(status)) &&
               stretches_.back().reached) {
      // Compaction was faster than this watch, or the map is another incarnation. By the protocol
      // the watch starts again with a snapshot.
      stretches_.emplace_back();
      state_ = State();
    } else {
      return status;
    }
    watcher = Open();
  }
  num_resumed_ += watcher->num_resumed();
  return absl::OkStatus();
}

absl::Status Follower::Take(const client::WatchEvent& event) {
  Stretch& stretch = stretches_.back();
  stretch.reached = event.revision;
  stretch.incarnation = event.incarnation;
  incarnation_ = event.incarnation;
  ToldRevision told;
  told.revision = event.revision;
  if (event.snapshot) {
    if (stretch.begun_at) return absl::InternalError("a snapshot came where changes were wanted");
    stretch.begun_at = event.revision;
  }
  for (const client::MapChange& change : event.changes) {
    HYPERMAP_RETURN_IF_ERROR(Take(change, told));
  }
  if (event.snapshot) has_begun_ = true;
  if (!event.snapshot && !told.empty()) stretch.told.push_back(std::move(told));
  return absl::OkStatus();
}

absl::Status Follower::Take(const client::MapChange& change, ToldRevision& told) {
  switch (change.kind) {
    case ChangeKind::kPut:
    case ChangeKind::kEnter:
      if (!change.object) return absl::InternalError("an object was put that was not told");
      state_.things[change.object_id] = ThingOf(*change.object);
      told.things.emplace(change.object_id, change.kind);
      break;
    case ChangeKind::kRemove:
    case ChangeKind::kLeave:
      state_.things.erase(change.object_id);
      told.things.emplace(change.object_id, change.kind);
      break;
    case ChangeKind::kCells:
      SetCells(change.cells, state_);
      for (const CellRun& run : change.cells) {
        for (int col = run.col_begin; col < run.col_end; ++col) {
          told.cells[{run.row, col}] = run.value;
        }
      }
      break;
    default:  // changes of layers, which are not checked here
      break;
  }
  return absl::OkStatus();
}

int64_t Follower::num_told() const {
  size_t count = 0;
  for (const Stretch& stretch : stretches_) count += stretch.told.size();
  return static_cast<int64_t>(count);
}

Faults Follower::Check(const Model& model) const {
  Faults faults;
  for (const Stretch& stretch : stretches_) {
    faults.wrong += stretch.incarnation != stretches_.front().incarnation;
    Check(model, stretch, &stretch == &stretches_.back(), faults);
  }
  return faults;
}

Faults Follower::Check(const Model& model, uint64_t incarnation) const {
  Faults faults;
  for (const Stretch& stretch : stretches_) {
    if (stretch.incarnation != incarnation) continue;
    Check(model, stretch, &stretch == &stretches_.back(), faults);
  }
  return faults;
}

void Follower::Check(const Model& model, const Stretch& stretch, bool is_last,
                     Faults& faults) const {
  const std::vector<ToldRevision>& all = stretch.told;
  for (size_t i = 1; i < all.size(); ++i) {
    faults.repeats += all[i].revision == all[i - 1].revision;
    faults.reorders += all[i].revision < all[i - 1].revision;
  }
  std::map<Revision, const ToldRevision*> by_revision;
  for (const ToldRevision& told : all) by_revision.emplace(told.revision, &told);
  for (const ToldRevision& wanted : model.Told(stretch.begun_at.value_or(0), selection_)) {
    if (!is_last && wanted.revision > stretch.reached.value_or(0)) break;
    const auto it = by_revision.find(wanted.revision);
    if (it == by_revision.end()) {
      ++faults.gaps;
      continue;
    }
    faults.wrong += !(*it->second == wanted);
    by_revision.erase(it);
  }
  faults.wrong += static_cast<int64_t>(by_revision.size());
}

absl::StatusOr<State> AskState(client::Client& client, const Selection& selection,
                               std::optional<Revision> at) {
  const Box everywhere{{-1.0, -1.0}, {kSiteSize + 1.0, kSiteSize + 1.0}};
  client::CallOptions options;
  options.as_of.revision = at;
  client::AnswerReader reader =
      client.QueryArea(kMap, Polygon::FromBox(selection.area.value_or(everywhere)), {}, options);
  State state;
  while (const std::optional<client::LayerPart> part = reader.Next()) {
    if (part->status != AnswerStatus::kValue) return absl::InternalError("a layer did not answer");
    for (const SemanticObject& object : part->objects) {
      const Thing thing = ThingOf(object);
      if (selection.classes.empty() || selection.classes.count(thing.label) > 0) {
        state.things.emplace(object.id, thing);
      }
    }
    SetCells(part->runs, state);
  }
  HYPERMAP_RETURN_IF_ERROR(reader.status());
  return state;
}

}  // namespace hypermap::prove
