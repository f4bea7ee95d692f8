#include "storage/decorators/read_only_map.h"

#include <string>
#include <utility>

#include "storage/decorators/forwarding_fusion_log.h"
#include "storage/decorators/forwarding_map.h"

namespace hypermap::storage {
namespace {

class ReadOnlyFusionLog : public ForwardingFusionLog {
 public:
  ReadOnlyFusionLog(FusionLog* log, absl::Status refusal)
      : ForwardingFusionLog(log), refusal_(std::move(refusal)) {}

  absl::Status KeepCheckpoint(const std::string& /*layer*/, const FusionCheckpoint& /*checkpoint*/,
                              absl::Span<const LogKey> /*dropped*/) override {
    return refusal_;
  }
  absl::Status MoveBase(const std::string& /*layer*/, const LogKey& /*checkpoint*/) override {
    return refusal_;
  }

 private:
  const absl::Status refusal_;
};

class ReadOnlyMap : public ForwardingMap {
 public:
  ReadOnlyMap(std::unique_ptr<StoredMap> map, const absl::Status& refusal)
      : ForwardingMap(std::move(map)),
        refusal_(refusal),
        log_(&ForwardingMap::fusion_log(), refusal) {}

  FusionLog& fusion_log() override { return log_; }
  absl::Status Write(absl::Span<const Commit> /*commits*/) override { return refusal_; }
  absl::Status ConfirmOwnership() override { return refusal_; }
  absl::Status TryWrite() override { return refusal_; }
  absl::Status AddTimeMark(const TimeMark& /*mark*/, absl::Duration /*forget_before*/) override {
    return refusal_;
  }
  absl::StatusOr<bool> Compact(Revision /*oldest*/, absl::Time /*receipts_before*/,
                               int /*max_rows*/) override {
    return refusal_;
  }
  absl::Status AddCopied(absl::Span<const TimedReceipt> /*receipts*/,
                         absl::Span<const FusionChange> /*fusion*/) override {
    return refusal_;
  }
  absl::Status ClearCopied() override { return refusal_; }
  absl::Status FinishCopy() override { return refusal_; }

 private:
  const absl::Status refusal_;
  ReadOnlyFusionLog log_;
};

}  // namespace

std::unique_ptr<StoredMap> MakeReadOnlyMap(std::unique_ptr<StoredMap> map,
                                           const absl::Status& refusal) {
  return std::make_unique<ReadOnlyMap>(std::move(map), refusal);
}

}  // namespace hypermap::storage
