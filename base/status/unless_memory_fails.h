// Makes a failed allocation the error of the work that asked for it.
#ifndef HYPERMAP_BASE_STATUS_UNLESS_MEMORY_FAILS_H_
#define HYPERMAP_BASE_STATUS_UNLESS_MEMORY_FAILS_H_

#include <new>
#include <type_traits>
#include <utility>

#include "absl/status/status.h"

namespace hypermap {

// Returns what `work` returns, an absl::Status or StatusOr; RESOURCE_EXHAUSTED if an allocation
// fails in it. `work` must be such that it may end at any allocation: what it has changed until
// then must be dropped or be valid as it is.
//
// Allocations fail if the address space is limited (ulimit -v), or if one is larger than the
// system can ever give. Elsewhere the system promises more memory than it has.
template <typename Work>
std::invoke_result_t<Work> UnlessMemoryFails(Work&& work) {
  try {
    return std::forward<Work>(work)();
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError("the server has not enough memory for this request");
  }
}

}  // namespace hypermap

#endif  // HYPERMAP_BASE_STATUS_UNLESS_MEMORY_FAILS_H_
