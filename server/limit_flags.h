// The flags of hypermapd that set the limits of base/limits/limits.h.
#ifndef HYPERMAP_SERVER_LIMIT_FLAGS_H_
#define HYPERMAP_SERVER_LIMIT_FLAGS_H_

#include "absl/status/status.h"
#include "base/limits/limits.h"

namespace hypermap::server {

// INVALID_ARGUMENT naming the first flag whose value is too small.
absl::Status CheckLimitFlags();

Limits LimitsOfFlags();

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_LIMIT_FLAGS_H_
