#include "base/admission/call_rate.h"

#include "absl/strings/str_cat.h"
#include "base/admission/refusals.h"

namespace hypermap::admission {

absl::Status CallRate::Take(const std::string& client, SteadyTime now) {
  if (per_second_ <= 0.0) return absl::OkStatus();
  {
    const MutexLock lock(&mutex_);
    if (pace_.Take(client, now)) return absl::OkStatus();
  }
  return TryLater(absl::StrCat("this client begins more than --max_calls_per_second=", per_second_,
                               " calls in a second"));
}

}  // namespace hypermap::admission
