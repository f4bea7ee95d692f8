// Waits for what another thread or process does.
#ifndef HYPERMAP_TESTS_SUPPORT_EVENTUALLY_H_
#define HYPERMAP_TESTS_SUPPORT_EVENTUALLY_H_

#include "absl/functional/function_ref.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

namespace hypermap::testing {

// Asks until the condition holds. Returns whether it came to hold within a minute, which no test
// needs on a machine that is not overloaded.
inline bool Eventually(absl::FunctionRef<bool()> condition) {
  const absl::Time deadline = absl::Now() + absl::Minutes(1);
  while (!condition()) {
    if (absl::Now() > deadline) return false;
    absl::SleepFor(absl::Milliseconds(1));
  }
  return true;
}

}  // namespace hypermap::testing

#endif  // HYPERMAP_TESTS_SUPPORT_EVENTUALLY_H_
