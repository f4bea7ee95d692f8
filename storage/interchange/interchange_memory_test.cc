// A small file does not take much memory, whatever it says.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/limits/limits.h"
#include "base/metering/memory_meter.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/interchange/geojson.h"
#include "storage/interchange/hmap.h"
#include "storage/interchange/pgm.h"
#include "storage/interchange/png_codec.h"
#include "storage/interchange/semantic_objects.h"
#include "storage/interchange/semantic_yaml.h"
#include "storage/interchange/testing/content.h"
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
  static int64_t Taken() { return MemoryMeter::Current()->taken(); }
  static std::string Repeated(const std::string& beginning, const std::string& piece, int times) {
    std::string text = beginning;
    for (int i = 0; i < times; ++i) text += piece;
    return text;
  }
  static absl::Status ReadEntries(const std::string& text) {
    return ReadSemanticYaml(text, [](const SemanticEntry&) { return absl::OkStatus(); });
  }
  // A map whose circles take some 100 kB each as text.
  static Snapshot MapOfCircles(int count) {
    const ScopedMeter unmetered(nullptr);
    Ring circle;
    for (int i = 0; i < 2'500; ++i) {
      const double angle = 2.0 * std::acos(-1.0) * i / 2'500;
      circle.push_back({std::cos(angle), std::sin(angle)});
    }
    SemanticObject object;
    object.label = "circle";
    object.shape = *Polygon::Make(circle);
    ImportedMap map;
    map.batch.edits = {
        CreateLayer{LayerSpec{.name = "circles", .kind = LayerKind::kSemantic, .frame_id = "map"}}};
    for (int i = 0; i < count; ++i) map.batch.edits.push_back(PutObject{"circles", object, ""});
    return testing::MapOf(map);
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

// yaml-cpp queues all tokens of each of these texts before it reports the first entry.
TEST_F(InterchangeMemoryTest, TokensOfYaml) {
  for (const auto& [beginning, piece] : {std::pair("[", "a,"),
                                         {"{", "a,"},
                                         {"[", "["},
                                         {"[", "\"\""},
                                         {"[", "! "},
                                         {"%", " a"},
                                         {"- {x: {", "a: b, "},
                                         {"[[\n---\n]]\n", "- a\n"},
                                         {"[[\n---\n]]\n", "- "}}) {
    ExpectTooMuch(ReadEntries(Repeated(beginning, piece, 100'000)));
  }
  EXPECT_EQ(Taken(), 0);
}

TEST_F(InterchangeMemoryTest, TextOfYaml) {
  ExpectTooMuch(ReadEntries("- name: " + std::string(3 << 20, 'x')));
}

TEST_F(InterchangeMemoryTest, TagsOfOneEntry) {
  ExpectTooMuch(ReadEntries(Repeated("- tags: [", "a,", 100'000) + "]"));
  ExpectTooMuch(ReadEntries(Repeated("- tags:\n", "  - a\n", 100'000)));
}

// yaml-cpp keeps indentations and anchors until the end of the document.
TEST_F(InterchangeMemoryTest, IndentationsOfYaml) {
  ExpectTooMuch(ReadEntries(Repeated("", Repeated("- x:\n", "  - a\n", 100), 2'000)));
  ExpectTooMuch(ReadEntries(Repeated("", Repeated("- x:\n", "  a:\n   b\n", 100), 2'000)));
  ExpectTooMuch(ReadEntries(Repeated("", "- x: &a b\n", 50'000)));
  EXPECT_EQ(Taken(), 0);
}

// The parser's memory for an entry is free again when the next one begins.
TEST_F(InterchangeMemoryTest, ManyEntriesOfYamlTakeLittle) {
  const std::string block =
      "- name: dining table\n  shape: POLYGON((-0.5 -1.5, 1.25 -0.75, 1.5 1.25, 0.5 1.5))\n"
      "  tags: [furniture, table, wooden]\n  confidence: [0.5, 0.25, 0.125]\n";
  const std::string flow =
      "- {name: cup, shape: 'POLYGON((0 0,1 0,1 1,0 1,0 0))', tags: [a, b], confidence: [1, 0]}\n";
  for (const std::string& entry : {block, flow}) {
    int64_t most = 0;
    int64_t num_entries = 0;
    const absl::Status status =
        ReadSemanticYaml(Repeated("", entry, 3'000), [&](const SemanticEntry&) {
          ++num_entries;
          most = std::max(most, Taken());
          return absl::OkStatus();
        });
    EXPECT_TRUE(status.ok()) << status;
    EXPECT_EQ(num_entries, 3'000);
    EXPECT_LT(most, 1 << 20);
    EXPECT_EQ(Taken(), 0);
  }
}

// The last part is wrong, but the objects before it are too much.
TEST_F(InterchangeMemoryTest, PartsOfAMultiPolygonAreTakenOneByOne) {
  const SemanticEntry entry{
      "thing",
      Repeated("MULTIPOLYGON(", "((0 0,1 0,0 1)),", 1'000) + "((0 0,9 0,0 9),(20 20,22 20,20 22)))",
      std::vector<std::string>(10, std::string(1'000, 'x')),
      {}};
  RepairLog repairs;
  const Limits limits;
  ImportTotals totals;
  ExpectTooMuch(SemanticObjectReader("things", limits, totals, repairs).Take(entry));
  EXPECT_LT(totals.num_objects, 1'000);
}

TEST_F(InterchangeMemoryTest, TextOfAnExport) {
  EXPECT_TRUE(EncodeHmap(MapOfCircles(1)).ok());
  ExpectTooMuch(EncodeHmap(MapOfCircles(50)).status());
}

TEST_F(InterchangeMemoryTest, PackedMembersOfAnExport) {
  std::string noise;
  std::mt19937_64 random(1);
  while (noise.size() < 3'000'000) noise.push_back(static_cast<char>(random()));
  EXPECT_TRUE(MakeZip({{"noise", noise.substr(0, 100'000)}}).ok());
  ExpectTooMuch(MakeZip({{"noise", noise}}).status());
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
