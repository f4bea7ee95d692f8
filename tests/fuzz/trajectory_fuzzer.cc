// Any text is either decoded as a trajectory or refused, and interpolated poses have a valid
// rotation.
#include <cstddef>
#include <cstdint>

#include "absl/strings/string_view.h"
#include "ingest/sources/trajectory.h"
#include "tests/fuzz/require.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace hypermap::ingest;  // NOLINT(google-build-using-namespace)
  const auto trajectory =
      Trajectory::Parse(absl::string_view(reinterpret_cast<const char*>(data), size));
  if (!trajectory.ok()) return 0;
  for (int milliseconds = 0; milliseconds < 3000; milliseconds += 130) {
    const auto pose = trajectory->At(absl::FromUnixMillis(milliseconds), TrajectoryLimits());
    if (!pose.ok()) continue;
    const Eigen::Matrix3d r = pose->linear();
    REQUIRE((r * r.transpose()).isIdentity(1e-9));
  }
  return 0;
}
