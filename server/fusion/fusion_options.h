// What fusion in a session is made of, and its rules.
#ifndef HYPERMAP_SERVER_FUSION_FUSION_OPTIONS_H_
#define HYPERMAP_SERVER_FUSION_FUSION_OPTIONS_H_

#include <functional>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "map/fusion/strategy.h"
#include "map/observations/observation.h"

namespace hypermap::server {

// Evidence as bytes: exact, and the same bytes for the same value.
struct EvidenceCodec {
  std::function<std::string(const Observation&)> encode_observation;
  std::function<absl::StatusOr<Observation>(absl::string_view)> decode_observation;
  std::function<std::string(const SemanticObject&)> encode_object;
  std::function<absl::StatusOr<SemanticObject>(absl::string_view)> decode_object;
  // The bytes that version 0.1 made of an observation: logs of that version keep their hash. May be
  // empty.
  std::function<std::string(const Observation&)> encode_observation_01 = nullptr;
};

using StrategyFactory = std::function<absl::StatusOr<std::unique_ptr<fusion::Strategy>>(
    absl::string_view name, absl::string_view parameters)>;

struct FusionOptions {
  // Without one there are no fused layers.
  EvidenceCodec codec;
  StrategyFactory make_strategy = &fusion::MakeStrategy;
  // Of a layer that does not say. Empty: the first of fusion::StrategyNames.
  std::string default_strategy;
  // How far behind a layer's newest stamp an observation may lie, and how far ahead of the clock.
  absl::Duration max_lateness = absl::Minutes(10);
  // Entries of the log between two checkpoints in memory, and between two that are stored.
  int entries_per_checkpoint = 16;
  int entries_per_stored_checkpoint = 256;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_FUSION_OPTIONS_H_
