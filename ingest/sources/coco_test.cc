#include "ingest/sources/coco.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace hypermap::ingest {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;
using testing::UnorderedElementsAre;

// A file with one image of 2 x 2 pixels. `annotations` is a JSON array without its brackets.
std::string File(const std::string& annotations) {
  return R"({"images": [{"id": 7, "file_name": "depth/1.5.png", "timestamp": 1.5}],
             "categories": [{"id": 62, "name": "chair"}, {"id": 63, "name": "couch"}],
             "annotations": [)" +
         annotations + "]}";
}
std::string Annotation(const std::string& rest) {
  return R"({"image_id": 7, "category_id": 62, )" + rest + "}";
}
constexpr char kTopRow[] = R"("segmentation": {"size": [2, 2], "counts": [0, 1, 1, 1, 1]})";

std::vector<Instance> Decode(const CocoDetections& coco, SkipCounts& skipped, int limit = 254) {
  return coco.Decode(7, 2, 2, limit, skipped);
}

TEST(CocoTest, AnAnnotationBecomesAnInstance) {
  const auto coco =
      CocoDetections::Parse(File(Annotation(R"("score": 0.75, )" + std::string(kTopRow))), "");
  ASSERT_TRUE(coco.ok()) << coco.status();
  SkipCounts skipped;
  const std::vector<Instance> instances = Decode(*coco, skipped);
  ASSERT_EQ(instances.size(), 1u);
  EXPECT_THAT(instances[0].scores, ElementsAre(Pair("chair", 0.75)));
  EXPECT_THAT(instances[0].mask, ElementsAre(1, 1, 0, 0));
  EXPECT_THAT(skipped, IsEmpty());
  ASSERT_TRUE(coco->images().has_value());
  EXPECT_EQ(coco->images()->at(0).stamp, absl::FromUnixMillis(1500));
}

TEST(CocoTest, TheThreeFormsOfAMaskAreTheSame) {
  for (const char* mask : {kTopRow, R"("segmentation": {"size": [2, 2], "counts": "01100"})",
                           R"("segmentation": [[0, 0, 2, 0, 2, 1, 0, 1]])"}) {
    const auto coco = CocoDetections::Parse(File(Annotation(mask)), "");
    ASSERT_TRUE(coco.ok()) << coco.status();
    SkipCounts skipped;
    const std::vector<Instance> instances = Decode(*coco, skipped);
    ASSERT_EQ(instances.size(), 1u) << mask;
    EXPECT_THAT(instances[0].mask, ElementsAre(1, 1, 0, 0)) << mask;
    EXPECT_THAT(instances[0].scores, ElementsAre(Pair("chair", 1.0))) << "no score: certain";
  }
}

TEST(CocoTest, ADistributionOverClassesStandsInPlaceOfTheScore) {
  const auto coco = CocoDetections::Parse(
      File(Annotation(R"("score": 0.1, "scores": {"chair": 0.6, "couch": 0.3, "bed": 0}, )" +
                      std::string(kTopRow))),
      "");
  ASSERT_TRUE(coco.ok()) << coco.status();
  SkipCounts skipped;
  EXPECT_THAT(Decode(*coco, skipped).at(0).scores,
              ElementsAre(Pair("chair", 0.6), Pair("couch", 0.3)));
}

TEST(CocoTest, AListOfResultsTakesImagesAndCategoriesFromAnotherFile) {
  const std::string results = "[" + Annotation(R"("score": 0.5, )" + std::string(kTopRow)) + "]";
  const auto coco = CocoDetections::Parse(results, File(""));
  ASSERT_TRUE(coco.ok()) << coco.status();
  SkipCounts skipped;
  EXPECT_THAT(Decode(*coco, skipped).at(0).scores, ElementsAre(Pair("chair", 0.5)));
  ASSERT_TRUE(coco->images().has_value());
  const auto alone = CocoDetections::Parse(results, "");
  ASSERT_TRUE(alone.ok()) << alone.status();
  EXPECT_FALSE(alone->images().has_value());
  EXPECT_THAT(alone->skipped(), ElementsAre(Pair("unknown category", 1)));
}

