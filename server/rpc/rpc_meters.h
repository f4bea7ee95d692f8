// Counts calls, their durations, and why they were refused.
#ifndef HYPERMAP_SERVER_RPC_RPC_METERS_H_
#define HYPERMAP_SERVER_RPC_RPC_METERS_H_

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "base/access/refusal.h"
#include "server/auth/rpcs.h"

namespace hypermap::server {

// Numbers of calls since the start of the server, for each rpc. Thread safe, without locks: a
// reader may see a call in one number and not yet in another.
class RpcMeters {
 public:
  // Upper bounds of the classes of durations, in seconds; the last class has no bound.
  static constexpr std::array<double, 16> kBounds_s = {
      0.0001, 0.00025, 0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025,
      0.05,   0.1,     0.25,   0.5,   1.0,    2.5,   5.0,  10.0};
  static constexpr size_t kCodes = 17;  // of gRPC

  RpcMeters();

  void Began(Rpc rpc) { of(rpc).began.fetch_add(1, std::memory_order_relaxed); }
  // A call that has begun is passed on to another server. It ends as others.
  void Forwarded(Rpc rpc) { of(rpc).forwarded.fetch_add(1, std::memory_order_relaxed); }
  // Also counts the reason of a refusal because of the caller (base/access/refusal.h).
  void Ended(Rpc rpc, const absl::Status& status, absl::Duration duration);

  // The number of calls that were refused for this reason.
  int64_t refused(access::Reason reason) const {
    return refused_[static_cast<size_t>(reason)].load(std::memory_order_relaxed);
  }

  struct Reading {
    int64_t began = 0;
    int64_t forwarded = 0;
    std::array<int64_t, kCodes> ended = {};                    // by code
    std::array<int64_t, kBounds_s.size() + 1> durations = {};  // calls in each class
    double total_s = 0.0;                                      // sum of the durations
  };
  Reading Read(Rpc rpc) const;

 private:
  struct Meter {
    std::atomic<int64_t> began = 0;
    std::atomic<int64_t> forwarded = 0;
    std::array<std::atomic<int64_t>, kCodes> ended = {};
    std::array<std::atomic<int64_t>, kBounds_s.size() + 1> durations = {};
    std::atomic<int64_t> total_ns = 0;
  };

  Meter& of(Rpc rpc) { return meters_[static_cast<size_t>(rpc)]; }

  std::vector<Meter> meters_;  // by Rpc
  std::array<std::atomic<int64_t>, access::kNumReasons> refused_ = {};
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_RPC_METERS_H_
