// The revision of a map that a query asks for.
#ifndef HYPERMAP_SERVER_RPC_ASKED_REVISION_H_
#define HYPERMAP_SERVER_RPC_ASKED_REVISION_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "map/query/as_of.h"
#include "map/query/query.h"
#include "server/session/map_session.h"

namespace hypermap::server {

// Gives the snapshot that a query is answered from: the newest one as it is in memory, or a view of
// a past revision, for which the content that the query can see is read from the history. Not
// thread safe.
class AskedRevision {
 public:
  // OUT_OF_RANGE naming the oldest kept revision or the newest one; UNAVAILABLE if the map does not
  // have as_of.min_revision, which after a wait means that it is closing.
  static absl::StatusOr<AskedRevision> Find(MapSession& session, const AsOf& as_of);

  Revision revision() const { return past_ ? past_->structure()->revision : newest_->revision; }
  // The incarnation of the map to which the revision belongs.
  uint64_t incarnation() const { return incarnation_; }
  // NOT_FOUND if the map did not know the frame at that revision.
  absl::StatusOr<std::string> ResolveFrame(const std::string& frame_id) const {
    return past_ ? past_->structure()->ResolveFrame(frame_id) : newest_->ResolveFrame(frame_id);
  }

  // The snapshot for a query with these arguments. It may lack content that this query can't see.
  absl::StatusOr<SnapshotPtr> ForPoint(const Scope& scope, const Point& p,
                                       double tolerance_m) const;
  absl::StatusOr<SnapshotPtr> ForArea(const Scope& scope, const std::optional<Polygon>& area) const;
  // With all of the layer. NOT_FOUND naming the layer, unless the snapshot is the newest.
  absl::StatusOr<SnapshotPtr> ForLayer(const std::string& layer) const;
  // REQUIRES: all points are finite.
  absl::StatusOr<SnapshotPtr> ForPoints(const Scope& scope, absl::Span<const Point> points,
                                        double tolerance_m) const;

  // hypermap::Nearest at this revision.
  absl::StatusOr<NearestNeighbours> Nearest(const Scope& scope, const Point& p,
                                            const ValueQuery& value, int k) const;

 private:
  AskedRevision() = default;

  SnapshotPtr newest_;
  uint64_t incarnation_ = 0;
  // Set for a past revision only. past_ reads through history_, and so must be destroyed first.
  std::optional<HistoryPool::Lease> history_;
  std::unique_ptr<storage::PastMap> past_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_ASKED_REVISION_H_
