#include "client_libs/cpp/replica/replica.h"

#include <algorithm>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "base/status/status_macros.h"
#include "base/sync/deadline.h"
#include "base/sync/mutex.h"
#include "client_libs/cpp/replica/comparison.h"
#include "client_libs/cpp/replica/durable_copy.h"
#include "client_libs/cpp/replica/feed.h"
#include "client_libs/cpp/replica/local_answers.h"
#include "client_libs/cpp/replica/mirrored_area.h"
#include "client_libs/cpp/replica/published.h"
#include "map/layers/grid_layer.h"
#include "map/values/value_query.h"

namespace hypermap::client {
namespace {

// Describes the mirrored layers and area. Equal for options that select the same, independent of
// the frames and layers that the map has.
std::string SelectionOf(const ReplicaOptions& options) {
  const std::set<std::string> layers(options.layers.begin(), options.layers.end());
  std::string selection = layers.empty() ? "all layers" : absl::StrJoin(layers, ", ");
  if (!options.area) return selection;
  absl::StrAppend(&selection, " in frame \"", options.frame_id, "\" within");
  for (const Ring& ring : options.area->rings()) {
    absl::StrAppend(&selection, " (",
                    absl::StrJoin(ring, ", ",
                                  [](std::string* out, const Point& p) {
                                    absl::StrAppendFormat(out, "%.17g %.17g", p.x, p.y);
                                  }),
                    ")");
  }
  return selection;
}

}  // namespace

class Replica::Impl {
 public:
  // A revision and the part of it that is mirrored; immutable.
  struct View {
    SnapshotPtr snapshot;
    std::shared_ptr<const MirroredArea> area;  // null: everywhere
    uint64_t incarnation = 0;                  // of the map
  };

  Impl(Client client, const ReplicaOptions& options, std::unique_ptr<DurableCopy> disk)
      : options_(options), disk_(std::move(disk)) {
    std::optional<KnownRevision> known;
    if (disk_) known = disk_->stored();
    if (known) Publish(*known);
    feed_ = std::make_unique<Feed>(client, options, known,
                                   [this](const KnownRevision& newest) { Take(newest); });
    if (options.compare_every > absl::ZeroDuration() && !options.area) {
      comparison_ =
          std::make_unique<Comparison>(std::move(client), options, [this] { feed_->TakeAnew(); });
      if (known) comparison_->Note(*known);
    }
    feed_->Start();
  }
  // The comparison calls the feed, and the feed the comparison.
  ~Impl() {
    if (comparison_) comparison_->Stop();
  }

  // Returns OK when there is a revision to answer from.
  absl::Status AwaitContent() {
    if (has_content()) return absl::OkStatus();
    feed_->AwaitFirst();
    return has_content() ? absl::OkStatus() : feed_->standing().problem;
  }

  // For short reads. There is a view once AwaitContent has returned OK.
  Published<View>::Reading look() const { return view_.Read(); }
  // A copy, for longer use.
  View view() const { return *view_.Read(); }

  const std::string& map() const { return options_.map; }
  const Feed& feed() const { return *feed_; }
  DurableCopy* disk() const { return disk_.get(); }
  Comparison::Count compared() const {
    return comparison_ ? comparison_->count() : Comparison::Count();
  }

  absl::Status AwaitRevision(Revision revision, absl::Duration timeout) const {
    const MutexLock lock(&mutex_);
    const Deadline deadline(timeout);
    while (look()->snapshot->revision < revision) {
      const absl::Duration left = deadline.left();
      if (left <= absl::ZeroDuration()) {
        return absl::DeadlineExceededError(absl::StrCat(
            "the replica is at revision ", look()->snapshot->revision, ", not at ", revision));
      }
      published_.WaitFor(&mutex_, left);
    }
    return absl::OkStatus();
  }

 private:
  void Take(const KnownRevision& newest) {
    // First, so that Flush writes what others were told of.
    if (disk_) disk_->Write(newest);
    Publish(newest);
    if (comparison_) comparison_->Note(newest);
  }

  bool has_content() const { return look().get() != nullptr; }

