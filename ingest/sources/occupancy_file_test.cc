#include "ingest/sources/occupancy_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "ingest/sources/testing/recording.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::ingest {
namespace {

using ::testing::HasSubstr;

constexpr char kYaml[] =
    "image: map.pgm\nresolution: 0.5\norigin: [1, 2, 0]\nnegate: 0\noccupied_thresh: 0.65\n"
    "free_thresh: 0.196\n";

TEST(OccupancyFileTest, TheImageThatTheYamlNamesBecomesAGrid) {
  testing::TemporaryFolder folder;
  folder.Write("map.yaml", kYaml);
  // The top row of the image has the larger y and is free, unknown; the row below is occupied,
  // free.
  folder.Write("map.pgm",
               std::string("P5\n2 2\n255\n") + "\xfe\xcd" + std::string(1, '\0') + "\xfe");
  const auto grid = ReadOccupancy(folder.path() + "/map.yaml");
  ASSERT_TRUE(grid.ok()) << grid.status();
  const auto at = [&](double x, double y) { return (*grid)->ContentAt({x, y}).value; };
  EXPECT_EQ(at(1.25, 2.25), 1.0);
  EXPECT_EQ(at(1.75, 2.25), 0.0);
  EXPECT_EQ(at(1.25, 2.75), 0.0);
  EXPECT_EQ(at(1.75, 2.75), std::nullopt);
}

TEST(OccupancyFileTest, AnErrorNamesTheFile) {
  testing::TemporaryFolder folder;
  const auto error = [&] { return ReadOccupancy(folder.path() + "/map.yaml").status().ToString(); };
  EXPECT_THAT(error(), ::testing::AllOf(HasSubstr("NOT_FOUND"), HasSubstr("map.yaml")));
  folder.Write("map.yaml", "resolution: 1\n");
  EXPECT_THAT(error(), HasSubstr("names no image"));
  folder.Write("map.yaml", "[");
  EXPECT_THAT(error(), HasSubstr("map.yaml"));
  folder.Write("map.yaml", kYaml);
  EXPECT_THAT(error(), HasSubstr("map.pgm"));
  folder.Write("map.pgm", "no image");
  EXPECT_THAT(error(), HasSubstr("INVALID_ARGUMENT"));
}

}  // namespace
}  // namespace hypermap::ingest
