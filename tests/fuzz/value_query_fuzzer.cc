// Any string parses as a value query or is INVALID_ARGUMENT. Folding a folded label changes
// nothing.
#include <cstddef>
#include <cstdint>
#include <string>

#include "map/values/value_query.h"
#include "tests/fuzz/require.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto query = hypermap::ParseValueQuery(text);
  REQUIRE(query.ok() || absl::IsInvalidArgument(query.status()));
  const std::string folded = hypermap::FoldLabel(text);
  REQUIRE(hypermap::FoldLabel(folded) == folded);
  return 0;
}
