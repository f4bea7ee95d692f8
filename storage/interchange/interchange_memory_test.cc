// A small file does not take much memory, whatever it says.
#include <cstdint>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/limits/limits.h"
#include "base/metering/memory_meter.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/interchange/geojson.h"
#include "storage/interchange/pgm.h"
#include "storage/interchange/png_codec.h"
#include "storage/interchange/wkt.h"
#include "storage/interchange/yaml_document.h"
#include "storage/interchange/zip_archive.h"

namespace hypermap::storage {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr int64_t kMost = 4 << 20;

class InterchangeMemoryTest : public ::testing::Test {
 protected:
  static void ExpectTooMuch(const absl::Status& status) {
    EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("--the_limit"));
  }
  static absl::Status ImportGeoJson(const std::string& text) {
    return DecodeGeoJson(text, "things", nullptr, Limits()).status();
  }
  static std::string MultiPoint(int points, int attribute_bytes) {
    const std::vector<std::string> positions(points, "[1,2]");
    return absl::StrCat(R"({"type":"Feature","properties":{"label":"a","text":")",
                        std::string(attribute_bytes, 'x'),
                        R"("},"geometry":{"type":"MultiPoint","coordinates":[)",
                        absl::StrJoin(positions, ","), "]}}");
  }

 private:
  MemoryCap cap_{"the_limit", kMost};
  MemoryMeter meter_{&cap_};
  const ScopedMeter here_{&meter_};
};

TEST_F(InterchangeMemoryTest, EachPartOfAMultiPointIsAnObject) {
  EXPECT_TRUE(ImportGeoJson(MultiPoint(10, 10'000)).ok());
  ExpectTooMuch(ImportGeoJson(MultiPoint(1000, 10'000)));
}

TEST_F(InterchangeMemoryTest, SmallValuesOfJson) {
  std::string text;
  for (int i = 0; i < 100'000; ++i) absl::StrAppend(&text, "[0],");
  ExpectTooMuch(ImportGeoJson(absl::StrCat("[", text, "0]")));
}

TEST_F(InterchangeMemoryTest, NodesOfYaml) {
  std::string text = "[";
  for (int i = 0; i < 100'000; ++i) text += "a,";
  ExpectTooMuch(ParseYaml(text + "a]").status());
}

TEST_F(InterchangeMemoryTest, MembersOfAnArchive) {
  std::vector<NamedFile> members;
  members.reserve(20'000);
  for (int i = 0; i < 20'000; ++i) members.push_back({absl::StrCat(i), ""});
  const auto archive = MakeZip(members);
  ASSERT_TRUE(archive.ok()) << archive.status();
  ExpectTooMuch(ZipArchive::Open(*archive, Limits()).status());
}

TEST_F(InterchangeMemoryTest, PixelsOfAnImage) {
  const GreyAlphaImage image{2000, 2000, std::vector<GreyAlpha>(4'000'000)};
  const auto png = EncodePng(image, PngChannels::kGrey);
  ASSERT_TRUE(png.ok());
  EXPECT_LT(png->size(), 20'000u);
  ExpectTooMuch(DecodePng(*png, 1 << 30).status());
  ExpectTooMuch(DecodePgm(EncodePgm(image), 1 << 30).status());
}

TEST_F(InterchangeMemoryTest, RepairsOfAShapeAreCut) {
  std::string vertices = "0 0";
  for (int i = 1; i < 5000; ++i) absl::StrAppend(&vertices, " ", i, " ", i % 7);
  const auto shape = ParseWkt(absl::StrCat("POLYGON((", vertices, "))"), 10'000);
  ASSERT_TRUE(shape.ok()) << shape.status();
  EXPECT_THAT(shape->repairs, SizeIs(1001));
}

}  // namespace
}  // namespace hypermap::storage