  // Called by one thread at a time.
  void Publish(const KnownRevision& newest) {
    auto next = std::make_unique<View>();
    if (options_.area) {
      const auto last = look();
      next->area =
          last.get() != nullptr && last->area->Fits(*newest.snapshot)
              ? last->area
              : std::make_shared<MirroredArea>(*options_.area, options_.frame_id, *newest.snapshot);
    }
    next->snapshot = newest.snapshot;
    next->incarnation = newest.incarnation;
    view_.Set(std::move(next));
    // A thread in AwaitRevision either has seen the new revision or is waiting by now, and so does
    // not miss the notification.
    { const MutexLock lock(&mutex_); }
    published_.NotifyAll();
  }

  const ReplicaOptions options_;
  const std::unique_ptr<DurableCopy> disk_;  // null if nothing is stored

  Published<View> view_;
  // Guards nothing but the wait for published_.
  mutable Mutex mutex_;
  mutable CondVar published_;

  std::unique_ptr<Comparison> comparison_;  // null if the replica is never compared
  std::unique_ptr<Feed> feed_;              // destroyed first, since it calls Publish
};

absl::StatusOr<std::unique_ptr<Replica>> Replica::Open(Client client,
                                                       const ReplicaOptions& options) {
  std::unique_ptr<DurableCopy> disk;
  if (!options.folder.empty()) {
    HYPERMAP_ASSIGN_OR_RETURN(
        std::unique_ptr<DurableCopy> opened,
        DurableCopy::Open(options.folder, options.map, SelectionOf(options), options.write_delay));
    disk = std::move(opened);
  }
  auto impl = std::make_unique<Impl>(std::move(client), options, std::move(disk));
  HYPERMAP_RETURN_IF_ERROR(impl->AwaitContent());
  return std::unique_ptr<Replica>(new Replica(std::move(impl)));
}

Replica::Replica(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Replica::~Replica() = default;

absl::StatusOr<PointAnswer> Replica::QueryPoint(const Point& p, const Scope& scope,
                                                double tolerance_m) const {
  const auto view = impl_->look();
  const Snapshot& snapshot = *view->snapshot;
  absl::StatusOr<PointAnswer> answer(absl::in_place);
  HYPERMAP_ASSIGN_OR_RETURN(
      answer->frame_id,
      VisitContentAt(snapshot, scope, p, tolerance_m,
                     [&answer](const LayerPtr& layer, const PlanarTransform& caller_from_layer,
                               const PointContent& content) {
                       answer->layers.push_back(ToContent(*layer, caller_from_layer, content));
                     }));
  if (view->area) {
    HYPERMAP_RETURN_IF_ERROR(view->area->CheckPoint(snapshot, scope, p, tolerance_m));
  }
  answer->map = impl_->map();
  answer->revision = snapshot.revision;
  answer->incarnation = view->incarnation;
  answer->point = p;
  return answer;
}

absl::StatusOr<PointsAnswer> Replica::QueryPoints(absl::Span<const Point> points,
                                                  const Scope& scope, double tolerance_m) const {
  const Impl::View view = impl_->view();
  HYPERMAP_ASSIGN_OR_RETURN(PointsAsker asker,
                            PointsAsker::Make(view.snapshot, scope, tolerance_m));
  HYPERMAP_ASSIGN_OR_RETURN(const auto contents, asker.ContentAtEach(points));
  for (size_t i = 0; view.area && i < points.size(); ++i) {
    const absl::Status status =
        view.area->CheckPoint(*view.snapshot, scope, points[i], tolerance_m);
    if (status.ok()) continue;
    return absl::Status(status.code(), absl::StrCat("points[", i, "]: ", status.message()));
  }
  return ToPointsAnswer(view.snapshot, view.incarnation, points.size(), contents);
}

AnswerReader Replica::QueryArea(const Polygon& area, const Scope& scope) const {
  const Impl::View view = impl_->view();
  absl::StatusOr<std::unique_ptr<PartReader>> parts = ContentIn(view.snapshot, scope, area);
  if (!parts.ok()) return FailLocally(parts.status());
  if (view.area) {
    absl::Status status = view.area->CheckArea(*view.snapshot, scope, area);
    if (!status.ok()) return FailLocally(std::move(status));
  }
  return ReadLocally(*std::move(parts), view.snapshot->revision, view.incarnation);
}

AnswerReader Replica::QueryValue(const std::string& value, const std::optional<Polygon>& area,
                                 const Scope& scope) const {
  const Impl::View view = impl_->view();
  absl::StatusOr<ValueQuery> query = ParseValueQuery(value);
  if (!query.ok()) return FailLocally(query.status());
  std::optional<Polygon> searched = area;
  if (view.area && !area) {
    absl::StatusOr<Polygon> mirrored = view.area->InFrame(*view.snapshot, scope);
    if (!mirrored.ok()) return FailLocally(mirrored.status());
    searched = *std::move(mirrored);
  }
  absl::StatusOr<std::unique_ptr<PartReader>> parts =
      Search(view.snapshot, scope, *std::move(query), searched);
  if (!parts.ok()) return FailLocally(parts.status());
  if (view.area && area) {
    absl::Status status = view.area->CheckArea(*view.snapshot, scope, *area);
    if (!status.ok()) return FailLocally(std::move(status));
  }
  return ReadLocally(*std::move(parts), view.snapshot->revision, view.incarnation);
}

absl::StatusOr<NearestAnswer> Replica::QueryNearest(const Point& p, const std::string& value, int k,
                                                    const Scope& scope) const {
  const Impl::View view = impl_->view();
  const Snapshot& snapshot = *view.snapshot;
  HYPERMAP_ASSIGN_OR_RETURN(const ValueQuery query, ParseValueQuery(value));
  HYPERMAP_ASSIGN_OR_RETURN(const NearestNeighbours found, Nearest(snapshot, scope, p, query, k));
  if (view.area) {
    absl::Status status = view.area->CheckNearest(snapshot, scope, p, k, found);
    if (!status.ok()) return status;
  }
  NearestAnswer answer = ToNearestAnswer(found);
  answer.map = impl_->map();
  answer.revision = snapshot.revision;
  answer.incarnation = view.incarnation;
  answer.frame_id = *snapshot.ResolveFrame(scope.frame_id);
  return answer;
}

LayerList Replica::ListLayers() const {
  const Impl::View view = impl_->view();
  const SnapshotPtr& snapshot = view.snapshot;
  LayerList list{impl_->map(), snapshot->revision, {}, view.incarnation};
  for (const auto& [name, layer] : snapshot->layers) {
    LayerEntry entry{layer->spec(), layer->Size(), std::nullopt, snapshot->LayerVersionOf(name)};
    const auto* grid = AsGrid(layer.get());
    if (grid && !grid->extent().empty()) entry.extent = grid->extent();
    list.layers.push_back(std::move(entry));
  }
  return list;
}

TransformList Replica::ListTransforms() const {
  const Impl::View view = impl_->view();
  const Snapshot& snapshot = *view.snapshot;
  return {impl_->map(), snapshot.revision, snapshot.frame_id, snapshot.frames.transforms(),
          view.incarnation};
}

SnapshotPtr Replica::snapshot() const { return impl_->look()->snapshot; }

ReplicaState Replica::state() const {
  const Feed::Standing standing = impl_->feed().standing();
  const Impl::View view = impl_->view();
  Comparison::Count compared = impl_->compared();
  ReplicaState state{.revision = view.snapshot->revision,
                     .incarnation = view.incarnation,
                     .connected = standing.connected,
                     .newest_at = standing.newest_at,
                     .problem = standing.problem,
                     .num_resumed = standing.num_resumed,
                     .num_taken_anew = standing.num_taken_anew,
                     .num_equal = compared.num_equal,
                     .num_different = compared.num_different,
                     .last_difference = std::move(compared.last_difference)};
  if (const DurableCopy* disk = impl_->disk()) {
    if (const auto stored = disk->stored()) state.durable_revision = stored->snapshot->revision;
    if (state.problem.ok()) state.problem = disk->problem();
  }
  return state;
}

absl::Status Replica::AwaitRevision(Revision revision, absl::Duration timeout) const {
  return impl_->AwaitRevision(revision, timeout);
}

absl::Status Replica::Flush() { return impl_->disk() ? impl_->disk()->Flush() : absl::OkStatus(); }

}  // namespace hypermap::client
