// hypermap_fusion and the tables that belong to it: the settings of fused layers, and their log of
// evidence.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_FUSION_TABLES_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_FUSION_TABLES_H_

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "storage/fusion_log.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Creates the tables.
extern const char kCreateFusionTables[];

// These run within a transaction of the caller.
absl::Status WriteFusionChange(Database* database, const FusionChange& change);
absl::Status DropFusion(Database* database, const std::string& layer);
// Removes the logs of all layers.
absl::Status DropAllFusion(Database* database);

// Borrows the database.
class FusionTables : public FusionLog {
 public:
  explicit FusionTables(Database* database) : database_(database) {}

  absl::StatusOr<std::vector<std::pair<std::string, FusionSettings>>> FusedLayers() override;
  absl::StatusOr<std::vector<TrackId>> Tracks(const std::string& layer) override;
  absl::StatusOr<std::optional<Known>> FindObservation(const std::string& layer,
                                                       const std::string& robot,
                                                       int64_t sequence) override;
  absl::StatusOr<std::vector<SequenceRange>> Sequences(const std::string& layer,
                                                       const std::string& robot) override;
  absl::StatusOr<std::vector<ObservationKey>> KeysOf(const std::string& layer,
                                                     const std::string& robot, absl::Time from,
                                                     absl::Time to) override;
  absl::StatusOr<std::optional<absl::Time>> NewestStamp(const std::string& layer,
                                                        const std::string& robot) override;
  absl::StatusOr<std::optional<ObservationKey>> NewestKey(const std::string& layer) override;
  absl::StatusOr<std::optional<LogKey>> NewestFact(const std::string& layer) override;
  absl::StatusOr<std::vector<LogEntry>> FactsOfKind(const std::string& layer,
                                                    const std::string& kind) override;
  absl::StatusOr<std::vector<LogEntry>> Read(const std::string& layer, const LogKey& after,
                                             int max_entries) override;
  absl::StatusOr<std::vector<StoredEntry>> ReadStored(const std::string& layer, const LogKey& after,
                                                      int max_entries) override;
  absl::StatusOr<std::vector<ForgottenNames>> Forgotten(const std::string& layer,
                                                        const std::optional<ForgottenNames>& after,
                                                        int max_count) override;
  absl::StatusOr<std::optional<FusionCheckpoint>> FindCheckpoint(
      const std::string& layer, const std::optional<LogKey>& before) override;
  absl::StatusOr<std::vector<CheckpointKey>> Checkpoints(const std::string& layer) override;
  absl::Status KeepCheckpoint(const std::string& layer, const FusionCheckpoint& checkpoint,
                              absl::Span<const LogKey> dropped) override;
  absl::StatusOr<std::optional<FusionBase>> FindBase(const std::string& layer) override;
  absl::StatusOr<bool> HasForgotten(const std::string& layer, const std::string& robot) override;
  absl::StatusOr<std::optional<FusionCheckpoint>> FindNextBase(const std::string& layer,
                                                               absl::Time stored_before) override;
  absl::Status MoveBase(const std::string& layer, const LogKey& checkpoint) override;

 private:
  // Calls `take` for the entries that Read returns. `which` restricts the observations.
  absl::Status ForEachEntry(const std::string& layer, const LogKey& after, absl::string_view which,
                            int max_entries, absl::FunctionRef<void(StoredEntry)> take);

  Database* const database_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_FUSION_TABLES_H_
