#include "map/registration/layer_estimate.h"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/metering/memory_meter.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/layers/layer_registry.h"
#include "map/registration/testing/drawn_plan.h"

namespace hypermap::registration {
namespace {

using ::testing::HasSubstr;

const PlanarTransform kTrueOfLayers(-12.0, 30.0, -1.1);
const PlanarTransform kSiteFromBase(5.0, 6.0, 0.5);

// Places of five chairs at which no other transform fits.
std::vector<Point> Chairs() { return {{0, 0}, {4, 1}, {5, 7}, {-3, 2}, {1, -6}}; }

// The map "NAME" with the frames "site", its own, and "base" in it; "adrift" is not connected.
// Chairs are in the layer "chairs" at `places` of the layer's frame.
SnapshotPtr MapOf(const std::string& name, const std::vector<Point>& places,
                  const std::string& frame_id) {
  auto map = std::make_shared<Snapshot>();
  map->map_name = name;
  map->frame_id = "site";
  EXPECT_TRUE(map->frames.Set({"site", "base", kSiteFromBase}).ok());
  std::vector<ObjectPtr> objects;
  for (const Point& place : places) {
    SemanticObject object;
    object.id = static_cast<ObjectId>(objects.size()) + 10;
    object.label = "chair";
    object.shape =
        Polygon::FromBox({{place.x - 0.2, place.y - 0.2}, {place.x + 0.2, place.y + 0.2}});
    objects.push_back(std::make_shared<const SemanticObject>(std::move(object)));
  }
  const LayerSpec chairs{.name = "chairs", .kind = LayerKind::kSemantic, .frame_id = frame_id};
  map->layers["chairs"] = std::make_shared<const SemanticLayer>(chairs, std::move(objects));
  for (const auto& [layer, kind] :
       {std::pair("floor", LayerKind::kOccupancy), std::pair("wifi", LayerKind::kScalar)}) {
    const LayerSpec spec{
        .name = layer, .kind = kind, .frame_id = frame_id, .grid = GridGeometry{{}, 0.1}};
    map->layers[layer] = MakeEmptyLayer(spec);
  }
  return map;
}

std::vector<Point> Moved(const std::vector<Point>& places, const PlanarTransform& by) {
  std::vector<Point> moved;
  moved.reserve(places.size());
  for (const Point& place : places) moved.push_back(by * place);
  return moved;
}

class EstimateFromLayersTest : public ::testing::Test {
 protected:
  static absl::Status Error(const PlacedLayer& source, const PlacedLayer& target) {
    return EstimateFromLayers(source, target).status();
  }

  const SnapshotPtr attic_ = MapOf("attic", Chairs(), "base");
  const SnapshotPtr office_ = MapOf("office", Moved(Chairs(), kTrueOfLayers), "adrift");
};

TEST_F(EstimateFromLayersTest, TransformIsThatOfTheWantedFrames) {
  const auto of_layers =
      EstimateFromLayers({attic_, "chairs", "base"}, {office_, "chairs", "adrift"});
  ASSERT_TRUE(of_layers.ok()) << of_layers.status();
  EXPECT_EQ(of_layers->ambiguity, Ambiguity::kNone);
  EXPECT_NEAR(of_layers->best.target_from_source.x(), kTrueOfLayers.x(), 1e-6);
  EXPECT_NEAR(of_layers->best.target_from_source.yaw(), kTrueOfLayers.yaw(), 1e-6);
  // The map's own frame.
  const auto of_site = EstimateFromLayers({attic_, "chairs", ""}, {office_, "chairs", "adrift"});
  ASSERT_TRUE(of_site.ok()) << of_site.status();
  const PlanarTransform expected = kTrueOfLayers * kSiteFromBase.Inverse();
  EXPECT_NEAR(of_site->best.target_from_source.x(), expected.x(), 1e-6);
  EXPECT_NEAR(of_site->best.target_from_source.y(), expected.y(), 1e-6);
  EXPECT_NEAR(of_site->best.target_from_source.yaw(), expected.yaw(), 1e-6);
}

TEST_F(EstimateFromLayersTest, AgreeingObjectsAreNamedByTheirIds) {
  // The target has its chairs in another order.
  std::vector<Point> turned = Moved(Chairs(), kTrueOfLayers);
  std::swap(turned[0], turned[4]);
  const SnapshotPtr office = MapOf("office", turned, "site");
  const auto estimate = EstimateFromLayers({attic_, "chairs", "base"}, {office, "chairs", ""});
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  ASSERT_EQ(estimate->agreeing.size(), 5u);
  const std::vector<std::pair<ObjectId, ObjectId>> expected = {
      {10, 14}, {11, 11}, {12, 12}, {13, 13}, {14, 10}};
  for (size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(estimate->agreeing[i].source, expected[i].first);
    EXPECT_EQ(estimate->agreeing[i].target, expected[i].second);
    EXPECT_LT(estimate->agreeing[i].residual_m, 1e-6);
  }
}

TEST_F(EstimateFromLayersTest, LayersThatCannotBeComparedAreRefused) {
  const absl::Status kinds = Error({attic_, "chairs", ""}, {office_, "floor", "adrift"});
  EXPECT_TRUE(absl::IsFailedPrecondition(kinds)) << kinds;
  EXPECT_THAT(kinds.message(), HasSubstr("\"chairs\" of the source is of the kind semantic"));
  const absl::Status scalar = Error({attic_, "wifi", ""}, {office_, "wifi", "adrift"});
  EXPECT_TRUE(absl::IsFailedPrecondition(scalar)) << scalar;
  const absl::Status empty = Error({attic_, "floor", ""}, {office_, "floor", "adrift"});
  EXPECT_TRUE(absl::IsFailedPrecondition(empty)) << empty;
  EXPECT_THAT(empty.message(), HasSubstr("no occupied cells"));
}

TEST_F(EstimateFromLayersTest, UnknownNamesAndFramesThatAreNotConnectedAreTold) {
  EXPECT_TRUE(absl::IsNotFound(Error({attic_, "sofas", ""}, {office_, "chairs", "adrift"})));
  EXPECT_TRUE(absl::IsNotFound(Error({attic_, "chairs", "moon"}, {office_, "chairs", "adrift"})));
  const absl::Status apart = Error({attic_, "chairs", ""}, {office_, "chairs", ""});
  EXPECT_TRUE(absl::IsFailedPrecondition(apart)) << apart;
  EXPECT_THAT(apart.message(), HasSubstr("target: layer \"chairs\" has the frame \"adrift\""));
}

TEST_F(EstimateFromLayersTest, MemoryIsTakenBeforeItIsUsed) {
  auto room = std::make_shared<Snapshot>();
  room->layers["floor"] = testing::Drawn(testing::FurnishedRoom, PlanarTransform(), 0.05, 6.0);
  MemoryCap cap("--most", 1 << 20);
  MemoryMeter meter(&cap);
  const ScopedMeter here(&meter);
  const absl::Status status = Error({room, "floor", ""}, {room, "floor", ""});
  EXPECT_TRUE(absl::IsResourceExhausted(status)) << status;
  EXPECT_THAT(status.message(), HasSubstr("--most"));
  EXPECT_TRUE(Error({attic_, "chairs", ""}, {office_, "chairs", "adrift"}).ok());
}

}  // namespace
}  // namespace hypermap::registration
