// Sorting that can be given up.
#ifndef HYPERMAP_BASE_CANCELLATION_CANCELLABLE_SORT_H_
#define HYPERMAP_BASE_CANCELLATION_CANCELLABLE_SORT_H_

#include <algorithm>
#include <cstddef>
#include <iterator>

#include "base/cancellation/cancellation.h"

namespace hypermap {

// Sorts like std::sort, but breaks off when the work of this thread is cancelled, and then leaves
// the elements in any order. The caller must check for cancellation afterwards. Sorts blocks and
// merges them, to look between any two of these steps.
template <typename Iterator, typename Less>
void CancellableSort(Iterator begin, Iterator end, Less less) {
  constexpr ptrdiff_t kBlock = 4096;
  const ptrdiff_t size = std::distance(begin, end);
  const auto at = [&](ptrdiff_t i) { return begin + std::min(i, size); };
  for (ptrdiff_t i = 0; i < size; i += kBlock) {
    std::sort(at(i), at(i + kBlock), less);
    if (IsCancelled()) return;
  }
  for (ptrdiff_t half = kBlock; half < size; half *= 2) {
    for (ptrdiff_t i = 0; i + half < size; i += 2 * half) {
      std::inplace_merge(at(i), at(i + half), at(i + 2 * half), less);
      if (IsCancelled()) return;
    }
  }
}

}  // namespace hypermap

#endif  // HYPERMAP_BASE_CANCELLATION_CANCELLABLE_SORT_H_
