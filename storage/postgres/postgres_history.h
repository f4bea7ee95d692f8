// The history of a map, read from the database beside the writer.
#ifndef HYPERMAP_STORAGE_POSTGRES_POSTGRES_HISTORY_H_
#define HYPERMAP_STORAGE_POSTGRES_POSTGRES_HISTORY_H_

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "storage/cache_room.h"
#include "storage/generation_cache.h"
#include "storage/history.h"
#include "storage/libpq/connection.h"
#include "storage/postgres/object_versions.h"
#include "storage/postgres/past_map.h"
#include "storage/postgres/tile_versions.h"

namespace hypermap::storage::postgres {

// Converts an error of the database to that of a HistoryReader: adds the name of the map, and turns
// the INTERNAL of a statement that only reads into DATA_LOSS, and FAILED_PRECONDITION, such as a
// missing right, into UNAVAILABLE.
absl::Status HistoryStatus(const std::string& map, const absl::Status& status);

// Has a connection of its own, which it opens when it is first used, and again when it is lost.
// What is read at once is read in one snapshot transaction, so that, without prepared statements, a
// pooler that shares sessions between transactions may be in between. A PastMap keeps its
// transaction open; the database ends one that is not used for a minute, so that forgotten ones
// don't keep it from cleaning up.
class PostgresHistory : public HistoryReader {
 public:
  // Whether a map is read that was deleted, as long as none of its rows are removed.
  enum class DeletedMaps { kUnavailable, kRead };
  // `map` is the number of the map.
  PostgresHistory(ConnectOptions options, int64_t map, std::string map_name,
                  const CacheRoomPtr& cache_room, DeletedMaps deleted = DeletedMaps::kUnavailable);

  // Errors of all methods besides those of HistoryReader: UNAVAILABLE when the map was deleted, and
  // those of CheckCancelled and TakeMemory.
  absl::StatusOr<KeptRevisions> Kept() override;
  absl::StatusOr<Revision> RevisionAt(absl::Time time) override;
  absl::StatusOr<std::unique_ptr<PastMap>> At(Revision revision) override;
  absl::StatusOr<std::vector<PastCommit>> Commits(Revision after, int max_changes) override;
  absl::StatusOr<std::vector<RevisionRecord>> Revisions(Revision after, Revision before,
                                                        bool newest_first, int max_count) override;

 private:
  static constexpr int64_t kMaxStructureBytes = 4 << 20;  // that are cached

  // A snapshot transaction, the row of the map in it, and the rows of what else was asked for.
  struct Opened {
    std::shared_ptr<Connection> connection;  // outlives the transaction
    Transaction transaction;
    std::string frame_id;
    KeptRevisions kept;
    std::deque<Rows> answers;
  };
  // One round trip, with what `ask` asks for.
  absl::StatusOr<Opened> Begin(absl::FunctionRef<void(Pipeline&)> ask = [](Pipeline&) {});

  // Runs `use`, and once more on a new connection if the one that there was is lost: a connection
  // may have been lost since it was last used.
  absl::Status WithConnection(absl::FunctionRef<absl::Status(Connection&)> use);

  // OUT_OF_RANGE when the revision is not kept.
  absl::Status CheckKept(const KeptRevisions& kept, Revision revision) const;
  // Takes the answers to AskForStructureAt.
  void AskForStructureAt(Pipeline& pipeline, Revision revision) const;
  absl::StatusOr<PastStructurePtr> ReadStructureAt(Revision revision, Opened* opened);
  // The error of a map that has no row.
  absl::Status Deleted() const;
  absl::Status InMap(const absl::Status& status) const { return HistoryStatus(map_name_, status); }

  const ConnectOptions options_;
  const int64_t map_;
  const std::string map_name_;
  const bool reads_deleted_;
  std::shared_ptr<Connection> connection_;
  ObjectVersions objects_;
  TileVersions tiles_;
  GenerationCache<Revision, PastStructurePtr> structures_;
  // Up to this revision the map is known to have no frames but its own.
  Revision frameless_until_ = -1;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_POSTGRES_HISTORY_H_
