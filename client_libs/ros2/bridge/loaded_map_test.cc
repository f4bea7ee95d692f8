#include "client_libs/ros2/bridge/loaded_map.h"

#include <gtest/gtest.h>

namespace hypermap::ros2 {
namespace {

TEST(MapAddressTest, NamesMapLayerAndRevision) {
  EXPECT_EQ(*ParseMapAddress("hypermap://office/floor@7704"),
            (MapAddress{"office", "floor", 7704}));
  EXPECT_EQ(*ParseMapAddress("hypermap://office/floor"),
            (MapAddress{"office", "floor", std::nullopt}));
}

TEST(MapAddressTest, OthersAreRefused) {
  for (const char* address :
       {"", "map.yaml", "hypermap://", "hypermap://office", "hypermap:///floor",
        "hypermap://office/", "hypermap://office/floor@", "hypermap://office/@1",
        "hypermap://office/floor@-1", "hypermap://office/floor@x"}) {
    EXPECT_EQ(ParseMapAddress(address).status().code(), absl::StatusCode::kInvalidArgument)
        << address;
  }
}

}  // namespace
}  // namespace hypermap::ros2
