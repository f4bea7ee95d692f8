#include "map/evaluation/evaluate.h"

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace hypermap::evaluation {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

// Returns a square of side `side_m` around (x, y).
Object Square(const std::string& label, double x, double y, double side_m = 1.0,
              double existence = 1.0) {
  const double h = side_m / 2;
  return {label, Polygon::FromBox({{x - h, y - h}, {x + h, y + h}}), existence};
}

TEST(EvaluateTest, OfNothingIsAllZero) {
  const Evaluation e = Evaluate({}, {});
  EXPECT_EQ(e.n_truth, 0);
  EXPECT_EQ(e.f1, 0.0);
  EXPECT_EQ(e.pq, 0.0);
  EXPECT_THAT(e.per_class, IsEmpty());
  EXPECT_THAT(e.calibration.bins, IsEmpty());
}

TEST(EvaluateTest, OfTheTruthItselfIsPerfect) {
  const std::vector<Object> truth{Square("chair", 0, 0), Square("cup", 3, 0, 0.1)};
  const Evaluation e = Evaluate(truth, truth);
  EXPECT_EQ(e.tp, 2);
  EXPECT_EQ(e.f1, 1.0);
  EXPECT_DOUBLE_EQ(e.pq, 1.0);
  EXPECT_DOUBLE_EQ(e.pq_iou25, 1.0);
  EXPECT_DOUBLE_EQ(e.mean_iou_large, 1.0);
  EXPECT_DOUBLE_EQ(e.mean_iou_small, 1.0);
  EXPECT_EQ(e.centroid_error_m, 0.0);
  EXPECT_EQ(e.calibration.brier, 0.0);
}

// Computed by hand: chair A is detected half a metre off (IoU 1/3), chair B is missed, and the
// small cup is exact; a second chair is on A, and a plant is where there is none.
TEST(EvaluateTest, CountsAndMeansOfASmallScene) {
  const std::vector<Object> truth{Square("chair", 0, 0), Square("chair", 10, 0),
                                  Square("cup", 5, 5, 0.1)};
  const std::vector<Object> map{Square("chair", 0.5, 0), Square("chair", 0.9, 0),
                                Square("cup", 5, 5, 0.1), Square("plant", 7, 7)};
  const Evaluation e = Evaluate(truth, map);
  EXPECT_EQ(e.n_truth, 3);
  EXPECT_EQ(e.n_map, 4);
  EXPECT_EQ(e.tp, 2);
  EXPECT_DOUBLE_EQ(e.recall, 2.0 / 3);
  EXPECT_DOUBLE_EQ(e.precision, 2.0 / 4);
  EXPECT_DOUBLE_EQ(e.f1, 4.0 / 7);
  EXPECT_DOUBLE_EQ(e.pq, (1.0 / 3 + 1.0) / (2 + 2 / 2.0 + 1 / 2.0));
  EXPECT_DOUBLE_EQ(e.mean_iou, (1.0 / 3 + 1.0) / 2);
  EXPECT_DOUBLE_EQ(e.mean_iou_large, 1.0 / 3);
  EXPECT_DOUBLE_EQ(e.mean_iou_small, 1.0);
  EXPECT_DOUBLE_EQ(e.centroid_error_m, 0.25);
  EXPECT_EQ(e.duplicates, 1);
  EXPECT_EQ(e.spurious, 1);
  ASSERT_THAT(e.per_class, SizeIs(3));
  EXPECT_EQ(e.per_class[0].label, "chair");
  EXPECT_EQ(e.per_class[0].truth, 2);
  EXPECT_EQ(e.per_class[0].map, 2);
  EXPECT_EQ(e.per_class[0].detected, 1);
  EXPECT_DOUBLE_EQ(e.per_class[0].mean_iou, 1.0 / 3);
  EXPECT_DOUBLE_EQ(e.per_class[0].centroid_error_m, 0.5);
  EXPECT_EQ(e.per_class[2].label, "plant");
  EXPECT_EQ(e.per_class[2].truth, 0);
  EXPECT_EQ(e.per_class[2].mean_iou, 0.0);
}

TEST(EvaluateTest, PairsByClassOnly) {
  const Evaluation e = Evaluate({Square("chair", 0, 0)}, {Square("sofa", 0, 0)});
  EXPECT_EQ(e.tp, 0);
  EXPECT_EQ(e.duplicates, 0);
  EXPECT_EQ(e.spurious, 1);
}

TEST(EvaluateTest, ComparesLabelsAsQueriesDo) {
  EXPECT_EQ(Evaluate({Square("dining table", 0, 0)}, {Square(" Dining  TABLE ", 0, 0)}).tp, 1);
}

TEST(EvaluateTest, TakesTheDistanceWithItsEnd) {
  EXPECT_EQ(Evaluate({Square("cup", 0, 0)}, {Square("cup", 1, 0)}).tp, 1);
  EXPECT_EQ(Evaluate({Square("cup", 0, 0)}, {Square("cup", 1.001, 0)}).tp, 0);
}

TEST(EvaluateTest, CountsAPairWithoutOverlapAtNoGain) {
  const Evaluation e = Evaluate({Square("cup", 0, 0, 0.1)}, {Square("cup", 0.5, 0, 0.1)});
  EXPECT_EQ(e.tp, 1);
  EXPECT_EQ(e.pq, 0.0);
  EXPECT_EQ(e.pq_iou25, 0.0);
}

// At 1 m, only one pairing has three pairs. Above an IoU of 0.25, the middle pair is better.
TEST(EvaluateTest, PairsAnewForTheStricterQuality) {
  const std::vector<Object> truth{Square("cup", 0, 0), Square("cup", 1.2, 0)};
  const std::vector<Object> map{Square("cup", -0.9, 0), Square("cup", 0.3, 0)};
  const Evaluation e = Evaluate(truth, map);
  EXPECT_EQ(e.tp, 2);
  const double far = 0.1 / 1.9, near = 0.7 / 1.3;
  EXPECT_NEAR(e.pq, 2 * far / 2, 1e-12);
  EXPECT_NEAR(e.pq_iou25, near / 2, 1e-12);
}

// The centroid of the piece is more than a metre from the table's, but the piece overlaps the
// table.
TEST(EvaluateTest, APieceOfALargeObjectIsADuplicate) {
  const Object table{"table", Polygon::FromBox({{0, 0}, {4, 1}}), 1.0};
  const Evaluation e = Evaluate({table}, {table, Square("table", 3.6, 0.5, 0.4)});
  EXPECT_EQ(e.tp, 1);
  EXPECT_EQ(e.duplicates, 1);
  EXPECT_EQ(e.spurious, 0);
}

// Two objects stated at 0.75, one of which exists, and two at 1.0 that both exist.
TEST(EvaluateTest, ComparesStatedExistenceWithWhatIsThere) {
  const std::vector<Object> truth{Square("cup", 0, 0), Square("cup", 5, 0), Square("cup", 9, 0)};
  const std::vector<Object> map{Square("cup", 0, 0, 1, 0.75), Square("cup", 5, 0, 1, 1.0),
                                Square("cup", 9, 0, 1, 1.0), Square("cup", 20, 0, 1, 0.75)};
  const Calibration c = Evaluate(truth, map).calibration;
  ASSERT_THAT(c.bins, SizeIs(2));
  EXPECT_DOUBLE_EQ(c.bins[0].low, 0.7);
  EXPECT_DOUBLE_EQ(c.bins[0].high, 0.8);
  EXPECT_EQ(c.bins[0].count, 2);
  EXPECT_DOUBLE_EQ(c.bins[0].mean_existence, 0.75);
  EXPECT_DOUBLE_EQ(c.bins[0].matched, 0.5);
  EXPECT_DOUBLE_EQ(c.bins[1].high, 1.0);
  EXPECT_EQ(c.bins[1].count, 2);
  EXPECT_DOUBLE_EQ(c.expected_error, 0.25 / 2);
  EXPECT_DOUBLE_EQ(c.brier, (0.0625 + 0.5625) / 4);
}

}  // namespace
}  // namespace hypermap::evaluation