TEST(CocoTest, WhatCanNotBeUsedIsCountedByReason) {
  const std::string mask = kTopRow;
  const auto coco = CocoDetections::Parse(
      File(R"({"image_id": 8, "category_id": 62, )" + mask + "}, " +                   //
           R"({"image_id": 7, "category_id": 99, )" + mask + "}, " +                   //
           R"({"image_id": 7, "category_id": 62}, "text", 5, null, )" +                //
           Annotation(R"("score": 0, )" + mask) + ", " +                               //
           Annotation(R"("score": 1.5, )" + mask) + ", " +                             //
           Annotation(R"("score": "high", )" + mask) + ", " +                          //
           Annotation(R"("segmentation": {"size": [2], "counts": [4]})") + ", " +      //
           Annotation(R"("segmentation": {"size": [2, 2], "counts": [-4]})") + ", " +  //
           Annotation(R"("segmentation": [["a"]])") + ", " + Annotation(mask)),
      "");
  ASSERT_TRUE(coco.ok()) << coco.status();
  EXPECT_EQ(coco->num_annotations(), 1u);
  EXPECT_THAT(
      coco->skipped(),
      UnorderedElementsAre(Pair("annotation of no image", 4), Pair("unknown category", 1),
                           Pair("score out of range", 3), Pair("annotation without a mask", 4)));
}

TEST(CocoTest, ABrokenMaskIsLeftOutAlone) {
  const auto coco = CocoDetections::Parse(
      File(Annotation(R"("segmentation": {"size": [2, 2], "counts": "zzzz"})") + ", " +
           Annotation(R"("segmentation": {"size": [3, 3], "counts": [9]})") + ", " +
           Annotation(kTopRow)),
      "");
  ASSERT_TRUE(coco.ok()) << coco.status();
  SkipCounts skipped;
  EXPECT_EQ(Decode(*coco, skipped).size(), 1u);
  EXPECT_THAT(skipped, ElementsAre(Pair("broken mask", 2)));
}

TEST(CocoTest, OfTooManyDetectionsTheHighestScoresAreKept) {
  std::string annotations;
  for (int i = 1; i <= 10000; ++i) {
    annotations += (i > 1 ? ", " : "") +
                   Annotation("\"score\": " + std::to_string(i / 10000.0) + ", " + kTopRow);
  }
  const auto coco = CocoDetections::Parse(File(annotations), "");
  ASSERT_TRUE(coco.ok()) << coco.status();
  SkipCounts skipped;
  const std::vector<Instance> instances = Decode(*coco, skipped, 3);
  ASSERT_EQ(instances.size(), 3u);
  EXPECT_NEAR(instances[0].scores.at("chair"), 0.9998, 1e-9);
  EXPECT_NEAR(instances[2].scores.at("chair"), 1.0, 1e-9);
  EXPECT_THAT(skipped, ElementsAre(Pair("detection beyond the limit of a frame", 9997)));
}

TEST(CocoTest, WhatIsNoCocoFileIsRefused) {
  for (const char* text : {"", "{", "5", "{}", "\"text\"", "{\"annotations\": 3}", "[[[["}) {
    EXPECT_TRUE(absl::IsInvalidArgument(CocoDetections::Parse(text, "").status())) << text;
  }
  EXPECT_TRUE(CocoDetections::Parse("[]", "").ok());
}

TEST(CocoTest, AFileNameThatIsAStampGivesTheImagesTime) {
  const auto coco = CocoDetections::Parse(
      R"({"images": [{"id": 1, "file_name": "rgb/1500000000.200000.png"},
                     {"id": 2, "file_name": "first.png"}], "annotations": []})",
      "");
  ASSERT_TRUE(coco.ok()) << coco.status();
  EXPECT_EQ(coco->images()->at(0).stamp, absl::FromUnixMillis(1500000000200));
  EXPECT_FALSE(coco->images()->at(1).stamp.has_value());
}

}  // namespace
}  // namespace hypermap::ingest
