#include "simulation/worlds/detector.h"

#include <algorithm>

#include "gtest/gtest.h"
#include "simulation/worlds/testing/camera.h"

namespace hypermap::simulation {
namespace {

// A view of a scene with two bodies, a large one and one of a few pixels.
struct TwoBodies {
  TwoBodies() {
    scene.bounds = {{0, 0}, {5, 5}};
    scene.bodies = {{"chair", {}}, {"cup", {}}};
    const size_t pixels = 320 * 240;
    view.depth = {320, 240, std::vector<float>(pixels, 2.0f)};
    view.body.assign(pixels, View::kStructure);
    for (int v = 100; v < 160; ++v) std::fill_n(&view.body[v * 320 + 100], 60, int16_t{0});
    std::fill_n(&view.body[10 * 320 + 10], kLeastPixels - 1, int16_t{1});
  }
  Scene scene;
  View view;
};

int Size(const SimulatedDetection& d) {
  return static_cast<int>(std::count(d.mask.begin(), d.mask.end(), uint8_t{1}));
}

TEST(DetectorTest, TheExactOneFindsWhatIsLargeEnough) {
  TwoBodies t;
  const auto found = DetectAll(t.scene, t.view);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].label, "chair");
  EXPECT_EQ(Size(found[0]), 3600);
  EXPECT_EQ(CountPixels(t.view, 2), (std::vector<int>{3600, kLeastPixels - 1}));
}

TEST(DetectorTest, FaultsComeAsOftenAsAsked) {
  TwoBodies t;
  Random random(3);
  FaultyDetector detector(t.scene, {.misses = 0.3, .confusions = 0.0, .false_positives = 0.0},
                          random);
  int frames = 2000, seen = 0, whole = 0;
  for (int i = 0; i < frames; ++i) {
    const auto found = detector.Detect(t.view, Camera(), Eigen::Isometry3d::Identity());
    seen += !found.empty();
    for (const SimulatedDetection& d : found) {
      EXPECT_EQ(d.label, "chair");
      EXPECT_GT(d.score, 0.0);
      EXPECT_LT(d.score, 1.0);
      whole += Size(d) > 3000;
    }
  }
  EXPECT_NEAR(seen / static_cast<double>(frames), 0.7, 0.04);
  EXPECT_NEAR(whole / static_cast<double>(seen), 0.92, 0.06);
}

TEST(DetectorTest, SeesThingsThatAreNotThere) {
  TwoBodies t;
  t.view.body.assign(t.view.body.size(), View::kStructure);
  Random random(4);
  FaultyDetector detector(t.scene, {.false_positives = 0.5}, random);
  int found = 0;
  for (int i = 0; i < 1000; ++i) {
    // The camera looks straight up, away from the phantoms.
    found +=
        static_cast<int>(detector.Detect(t.view, Camera(), Eigen::Isometry3d::Identity()).size());
  }
  EXPECT_NEAR(found, 500, 60);
}

TEST(DetectorTest, ConfusesNowAndThen) {
  TwoBodies t;
  Random random(5);
  FaultyDetector detector(t.scene, {.misses = 0.0, .confusions = 1.0, .false_positives = 0.0},
                          random);
  int wrong = 0;
  for (int i = 0; i < 100; ++i) {
    for (const auto& d : detector.Detect(t.view, Camera(), Eigen::Isometry3d::Identity())) {
      wrong += d.label == "couch";
    }
  }
  EXPECT_GT(wrong, 30);
}

}  // namespace
}  // namespace hypermap::simulation
