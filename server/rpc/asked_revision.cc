#include "server/rpc/asked_revision.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "server/session/past_snapshot.h"

namespace hypermap::server {
namespace {

// The revision that was the newest one at `time`.
absl::StatusOr<Revision> RevisionAt(MapSession& session, storage::HistoryReader& history,
                                    absl::Time time, Revision newest) {
  if (const absl::Time now = session.time().Now(); time > now) {
    return absl::OutOfRangeError(absl::StrCat("at_time ", absl::FormatTime(time),
                                              " is still to come, it is ", absl::FormatTime(now)));
  }
  HYPERMAP_ASSIGN_OR_RETURN(const Revision revision, history.RevisionAt(time));
  // Commits are on disk before they are published.
  return std::min(revision, newest);
}

}  // namespace

absl::StatusOr<AskedRevision> AskedRevision::Find(MapSession& session, const AsOf& as_of) {
  AskedRevision asked;
  asked.newest_ = session.snapshot();
  asked.incarnation_ = session.incarnation();
  const Revision newest = asked.revision();
  if (newest < as_of.min_revision) {
    return absl::UnavailableError(absl::StrCat("the map is closing at revision ", newest,
                                               ", min_revision is ", as_of.min_revision));
  }
  if (!as_of.is_past() || as_of.revision == newest) return asked;
  if (as_of.revision > newest) {
    return absl::OutOfRangeError(
        absl::StrCat("at_revision ", *as_of.revision, " is still to come, the newest is ", newest));
  }
  HYPERMAP_ASSIGN_OR_RETURN(HistoryPool::Lease history, session.OpenHistory());
  HYPERMAP_ASSIGN_OR_RETURN(
      const Revision revision,
      as_of.time ? RevisionAt(session, *history, *as_of.time, newest) : *as_of.revision);
  if (revision == newest) return asked;
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<storage::PastMap> past, history->At(revision));
  asked.history_.emplace(std::move(history));
  asked.past_ = std::move(past);
  return asked;
}

absl::StatusOr<SnapshotPtr> AskedRevision::ForPoint(const Scope& scope, const Point& p,
                                                    double tolerance_m) const {
  if (!past_) return newest_;
  return ReadPast(*past_, scope, Box{p, p}, tolerance_m);
}

absl::StatusOr<SnapshotPtr> AskedRevision::ForArea(const Scope& scope,
                                                   const std::optional<Polygon>& area) const {
  if (!past_) return newest_;
  return ReadPast(*past_, scope, area);
}

absl::StatusOr<SnapshotPtr> AskedRevision::ForLayer(const std::string& layer) const {
  if (!past_) return newest_;
  return ReadPastLayer(*past_, layer);
}

absl::StatusOr<SnapshotPtr> AskedRevision::ForPoints(const Scope& scope,
                                                     absl::Span<const Point> points,
                                                     double tolerance_m) const {
  if (!past_) return newest_;
  Box box;
  for (const Point& p : points) box.Extend(p);
  return ReadPast(*past_, scope, box, tolerance_m);
}

absl::StatusOr<NearestNeighbours> AskedRevision::Nearest(const Scope& scope, const Point& p,
                                                         const ValueQuery& value, int k) const {
  if (!past_) return hypermap::Nearest(*newest_, scope, p, value, k);
  return NearestInPast(*past_, scope, p, value, k);
}

}  // namespace hypermap::server
