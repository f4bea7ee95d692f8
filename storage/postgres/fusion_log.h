// hypermap.fusion and the tables that belong to it: the settings of fused layers, and their log of
// evidence.
#ifndef HYPERMAP_STORAGE_POSTGRES_FUSION_LOG_H_
#define HYPERMAP_STORAGE_POSTGRES_FUSION_LOG_H_

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "storage/fusion_log.h"
#include "storage/libpq/connection.h"
#include "storage/postgres/owned_map.h"

namespace hypermap::storage::postgres {

// Borrows the map.
class PostgresFusionLog : public FusionLog {
 public:
  explicit PostgresFusionLog(OwnedMap* owned) : owned_(owned) {}

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
  // Costs one step: an index has the stamps of each robot.
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
  // Reads the entries that Read returns. `which` restricts the observations.
  absl::StatusOr<std::vector<StoredEntry>> ReadEntries(const std::string& layer,
                                                       const LogKey& after, absl::string_view which,
                                                       int max_entries);
  // Runs a query whose first parameters are the map and the layer.
  template <typename... Values>
  absl::StatusOr<Rows> Query(const std::string& sql, const std::string& layer,
                             const Values&... values);

  OwnedMap* const owned_;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_FUSION_LOG_H_
