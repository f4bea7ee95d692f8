// The dependencies and limits of fusion in a session.
#ifndef HYPERMAP_SERVER_FUSION_FUSION_OPTIONS_H_
#define HYPERMAP_SERVER_FUSION_FUSION_OPTIONS_H_

#include <functional>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "base/limits/limits.h"
#include "map/fusion/strategy.h"
#include "map/observations/observation.h"
#include "map/observations/pose_correction.h"

namespace hypermap::server {

// Encodes evidence as bytes: decoding gives the same value, and equal values give the same bytes.
// An interface of functions, because this room may not include wire/.
struct EvidenceCodec {
  std::function<std::string(const Observation&)> encode_observation;
  std::function<absl::StatusOr<Observation>(absl::string_view)> decode_observation;
  std::function<std::string(const SemanticObject&)> encode_object;
  std::function<absl::StatusOr<SemanticObject>(absl::string_view)> decode_object;
  std::function<std::string(const PoseCorrection&)> encode_correction;
  std::function<absl::StatusOr<PoseCorrection>(absl::string_view)> decode_correction;
  // The encoding of version 0.1, whose hashes old logs contain: needed to recognise a retry of an
  // observation that version 0.1 stored. May be empty.
  std::function<std::string(const Observation&)> encode_observation_01 = nullptr;
};

using StrategyFactory = std::function<absl::StatusOr<std::unique_ptr<fusion::Strategy>>(
    absl::string_view name, absl::string_view parameters)>;

struct FusionOptions {
  // If its functions are empty, no layer can be fused.
  EvidenceCodec codec;
  StrategyFactory make_strategy = &fusion::MakeStrategy;
  // Strategy of a layer whose settings name none. Empty: the first of fusion::StrategyNames.
  std::string default_strategy;
  // The server's clock, by which stamps are judged; null: that of commit times.
  std::function<absl::Time()> clock = nullptr;
  // The clock of commit times, by which checkpoints are dated. Set by the session. Null: evidence
  // is kept for ever.
  std::function<absl::Time()> commit_clock = nullptr;
  // Limit of an observation's stamp behind the newest one of its robot, and ahead of the clock.
  absl::Duration max_lateness = Limits().max_lateness;
  // Time after its arrival for which evidence is kept at least. Infinite: for ever.
  absl::Duration observation_age = Limits().observation_age;
  // Number of log entries between two checkpoints in memory, and between two stored ones.
  int entries_per_checkpoint = 16;
  int entries_per_stored_checkpoint = 256;
  // Bytes that the checkpoints of a layer in memory take at most, but for the newest one, and that
  // a state may take to be stored as a checkpoint.
  int64_t max_checkpoint_bytes = int64_t{64} << 20;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_FUSION_OPTIONS_H_
