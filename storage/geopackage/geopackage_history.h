// The history of a map, read from its file beside the writer.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_GEOPACKAGE_HISTORY_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_GEOPACKAGE_HISTORY_H_

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "storage/generation_cache.h"
#include "storage/geopackage/change_log.h"
#include "storage/geopackage/map_metadata.h"
#include "storage/geopackage/object_versions.h"
#include "storage/geopackage/past_map.h"
#include "storage/geopackage/tile_versions.h"
#include "storage/history.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Converts an error of the file to that of a HistoryReader: adds the name of the map, and turns the
// INTERNAL of a statement that only reads into DATA_LOSS.
absl::Status HistoryStatus(const std::string& map, const absl::Status& status);

// Has a connection of its own, which sees committed revisions and never waits for the writer.
class GeoPackageHistory : public HistoryReader {
 public:
  static absl::StatusOr<std::unique_ptr<HistoryReader>> Open(const std::string& path,
                                                             const std::string& map_name,
                                                             absl::Duration busy_timeout,
                                                             CacheRoomPtr cache_room);

  absl::StatusOr<KeptRevisions> Kept() override;
  absl::StatusOr<Revision> RevisionAt(absl::Time time) override;
  absl::StatusOr<std::unique_ptr<PastMap>> At(Revision revision) override;
  absl::StatusOr<std::vector<PastCommit>> Commits(Revision after, int max_changes) override;
  absl::StatusOr<std::vector<RevisionRecord>> Revisions(Revision after, Revision before,
                                                        bool newest_first, int max_count) override;

 private:
  static constexpr int64_t kMaxStructureBytes = 4 << 20;  // that are cached
  using Lineages = absl::flat_hash_map<int64_t, Lineage>;

  GeoPackageHistory(std::unique_ptr<Database> database, std::string map_name,
                    const CacheRoomPtr& cache_room);

  // Reads the metadata, within a transaction. OUT_OF_RANGE when the revision is not kept.
  absl::StatusOr<MapMetadata> CheckKept(Revision revision);
  absl::StatusOr<PastStructurePtr> StructureAt(const MapMetadata& metadata, Revision revision);
  absl::StatusOr<absl::Time> TimeOf(const MapMetadata& metadata, Revision revision);
  absl::StatusOr<std::vector<RevisionRecord>> ReadRevisions(Revision after, Revision before,
                                                            bool newest_first, int64_t max_count);
  absl::StatusOr<std::vector<PastCommit>> ReadCommits(Revision after, int max_changes);
  absl::Status AddChanges(std::vector<PastCommit>* commits);
  absl::StatusOr<Change> ToChange(const LoggedChange& logged, Lineages* lineages);

  std::unique_ptr<Database> database_;
  const std::string map_name_;
  ObjectVersions objects_;
  TileVersions tiles_;
  GenerationCache<Revision, PastStructurePtr> structures_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_GEOPACKAGE_HISTORY_H_
