#include "client_libs/bench/fleet_options.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::bench {
namespace {

absl::Status CheckCount(absl::string_view flag, int count, int most) {
  if (count >= 0 && count <= most) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(flag, ": must be in [0, ", most, "]"));
}

absl::Status CheckRate(absl::string_view flag, double hz) {
  if (std::isfinite(hz) && hz >= 0.0 && hz <= 1e4) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(flag, ": must be in [0, 10000]"));
}

}  // namespace

absl::Status Validate(const FleetOptions& options) {
  HYPERMAP_RETURN_IF_ERROR(CheckCount("--robots", options.robots, 10'000));
  HYPERMAP_RETURN_IF_ERROR(CheckCount("--replicas", options.replicas, 10'000));
  HYPERMAP_RETURN_IF_ERROR(CheckCount("--full_replicas", options.full_replicas, 10'000));
  HYPERMAP_RETURN_IF_ERROR(CheckCount("--watchers", options.watchers, 10'000));
  HYPERMAP_RETURN_IF_ERROR(CheckCount("--editors", options.editors, 10'000));
  HYPERMAP_RETURN_IF_ERROR(CheckRate("--observe_hz", options.observe_hz));
  HYPERMAP_RETURN_IF_ERROR(CheckRate("--batches_hz", options.batches_hz));
  HYPERMAP_RETURN_IF_ERROR(CheckRate("--claims_hz", options.claims_hz));
  HYPERMAP_RETURN_IF_ERROR(CheckRate("--edits_hz", options.edits_hz));
  if (options.batch_points < 1) {
    return absl::InvalidArgumentError("--batch_points: must be at least 1");
  }
  if (options.replicas > 0 && options.watchers == 0) {
    return absl::InvalidArgumentError(
        "--replicas: their lag needs the times of revisions, which watchers tell; set --watchers");
  }
  if (options.duration <= absl::ZeroDuration() || options.duration > absl::Hours(24 * 30)) {
    return absl::InvalidArgumentError("--seconds: must be positive, and at most 30 days");
  }
  if (options.warmup < absl::ZeroDuration() || options.warmup > absl::Hours(24)) {
    return absl::InvalidArgumentError("--warmup_seconds: must be in [0, 86400]");
  }
  return absl::OkStatus();
}

absl::Duration LongestStream(const FleetOptions& options) {
  return kConnectLimit + options.warmup + options.duration + kAnswerLimit;
}

}  // namespace hypermap::bench
