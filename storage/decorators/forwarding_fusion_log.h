// A log of evidence that hands everything to another one.
#ifndef HYPERMAP_STORAGE_DECORATORS_FORWARDING_FUSION_LOG_H_
#define HYPERMAP_STORAGE_DECORATORS_FORWARDING_FUSION_LOG_H_

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "storage/fusion_log.h"

namespace hypermap::storage {

// A decorator derives from it, and overrides what it changes.
class ForwardingFusionLog : public FusionLog {
 public:
  // `log` must outlive this.
  explicit ForwardingFusionLog(FusionLog* log) : log_(log) {}

  absl::StatusOr<std::vector<std::pair<std::string, FusionSettings>>> FusedLayers() override {
    return log_->FusedLayers();
  }
  absl::StatusOr<std::vector<TrackId>> Tracks(const std::string& layer) override {
    return log_->Tracks(layer);
  }
  absl::StatusOr<std::optional<Known>> FindObservation(const std::string& layer,
                                                       const std::string& robot,
                                                       int64_t sequence) override {
    return log_->FindObservation(layer, robot, sequence);
  }
  absl::StatusOr<std::vector<SequenceRange>> Sequences(const std::string& layer,
                                                       const std::string& robot) override {
    return log_->Sequences(layer, robot);
  }
  absl::StatusOr<std::vector<ObservationKey>> KeysOf(const std::string& layer,
                                                     const std::string& robot, absl::Time from,
                                                     absl::Time to) override {
    return log_->KeysOf(layer, robot, from, to);
  }
  absl::StatusOr<std::optional<absl::Time>> NewestStamp(const std::string& layer,
                                                        const std::string& robot) override {
    return log_->NewestStamp(layer, robot);
  }
  absl::StatusOr<std::optional<ObservationKey>> NewestKey(const std::string& layer) override {
    return log_->NewestKey(layer);
  }
  absl::StatusOr<std::optional<LogKey>> NewestFact(const std::string& layer) override {
    return log_->NewestFact(layer);
  }
  absl::StatusOr<std::vector<LogEntry>> FactsOfKind(const std::string& layer,
                                                    const std::string& kind) override {
    return log_->FactsOfKind(layer, kind);
  }
  absl::StatusOr<std::vector<LogEntry>> Read(const std::string& layer, const LogKey& after,
                                             int max_entries) override {
    return log_->Read(layer, after, max_entries);
  }
  absl::StatusOr<std::vector<StoredEntry>> ReadStored(const std::string& layer, const LogKey& after,
                                                      int max_entries) override {
    return log_->ReadStored(layer, after, max_entries);
  }
  absl::StatusOr<std::vector<ForgottenNames>> Forgotten(const std::string& layer,
                                                        const std::optional<ForgottenNames>& after,
                                                        int max_count) override {
    return log_->Forgotten(layer, after, max_count);
  }
  absl::StatusOr<std::optional<FusionCheckpoint>> FindCheckpoint(
      const std::string& layer, const std::optional<LogKey>& before) override {
    return log_->FindCheckpoint(layer, before);
  }
  absl::StatusOr<std::vector<CheckpointKey>> Checkpoints(const std::string& layer) override {
    return log_->Checkpoints(layer);
  }
  absl::Status KeepCheckpoint(const std::string& layer, const FusionCheckpoint& checkpoint,
                              absl::Span<const LogKey> dropped) override {
    return log_->KeepCheckpoint(layer, checkpoint, dropped);
  }
  absl::StatusOr<std::optional<FusionBase>> FindBase(const std::string& layer) override {
    return log_->FindBase(layer);
  }
  absl::StatusOr<bool> HasForgotten(const std::string& layer, const std::string& robot) override {
    return log_->HasForgotten(layer, robot);
  }
  absl::StatusOr<std::optional<FusionCheckpoint>> FindNextBase(const std::string& layer,
                                                               absl::Time stored_before) override {
    return log_->FindNextBase(layer, stored_before);
  }
  absl::Status MoveBase(const std::string& layer, const LogKey& checkpoint) override {
    return log_->MoveBase(layer, checkpoint);
  }

 private:
  FusionLog* const log_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_DECORATORS_FORWARDING_FUSION_LOG_H_
