#include "wire/watch_filter.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "wire/geometry.h"
#include "wire/scope.h"

namespace hypermap::wire {
namespace {

using Words = std::vector<std::string>;

const Polygon kWatchedArea = Polygon::FromBox({{0, 0}, {4, 3}});

TEST(WatchFilterTest, WatchSelectsLayersAreaAndClasses) {
  v1::WatchRequest request;
  EncodeScope("site", {{"walls", "things"}, "dock"}, request.mutable_scope());
  EncodePolygon(kWatchedArea, request.mutable_area());
  request.add_classes("cup");
  const auto filter = DecodeWatchFilter(request, Limits());
  ASSERT_TRUE(filter.ok()) << filter.status();
  EXPECT_EQ(filter->layers, (Words{"walls", "things"}));
  EXPECT_EQ(filter->frame_id, "dock");
  EXPECT_EQ(filter->area, kWatchedArea);
  EXPECT_EQ(filter->classes, Words{"cup"});
  EXPECT_EQ(filter->frames, WatchFilter::Frames::kCaller);
}

TEST(WatchFilterTest, ReplicaGetsContentAsStored) {
  v1::ReplicateRequest request;
  EncodeScope("site", {{"walls"}, ""}, request.mutable_scope());
  const auto filter = DecodeWatchFilter(request, Limits());
  ASSERT_TRUE(filter.ok()) << filter.status();
  EXPECT_EQ(filter->layers, Words{"walls"});
  EXPECT_FALSE(filter->area.has_value());
  EXPECT_EQ(filter->frames, WatchFilter::Frames::kAsStored);
}

TEST(WatchFilterTest, AreaWithTooManyVerticesIsRefused) {
  v1::ReplicateRequest request;
  EncodePolygon(kWatchedArea, request.mutable_area());
  Limits limits;
  limits.max_question_vertices = 3;
  EXPECT_TRUE(absl::IsResourceExhausted(DecodeWatchFilter(request, limits).status()));
}

}  // namespace
}  // namespace hypermap::wire
