// Any text is a configuration of hypermapd or INVALID_ARGUMENT, and so is the value of any flag.
// Limits can be read from all flags that are accepted.
#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/flags/reflection.h"
#include "server/config_file.h"
#include "server/limit_flags.h"
#include "tests/fuzz/require.h"

namespace {

void RequireOkOrInvalid(const absl::Status& status) {
  REQUIRE(status.ok() || absl::IsInvalidArgument(status));
  REQUIRE(status.ok() || !status.message().empty());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace hypermap::server;  // NOLINT(google-build-using-namespace)
  const auto values = ParseConfig(std::string(reinterpret_cast<const char*>(data), size));
  RequireOkOrInvalid(values.status());
  if (!values.ok() || values->empty()) return 0;
  const absl::FlagSaver saver;
  const absl::Status set = SetFlags(*values);
  RequireOkOrInvalid(set);
  if (!set.ok()) return 0;
  const absl::Status checked = CheckLimitFlags();
  RequireOkOrInvalid(checked);
  if (checked.ok()) LimitsOfFlags();
  return 0;
}
