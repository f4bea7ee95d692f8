#include "storage/interchange/nav2.h"

#include "base/limits/limits.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/interchange/png_codec.h"
#include "storage/interchange/testing/content.h"

namespace hypermap::storage {
namespace {

using ::testing::ElementsAre;
using testing::Grid;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::MapOf;

constexpr char kYaml[] =
    "image: maps/floor.pgm\nresolution: 0.5\norigin: [-1, -2, 0]\nnegate: 0\n"
    "occupied_thresh: 0.65\nfree_thresh: 0.196\n";

TEST(DecodeNav2Test, FindsTheImageByItsBaseName) {
  const absl::StatusOr<ImportedMap> imported =
      DecodeNav2({{"floor.pgm", std::string("P5\n2 1\n255\n\x00\xFE", 13)}, {"floor.yaml", kYaml}},
                 "grid", "", Limits());
  ASSERT_TRUE(imported.ok()) << imported.status();
  EXPECT_EQ(imported->frame_id, "map");
  EXPECT_THAT(imported->layers, ElementsAre("grid"));
  EXPECT_THAT(imported->repairs, IsEmpty());
  const Snapshot map = MapOf(*imported);
  EXPECT_EQ(map.FindLayer("grid")->spec().frame_id, "map");
  EXPECT_EQ(map.FindLayer("grid")->ContentAt({-0.75, -1.75}).value, 1.0);
  EXPECT_EQ(map.FindLayer("grid")->ContentAt({-0.25, -1.75}).value, 0.0);
}

TEST(DecodeNav2Test, TakesModesInAnyCaseAndAFrame) {
  const absl::StatusOr<ImportedMap> imported =
      DecodeNav2({{"m.YML",
                   "image: m.pgm\nresolution: 1\norigin: [0, 0, 0]\nmode: Scale\n"
                   "occupied_thresh: 1\nfree_thresh: 0\n"},
                  {"m.pgm", std::string("P5\n1 1\n255\n\x80", 12)},
                  {"notes.txt", ""}},
                 "grid", "site", Limits());
  ASSERT_TRUE(imported.ok()) << imported.status();
  EXPECT_EQ(imported->frame_id, "site");
  EXPECT_THAT(imported->repairs, ElementsAre(HasSubstr("notes.txt")));
  EXPECT_EQ(Grid(MapOf(*imported), "grid").ValueAt({0, 0}), 0.5);
}

TEST(DecodeNav2Test, NamesWhatIsWrong) {
  const NamedFile yaml{"m.yaml", kYaml};
  const NamedFile image{"floor.pgm", std::string("P5\n1 1\n255\nx")};
  const struct {
    std::vector<NamedFile> files;
    const char* layer;
    const char* frame_id;
    const char* message;
  } kCases[] = {
      {{}, "grid", "", "no .yaml"},
      {{image}, "grid", "", "no .yaml"},
      {{yaml, yaml, image}, "grid", "", "two YAMLs"},
      {{yaml}, "grid", "", "image \"floor.pgm\" is not among the files"},
      {{yaml, {"floor.pgm", "P5"}}, "grid", "", "image \"maps/floor.pgm\": PGM header"},
      {{{"m.yaml", "image: floor.pgm"}, image}, "grid", "", "m.yaml: resolution is missing"},
      {{yaml, image}, "", "", "layer.name"},
      {{yaml, image}, "a b", "", "layer.name"},
      {{yaml, image}, "grid", "/map", "layer.frame_id"},
  };
  for (const auto& c : kCases) {
    const absl::Status status = DecodeNav2(c.files, c.layer, c.frame_id, Limits()).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << c.message;
    EXPECT_THAT(std::string(status.message()), HasSubstr(c.message));
  }
  Limits limits;
  limits.max_unpacked_bytes = 10;
  EXPECT_EQ(DecodeNav2({yaml, image}, "grid", "", limits).status().code(),
            absl::StatusCode::kResourceExhausted);
}

Snapshot WithGrid(const std::vector<std::optional<double>>& values,
                  const OccupancyThresholds& thresholds = OccupancyThresholds()) {
  ImportedMap made;
  made.batch.edits.push_back(
      CreateLayer{LayerSpec{.name = "grid",
                            .kind = LayerKind::kOccupancy,
                            .frame_id = "map",
                            .grid = GridGeometry{PlanarTransform(1, 2, 0.5), 0.25},
                            .thresholds = thresholds}});
  if (!values.empty()) {
    made.batch.edits.push_back(
        WriteCells{"grid", {0, 1, 0, static_cast<int32_t>(values.size())}, values});
  }
  made.batch.edits.push_back(
      CreateLayer{LayerSpec{.name = "things", .kind = LayerKind::kSemantic, .frame_id = "map"}});
  return MapOf(made);
}

std::vector<std::optional<double>> ReadBack(const ExportedFiles& exported) {
  const absl::StatusOr<ImportedMap> imported = DecodeNav2(exported.files, "grid", "map", Limits());
  EXPECT_TRUE(imported.ok()) << imported.status();
  if (!imported.ok()) return {};
  const Snapshot map = MapOf(*imported);
  EXPECT_EQ(Grid(map, "grid").geometry(), (GridGeometry{PlanarTransform(1, 2, 0.5), 0.25}));
  return testing::Values(Grid(map, "grid"));
}

TEST(EncodeNav2Test, TrinaryContentIsWrittenAsMapSaverDoes) {
  const std::vector<std::optional<double>> values = {0.0, 1.0, std::nullopt};
  const Snapshot map = WithGrid(values);
  const absl::StatusOr<ExportedFiles> pgm = EncodeNav2(map, "grid", Nav2Image::kPgm);
  ASSERT_TRUE(pgm.ok()) << pgm.status();
  EXPECT_THAT(pgm->omissions, IsEmpty());
  ASSERT_EQ(pgm->files.size(), 2u);
  EXPECT_EQ(pgm->files[0].name, "grid.yaml");
  EXPECT_EQ(pgm->files[0].data,
            "image: grid.pgm\nresolution: 0.25\norigin: [1, 2, 0.5]\nnegate: 0\n"
            "occupied_thresh: 0.65\nfree_thresh: 0.196\nmode: trinary\n");
  EXPECT_EQ(pgm->files[1].name, "grid.pgm");
  EXPECT_EQ(pgm->files[1].data, std::string("P5\n3 1\n255\n\xFE\x00\xCD", 14));
  EXPECT_EQ(ReadBack(*pgm), values);
  const absl::StatusOr<ExportedFiles> png = EncodeNav2(map, "grid", Nav2Image::kPng);
  ASSERT_TRUE(png.ok()) << png.status();
  EXPECT_THAT(png->omissions, IsEmpty());
  EXPECT_THAT(png->files[0].data, HasSubstr("mode: trinary"));
  EXPECT_EQ(ReadBack(*png), values);
}

TEST(EncodeNav2Test, PngKeepsValuesInBetweenAndPgmTellsThatItDoesNot) {
  const std::vector<std::optional<double>> values = {0.0, 0.1, 0.37, 0.66, 1.0, std::nullopt};
  const Snapshot map = WithGrid(values);
  const absl::StatusOr<ExportedFiles> png = EncodeNav2(map, "grid", Nav2Image::kPng);
  ASSERT_TRUE(png.ok()) << png.status();
  EXPECT_THAT(png->omissions, IsEmpty());
  EXPECT_THAT(png->files[0].data, HasSubstr("mode: scale"));
  EXPECT_EQ(ReadBack(*png), values);
  const absl::StatusOr<ExportedFiles> pgm = EncodeNav2(map, "grid", Nav2Image::kPgm);
  ASSERT_TRUE(pgm.ok()) << pgm.status();
  EXPECT_THAT(pgm->omissions, ElementsAre(HasSubstr("3 values between 0 and 1")));
  EXPECT_THAT(ReadBack(*pgm), ElementsAre(0.0, 0.0, std::nullopt, 1.0, 1.0, std::nullopt));
}

TEST(EncodeNav2Test, TellsOfThresholdsAndRounding) {
  const absl::StatusOr<ExportedFiles> exported =
      EncodeNav2(WithGrid({0.123}, {0.0, 1.0}), "grid", Nav2Image::kPng);
  ASSERT_TRUE(exported.ok()) << exported.status();
  EXPECT_THAT(exported->omissions, ElementsAre(HasSubstr("thresholds"), HasSubstr("rounded")));
  const absl::StatusOr<ExportedFiles> certain =
      EncodeNav2(WithGrid({0.0, 1.0}, {0.0, 1.0}), "grid", Nav2Image::kPgm);
  EXPECT_THAT(ReadBack(*certain), ElementsAre(0.0, 1.0));
}

TEST(EncodeNav2Test, RefusesWhatIsNoImageOfAGrid) {
  const Snapshot map = WithGrid({});
  EXPECT_EQ(EncodeNav2(map, "gone", Nav2Image::kPgm).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(EncodeNav2(map, "things", Nav2Image::kPgm).status().code(),
            absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(EncodeNav2(map, "grid", Nav2Image::kPgm).status().code(),
            absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace hypermap::storage
