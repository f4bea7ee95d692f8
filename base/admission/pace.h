// How fast each client may do something.
#ifndef HYPERMAP_BASE_ADMISSION_PACE_H_
#define HYPERMAP_BASE_ADMISSION_PACE_H_

#include <string>

#include "absl/container/flat_hash_map.h"
#include "absl/time/time.h"
#include "base/sync/steady_time.h"

namespace hypermap::admission {

// A token bucket for each client. Not thread safe.
class Pace {
 public:
  // A client may take `burst` tokens at once, and gets `per_second` new ones, up to `burst`.
  Pace(double per_second, double burst) : per_second_(per_second), burst_(burst) {}

  // Takes a token of the client. Returns false if it has none.
  bool Take(const std::string& client, SteadyTime now);

 private:
  struct Bucket {
    double tokens;
    SteadyTime filled;
  };

  void Fill(Bucket& bucket, SteadyTime now) const;

  const double per_second_;
  const double burst_;
  absl::flat_hash_map<std::string, Bucket> buckets_;
  // Number of clients at which those with a full bucket are forgotten.
  size_t forget_at_ = 1000;
};

}  // namespace hypermap::admission

#endif  // HYPERMAP_BASE_ADMISSION_PACE_H_
