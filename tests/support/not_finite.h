// Numbers that are not finite, for tests of bad input.
#ifndef HYPERMAP_TESTS_SUPPORT_NOT_FINITE_H_
#define HYPERMAP_TESTS_SUPPORT_NOT_FINITE_H_

#include <limits>

namespace hypermap::testing {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInf = std::numeric_limits<double>::infinity();

}  // namespace hypermap::testing

#endif  // HYPERMAP_TESTS_SUPPORT_NOT_FINITE_H_
