#include "wire/points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "tests/support/not_finite.h"
#include "tests/support/random_map.h"

namespace hypermap::wire {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

using hypermap::testing::kNan;

v1::QueryPointsRequest Batch(std::initializer_list<double> xs, std::initializer_list<double> ys) {
  v1::QueryPointsRequest message;
  message.mutable_xs()->Add(xs.begin(), xs.end());
  message.mutable_ys()->Add(ys.begin(), ys.end());
  return message;
}

// Three objects with these labels in a row, a metre each, from x = 1 on; and a grid that is
// elsewhere.
SnapshotPtr Site(std::initializer_list<const char*> labels) {
  EditBatch batch;
  LayerSpec things;
  things.name = "things";
  batch.edits.push_back(CreateLayer{things});
  double x = 1.0;
  for (const char* label : labels) {
    PutObject put{"things", {}, ""};
    put.object.label = label;
    put.object.existence = 0.75;
    put.object.shape = Polygon::FromBox({{x, 0}, {x + 0.5, 1}});
    x += 1.0;
    batch.edits.push_back(std::move(put));
  }
  LayerSpec floor;
  floor.name = "floor";
  floor.kind = LayerKind::kScalar;
  floor.grid = GridGeometry{PlanarTransform(), 1.0};
  batch.edits.push_back(CreateLayer{floor});
  batch.edits.push_back(WriteCells{"floor", {0, 1, 0, 3}, {2.5, std::nullopt, 7.0}});
  LayerSpec adrift;
  adrift.name = "adrift";
  adrift.frame_id = "raft";
  batch.edits.push_back(CreateLayer{adrift});
  return std::make_shared<Snapshot>(hypermap::testing::MakeSnapshot("site", batch));
}

v1::QueryPointsResponse Ask(PointsAsker& asker, absl::Span<const Point> points,
                            ToldLabels* labels) {
  v1::QueryPointsResponse response;
  const auto contents = asker.ContentAtEach(points);
  EXPECT_TRUE(contents.ok()) << contents.status();
  EncodePointsContent(*contents, labels, &response);
  return response;
}

TEST(PointsOnTheWire, ABatchComesBack) {
  const std::vector<Point> points = {{1, 2}, {-0.1, 1e300}, {0, -0.0}};
  v1::QueryPointsRequest message;
  EncodePoints(points, &message);
  std::vector<Point> decoded = {{9, 9}};
  ASSERT_TRUE(DecodePoints(message, 3, &decoded).ok());
  EXPECT_EQ(decoded, points);
  ASSERT_TRUE(DecodePoints({}, 3, &decoded).ok());
  EXPECT_THAT(decoded, IsEmpty());
}

TEST(PointsOnTheWire, WrongBatchesNameTheField) {
  std::vector<Point> points;
  EXPECT_EQ(DecodePoints(Batch({1, 2}, {1}), 9, &points),
            absl::InvalidArgumentError("ys has 1 entries, xs has 2"));
  EXPECT_EQ(DecodePoints(Batch({1, kNan}, {1, kNan}), 9, &points),
            absl::InvalidArgumentError("xs[1] is not finite"));
  EXPECT_EQ(DecodePoints(Batch({1, 2}, {-INFINITY, 1}), 9, &points),
            absl::InvalidArgumentError("ys[0] is not finite"));
  EXPECT_EQ(DecodePoints(Batch({1, 2}, {1, 2}), 1, &points),
            absl::ResourceExhaustedError("xs has 2 entries, --max_points is 1"));
}

TEST(PointsOnTheWire, EachLabelIsToldOnceAStream) {
  auto asker = PointsAsker::Make(Site({"cup", "chair", "cup"}), {{"things"}, ""});
  ASSERT_TRUE(asker.ok());
  ToldLabels labels;
  const auto first = Ask(*asker, {{3.25, 0.5}, {9, 9}, {1.25, 0.5}}, &labels);
  EXPECT_THAT(first.new_labels(), ElementsAre("cup"));
  EXPECT_THAT(first.layers(0).points(), ElementsAre(0, 2));
  EXPECT_THAT(first.layers(0).object_ids(), ElementsAre(3, 1));
  EXPECT_THAT(first.layers(0).labels(), ElementsAre(0, 0));
  EXPECT_THAT(first.layers(0).existences(), ElementsAre(0.75F, 0.75F));
  const auto second = Ask(*asker, {{2.25, 0.5}, {1.25, 0.5}}, &labels);
  EXPECT_THAT(second.new_labels(), ElementsAre("chair"));
  EXPECT_THAT(second.layers(0).labels(), ElementsAre(1, 0));
}

TEST(PointsOnTheWire, AnswersOfAllKindsOfLayersComeBack) {
  auto asker = PointsAsker::Make(Site({"cup", "chair", "cup"}), {});
  ASSERT_TRUE(asker.ok());
  ToldLabels told;
  const auto response = Ask(*asker, {{1.25, 0.5}, {0.5, 0.5}, {-1, 0}}, &told);
  ASSERT_THAT(response.layers(), SizeIs(3));
  const auto adrift = DecodePointsContent("layers[0]", response.layers(0), 3, 1);
  const auto floor = DecodePointsContent("layers[1]", response.layers(1), 3, 1);
  const auto things = DecodePointsContent("layers[2]", response.layers(2), 3, 1);
  ASSERT_TRUE(adrift.ok() && floor.ok() && things.ok());
  EXPECT_EQ(adrift->status, AnswerStatus::kNoTransform);
  EXPECT_THAT(adrift->hits, IsEmpty());
  EXPECT_EQ(floor->layer, "floor");
  EXPECT_EQ(floor->kind, LayerKind::kScalar);
  EXPECT_THAT(floor->statuses,
              ElementsAre(AnswerStatus::kUnknown, AnswerStatus::kValue, AnswerStatus::kOutside));
  EXPECT_TRUE(std::isnan(floor->values[0]));
  EXPECT_EQ(floor->values[1], 2.5);
  EXPECT_TRUE(std::isnan(floor->values[2]));
  ASSERT_THAT(things->hits, SizeIs(1));
  EXPECT_EQ(things->hits[0].point, 0u);
  EXPECT_EQ(things->hits[0].object_id, 1);
  HeardLabels heard;
  heard.Add(response.new_labels());
  EXPECT_EQ(heard[things->hits[0].label], "cup");
}

TEST(PointsOnTheWire, AnswersThatDontFitTogetherAreRefused) {
  v1::PointsContent good;
  good.set_kind(v1::LAYER_KIND_SEMANTIC);
  good.set_status(v1::ANSWER_STATUS_VALUE);
  good.add_points(1);
  good.add_object_ids(7);
  good.add_labels(0);
  good.add_existences(1);
  ASSERT_TRUE(DecodePointsContent("layers[0]", good, 2, 1).ok());
  const auto error = [](const v1::PointsContent& message) {
    return std::string(DecodePointsContent("layers[0]", message, 2, 1).status().message());
  };
  v1::PointsContent lengths = good, beyond = good, untold = good, values = good, kind = good;
  lengths.add_labels(0);
  beyond.set_points(0, 2);
  untold.set_labels(0, 1);
  values.add_values(1);
  values.add_statuses(v1::ANSWER_STATUS_VALUE);
  kind.clear_kind();
  EXPECT_EQ(error(lengths), "layers[0] has columns of different lengths");
  EXPECT_EQ(error(beyond), "layers[0].points names one that was not asked");
  EXPECT_EQ(error(untold), "layers[0].labels names one that was not told");
  EXPECT_EQ(error(values), "layers[0] has 1 values for 2 points");
  EXPECT_THAT(error(kind), HasSubstr("layers[0].kind"));
}

}  // namespace
}  // namespace hypermap::wire
