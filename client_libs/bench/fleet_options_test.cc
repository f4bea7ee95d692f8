#include "client_libs/bench/fleet_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

namespace hypermap::bench {
namespace {

TEST(FleetOptionsTest, DefaultsAreValid) { EXPECT_TRUE(Validate(FleetOptions()).ok()); }

TEST(FleetOptionsTest, WrongOptionIsNamed) {
  const struct {
    std::function<void(FleetOptions&)> spoil;
    const char* flag;
  } cases[] = {
      {[](FleetOptions& o) { o.robots = -1; }, "--robots"},
      {[](FleetOptions& o) { o.replicas = 10'001; }, "--replicas"},
      {[](FleetOptions& o) { o.watchers = 0; }, "--replicas"},
      {[](FleetOptions& o) { o.editors = -1; }, "--editors"},
      {[](FleetOptions& o) { o.observe_hz = -0.1; }, "--observe_hz"},
      {[](FleetOptions& o) { o.batches_hz = NAN; }, "--batches_hz"},
      {[](FleetOptions& o) { o.claims_hz = INFINITY; }, "--claims_hz"},
      {[](FleetOptions& o) { o.edits_hz = 1e5; }, "--edits_hz"},
      {[](FleetOptions& o) { o.batch_points = 0; }, "--batch_points"},
      {[](FleetOptions& o) { o.duration = absl::ZeroDuration(); }, "--seconds"},
      {[](FleetOptions& o) { o.warmup = -absl::Seconds(1); }, "--warmup_seconds"},
  };
  for (const auto& c : cases) {
    FleetOptions options;
    c.spoil(options);
    const absl::Status status = Validate(options);
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << c.flag;
    EXPECT_THAT(std::string(status.message()), testing::StartsWith(c.flag));
  }
}

}  // namespace
}  // namespace hypermap::bench
