// How long a wait for a socket lasts. Only for the sources of this room.
#ifndef HYPERMAP_STORAGE_LIBPQ_POLL_INTERVAL_H_
#define HYPERMAP_STORAGE_LIBPQ_POLL_INTERVAL_H_

#include <algorithm>

#include "absl/time/time.h"
#include "base/cancellation/cancellation.h"

namespace hypermap::storage::postgres {

// The timeout of a poll(2), which is part of a wait of which `left` is left: work that may be
// cancelled looks every few milliseconds.
inline int PollMilliseconds(absl::Duration left) {
  const absl::Duration interval =
      Cancellation::Current() == nullptr ? absl::Milliseconds(100) : absl::Milliseconds(3);
  const absl::Duration timeout = std::clamp(left, absl::ZeroDuration(), interval);
  return static_cast<int>(absl::ToInt64Milliseconds(absl::Ceil(timeout, absl::Milliseconds(1))));
}

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_LIBPQ_POLL_INTERVAL_H_
