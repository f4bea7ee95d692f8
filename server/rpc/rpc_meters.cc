#include "server/rpc/rpc_meters.h"

#include <algorithm>
#include <optional>

namespace hypermap::server {

RpcMeters::RpcMeters() : meters_(AllRpcs().size()) {}

void RpcMeters::Ended(Rpc rpc, const absl::Status& status, absl::Duration duration) {
  Meter& meter = of(rpc);
  const auto number = static_cast<size_t>(status.code());
  meter.ended[number < kCodes ? number : static_cast<size_t>(absl::StatusCode::kUnknown)].fetch_add(
      1, std::memory_order_relaxed);
  const auto bound =
      std::lower_bound(kBounds_s.begin(), kBounds_s.end(), absl::ToDoubleSeconds(duration));
  meter.durations[static_cast<size_t>(bound - kBounds_s.begin())].fetch_add(
      1, std::memory_order_relaxed);
  meter.total_ns.fetch_add(absl::ToInt64Nanoseconds(duration), std::memory_order_relaxed);
  if (const std::optional<access::Reason> reason = access::ReasonOf(status)) {
    refused_[static_cast<size_t>(*reason)].fetch_add(1, std::memory_order_relaxed);
  }
}

RpcMeters::Reading RpcMeters::Read(Rpc rpc) const {
  const Meter& meter = meters_[static_cast<size_t>(rpc)];
  Reading reading;
  reading.began = meter.began.load(std::memory_order_relaxed);
  reading.forwarded = meter.forwarded.load(std::memory_order_relaxed);
  for (size_t i = 0; i < kCodes; ++i) {
    reading.ended[i] = meter.ended[i].load(std::memory_order_relaxed);
  }
  for (size_t i = 0; i < reading.durations.size(); ++i) {
    reading.durations[i] = meter.durations[i].load(std::memory_order_relaxed);
  }
  reading.total_s = 1e-9 * static_cast<double>(meter.total_ns.load(std::memory_order_relaxed));
  return reading;
}

}  // namespace hypermap::server
