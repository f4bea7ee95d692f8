// The revision of a map that a question is asked of.
#ifndef HYPERMAP_SERVER_RPC_ASKED_REVISION_H_
#define HYPERMAP_SERVER_RPC_ASKED_REVISION_H_

#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "map/query/as_of.h"
#include "map/query/query.h"
#include "server/session/map_session.h"

namespace hypermap::server {

// The newest revision is asked as it stands in memory; of an earlier one, what the question can see
// is read. One thread at a time.
class AskedRevision {
 public:
  // OUT_OF_RANGE naming the oldest kept revision, or the newest; UNAVAILABLE when the map closes
  // before it has as_of.min_revision.
  static absl::StatusOr<AskedRevision> Find(MapSession& session, const AsOf& as_of);

  Revision revision() const { return structure_->revision; }
  // NOT_FOUND for a frame that the map did not know.
  absl::StatusOr<std::string> ResolveFrame(const std::string& frame_id) const {
    return structure_->ResolveFrame(frame_id);
  }

  // Snapshots to ask this one question.
  absl::StatusOr<SnapshotPtr> ForPoint(const Scope& scope, const Point& p,
                                       double tolerance_m) const;
  absl::StatusOr<SnapshotPtr> ForArea(const Scope& scope, const std::optional<Polygon>& area) const;
  // All finite.
  absl::StatusOr<SnapshotPtr> ForPoints(const Scope& scope, absl::Span<const Point> points,
                                        double tolerance_m) const;

  // As hypermap::Nearest.
  absl::StatusOr<NearestAnswer> Nearest(const Scope& scope, const Point& p, const ValueQuery& value,
                                        int k) const;

 private:
  AskedRevision() = default;

  // The newest, or what it was without content.
  SnapshotPtr structure_;
  // Of an earlier revision; the map goes first.
  std::optional<HistoryPool::Lease> history_;
  std::unique_ptr<storage::PastMap> past_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_ASKED_REVISION_H_
