#include "storage/interchange/semantic_objects.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace hypermap::storage {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr char kSquare[] = "POLYGON((0 0,2 0,2 2,0 2,0 0))";

using Words = std::vector<std::string>;
using Numbers = std::vector<double>;
using Classes = ClassScores;

struct Reading {
  absl::Status status;
  std::vector<SemanticObject> objects;
  std::vector<std::string> repairs;
};

Reading Read(const std::vector<SemanticEntry>& entries, int64_t max_objects = 100'000) {
  RepairLog log;
  Limits limits;
  limits.max_vertices = 1000;
  limits.max_import_objects = max_objects;
  ImportTotals totals{.crossings_left = 5000};
  SemanticObjectReader reader("semantic", limits, totals, log);
  Reading reading;
  for (const SemanticEntry& entry : entries) {
    reading.status = reader.Take(entry);
    if (!reading.status.ok()) break;
  }
  if (reading.status.ok()) reading.objects = std::move(reader).Finish();
  reading.repairs = std::move(log).Take();
  return reading;
}

TEST(SemanticObjectsTest, TagsWithConfidencesAreClasses) {
  const Reading reading = Read({{"Chair", kSquare, Words{"seat", "chair"}, Numbers{0.8, 0.25}}});
  ASSERT_THAT(reading.objects, SizeIs(1));
  const SemanticObject& object = reading.objects[0];
  EXPECT_EQ(object.id, 0);
  EXPECT_EQ(object.label, "Chair");
  EXPECT_EQ(object.tags, (Words{"seat", "chair"}));
  EXPECT_EQ(object.classes, (Classes{{"seat", 0.8}, {"chair", 0.25}}));
  EXPECT_EQ(object.existence, 1.0);
  EXPECT_EQ(object.shape, *Polygon::Make({{0, 0}, {2, 0}, {2, 2}, {0, 2}}));
  EXPECT_THAT(reading.repairs, IsEmpty());
}

TEST(SemanticObjectsTest, WithoutConfidencesTheLabelIsTheClass) {
  const Reading reading = Read({{"cup", kSquare, std::nullopt, std::nullopt},
                                {"mug", kSquare, Words{"dish"}, std::nullopt},
                                {"jug", kSquare, Words{}, Numbers{}}});
  ASSERT_THAT(reading.objects, SizeIs(3));
  EXPECT_EQ(reading.objects[0].classes, (Classes{{"cup", 1.0}}));
  EXPECT_EQ(reading.objects[1].classes, (Classes{{"mug", 1.0}}));
  EXPECT_EQ(reading.objects[1].tags, Words{"dish"});
  EXPECT_EQ(reading.objects[2].classes, (Classes{{"jug", 1.0}}));
  EXPECT_THAT(reading.repairs, IsEmpty());
}

TEST(SemanticObjectsTest, OddConfidencesAreReported) {
  const Reading reading = Read({{"a", kSquare, Words{"x", "y"}, Numbers{0.5}},
                                {"b", kSquare, std::nullopt, Numbers{0.5}},
                                {"c", kSquare, Words{"x", "x"}, Numbers{0.5, 0.6}},
                                {"d", kSquare, Words{"x", "y"}, Numbers{1.5, -0.25}}});
  ASSERT_THAT(reading.objects, SizeIs(4));
  EXPECT_EQ(reading.objects[0].classes, (Classes{{"x", 0.5}}));
  EXPECT_EQ(reading.objects[0].tags, (Words{"x", "y"}));
  EXPECT_EQ(reading.objects[1].classes, (Classes{{"b", 1.0}}));
  EXPECT_EQ(reading.objects[2].classes, (Classes{{"c", 1.0}}));
  EXPECT_EQ(reading.objects[3].classes, (Classes{{"x", 1.0}, {"y", 0.0}}));
  EXPECT_THAT(
      reading.repairs,
      ElementsAre("semantic object 1 (a): 2 tags but 1 confidences: the first 1 of both are taken "
                  "as pairs",
                  "semantic object 2 (b): 0 tags but 1 confidences: the first 0 of both are taken "
                  "as pairs",
                  "semantic object 3 (c): a tag comes twice: confidences left out",
                  "semantic object 4 (d): confidence 1.5 of \"x\" taken as 1",
                  "semantic object 4 (d): confidence -0.25 of \"y\" taken as 0"));
}

TEST(SemanticObjectsTest, BlanksInNamesAreTrimmedAndReportedButCaseStays) {
  const Reading reading = Read({{"  Dining \t table ", kSquare, Words{" a  b "}, std::nullopt},
                                {"", kSquare, Words{" "}, std::nullopt},
                                {std::nullopt, kSquare, std::nullopt, std::nullopt}});
  ASSERT_THAT(reading.objects, SizeIs(3));
  EXPECT_EQ(reading.objects[0].label, "Dining table");
  EXPECT_EQ(reading.objects[0].tags, Words{"a b"});
  EXPECT_EQ(reading.objects[1].label, "unnamed");
  EXPECT_EQ(reading.objects[1].tags, Words{"unnamed"});
  EXPECT_EQ(reading.objects[2].label, "unnamed");
  EXPECT_THAT(reading.repairs, SizeIs(5));
  EXPECT_THAT(reading.repairs[0], HasSubstr("object 1 (Dining table): blanks in the name"));
  EXPECT_THAT(reading.repairs[2], "semantic object 2 (unnamed): no name");
}

TEST(SemanticObjectsTest, ALongNameIsNotRepeatedForEachRepair) {
  const auto size_of_messages = [](const Reading& reading) {
    size_t size = reading.status.message().size();
    for (const std::string& line : reading.repairs) size += line.size();
    return size;
  };
  const Words tags(500, " a tag ");
  for (const size_t length : {2000, 5000, 1'000'000}) {
    const Reading reading = Read({{std::string(length, 'x'), kSquare, tags}});
    EXPECT_EQ(reading.status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(reading.status.message()), HasSubstr("semantic object 1 (xxx"));
    EXPECT_LT(size_of_messages(reading), 500 * 300u);
  }
  const Reading reading = Read({{std::string(1000, 'x'), kSquare, tags}});
  EXPECT_TRUE(reading.status.ok()) << reading.status;
  EXPECT_THAT(reading.repairs, SizeIs(500));
  EXPECT_LT(size_of_messages(reading), 500 * 300u);
}

TEST(SemanticObjectsTest, LongOrManyTagsAreRefused) {
  EXPECT_EQ(Read({{"a", kSquare, Words{std::string(5000, ' ') + "b"}}}).status.code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(Read({{"a", kSquare, Words(10'001, "b"), Numbers(10'001, 0.5)}}).status.code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(SemanticObjectsTest, RepeatsAreKeptOnceAndNamed) {
  const std::string other = "POLYGON((0 0,3 0,3 3,0 3,0 0))";
  const Reading reading = Read({{"chair", kSquare},
                                {"chair", kSquare},
                                {"table", kSquare},
                                {"chair", other},
                                {"chair", "POLYGON((0 0,2 0,2 2,0 2))"},
                                {"chair", kSquare, Words{"a"}},
                                {"table", kSquare}});
  EXPECT_THAT(reading.objects, SizeIs(4));
  EXPECT_THAT(reading.repairs,
              ElementsAre("semantic object 5 (chair): ring left open",
                          "semantic objects 2, 5 repeat object 1 (chair): left out",
                          "semantic object 7 repeats object 3 (table): left out"));
}

TEST(SemanticObjectsTest, PartsThatRepeatAnObjectAreLeftOut) {
  const Reading reading = Read({{"t", "POLYGON((0 0,1 0,0 1,0 0))"},
                                {"t", "MULTIPOLYGON(((0 0,1 0,0 1,0 0)),((5 5,9 5,5 9,5 5)))"}});
  EXPECT_THAT(reading.objects, SizeIs(2));
  EXPECT_THAT(reading.repairs, ElementsAre("semantic object 2 (t): MULTIPOLYGON of 2 polygons",
                                           "semantic object 2 repeats object 1 (t): left out"));
}

TEST(SemanticObjectsTest, EitherWindingNeedsNoLine) {
  const Reading reading = Read({{"a", "POLYGON((0 0,0 2,2 2,2 0,0 0))"}});
  ASSERT_THAT(reading.objects, SizeIs(1));
  EXPECT_THAT(reading.repairs, IsEmpty());
  EXPECT_EQ(Area(reading.objects[0].shape), 4.0);
}

TEST(SemanticObjectsTest, HullsThatGoRoundTwiceAreFilled) {
  const Reading reading = Read({{"a", "POLYGON((0 0,4 0,4 4,0 4,0 0,1 1,3 1,3 3,1 3,1 1,0 0))"}});
  ASSERT_THAT(reading.objects, SizeIs(1)) << reading.status;
  EXPECT_EQ(Area(reading.objects[0].shape), 16.0);
  ASSERT_THAT(reading.repairs, SizeIs(1));
  EXPECT_THAT(reading.repairs[0], HasSubstr("semantic object 1 (a): outer ring"));
  EXPECT_THAT(reading.repairs[0], HasSubstr("filled by winding"));
}

TEST(SemanticObjectsTest, ABowTieIsTwoObjects) {
  const Reading reading = Read({{"tie", "POLYGON((0 0,2 2,2 0,0 2,0 0))", Words{"t"}}});
  ASSERT_THAT(reading.objects, SizeIs(2));
  EXPECT_EQ(reading.objects[0].label, "tie");
  EXPECT_EQ(reading.objects[1].label, "tie");
  EXPECT_EQ(reading.objects[1].tags, Words{"t"});
  EXPECT_EQ(Area(reading.objects[0].shape) + Area(reading.objects[1].shape), 2.0);
  EXPECT_THAT(reading.repairs, ElementsAre(HasSubstr("into 2 polygons")));
}

TEST(SemanticObjectsTest, MultiPolygonIsAnObjectAPart) {
  const Reading reading =
      Read({{"m", "MULTIPOLYGON(((0 0,1 0,0 1,0 0)),((5 5,9 5,5 9,5 5)))"}, {"n", kSquare}});
  ASSERT_THAT(reading.objects, SizeIs(3));
  EXPECT_EQ(reading.objects[1].shape, *Polygon::Make({{5, 5}, {9, 5}, {5, 9}}));
  EXPECT_THAT(reading.repairs, ElementsAre("semantic object 1 (m): MULTIPOLYGON of 2 polygons"));
}

TEST(SemanticObjectsTest, PartsCountAsObjects) {
  const std::vector<SemanticEntry> entries = {
      {"m", "MULTIPOLYGON(((0 0,1 0,0 1,0 0)),EMPTY,((5 5,9 5,5 9,5 5)))"},
      {"e", "POLYGON EMPTY"},
      {"tie", "POLYGON((0 0,2 2,2 0,0 2,0 0))"}};
  EXPECT_TRUE(Read(entries, 5).status.ok());
  const Reading reading = Read(entries, 4);
  EXPECT_EQ(reading.status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(reading.status.message()), HasSubstr("--max_import_objects (4)"));
}

TEST(SemanticObjectsTest, PolygonsWithoutAreaAreLeftOutWithALine) {
  const Reading reading = Read({{"a", "POLYGON((0 0,1 1,2 2,0 0))"},
                                {"b", "POLYGON((3 3))"},
                                {"c", "POLYGON EMPTY"},
                                {"d", "MULTIPOLYGON EMPTY"},
                                {"e", "POLYGON((0 0,1 0,0 0))"},
                                {"f", kSquare}});
  ASSERT_TRUE(reading.status.ok()) << reading.status;
  ASSERT_THAT(reading.objects, SizeIs(1));
  for (const char* label : {"(a)", "(b)", "(c)", "(d)", "(e)"}) {
    EXPECT_THAT(reading.repairs,
                ::testing::Contains(::testing::AllOf(HasSubstr(label), HasSubstr("left out"))));
  }
}

TEST(SemanticObjectsTest, HolesAreKeptAndFlatOnesLeftOut) {
  const Reading reading =
      Read({{"h", "POLYGON((0 0,9 0,9 9,0 9,0 0),(1 1,2 1,2 2,1 2,1 1),(5 5,6 6,7 7,5 5))"}});
  ASSERT_THAT(reading.objects, SizeIs(1)) << reading.status;
  EXPECT_EQ(Area(reading.objects[0].shape), 80.0);
  EXPECT_THAT(reading.repairs,
              ElementsAre("semantic object 1 (h): hole 2 encloses no area: left out"));
}

TEST(SemanticObjectsTest, HolesThatAreKeptStayInTheirOrder) {
  const Reading reading =
      Read({{"h",
             "POLYGON((0 0,9 0,9 9,0 9,0 0),(1 1,2 2,1 1),(3 1,4 1,4 2,3 1),(1 5,2 5,1 5),"
             "(5 5,6 5,6 6,5 5),(7 7,7 8,7 7))"}});
  ASSERT_THAT(reading.objects, SizeIs(1)) << reading.status;
  const Rings& rings = reading.objects[0].shape.polygon().rings();
  ASSERT_THAT(rings, SizeIs(3));
  EXPECT_EQ(rings[1].front(), (Point{3, 1}));
  EXPECT_EQ(rings[2].front(), (Point{5, 5}));
  EXPECT_THAT(reading.repairs, ElementsAre(HasSubstr("hole 1 encloses no area"),
                                           HasSubstr("hole 3 encloses no area"),
                                           HasSubstr("hole 5 encloses no area")));
}

TEST(SemanticObjectsTest, ShapesThatMeanNothingNameTheObject) {
  const std::pair<const char*, const char*> kCases[] = {
      {"POINT(1 2)", "POINT where POLYGON or MULTIPOLYGON is needed"},
      {"LINESTRING(1 2,3 4)", "LINESTRING where POLYGON or MULTIPOLYGON is needed"},
      {"POLYGON((0 0,nan 1,1 1))", "finite"},
      {"POLYGON((0 0,9 0,9 9,0 9,0 0),(20 20,22 20,22 22,20 20))", "outside"},
      {"rubbish", "RUBBISH"},
  };
  for (const auto& [shape, message] : kCases) {
    const Reading reading = Read({{"fine", kSquare}, {"bad one", shape}});
    EXPECT_EQ(reading.status.code(), absl::StatusCode::kInvalidArgument) << shape;
    EXPECT_THAT(std::string(reading.status.message()), HasSubstr("semantic object 2 (bad one): "));
    EXPECT_THAT(std::string(reading.status.message()), HasSubstr(message));
  }
  EXPECT_EQ(Read({{"x"}}).status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_FALSE(Read({{std::string(5000, 'x'), kSquare}}).status.ok());
}

// A polygon that joins each of n points on a circle to the one opposite: n * n / 2 crossings.
std::string Star(int n) {
  std::string text = "POLYGON((";
  for (int i = 0; i < n; ++i) {
    const double angle = 2.0 * std::acos(-1.0) * i * (n / 2) / n;
    absl::StrAppend(&text, i > 0 ? "," : "", std::cos(angle), " ", std::sin(angle));
  }
  return text + "))";
}

TEST(SemanticObjectsTest, CrossingsWithoutEndAreRefusedInsteadOfComputed) {
  const Reading small = Read({{"star", Star(51)}});
  EXPECT_TRUE(small.status.ok()) << small.status;
  EXPECT_THAT(small.objects, SizeIs(1));
  EXPECT_EQ(Read({{"star", Star(999)}}).status.code(), absl::StatusCode::kResourceExhausted);
}

TEST(SemanticObjectsTest, CrossingsOfAllObjectsAreCountedTogether) {
  const std::vector<SemanticEntry> stars(10, {"star", Star(51)});
  EXPECT_EQ(Read(stars).status.code(), absl::StatusCode::kResourceExhausted);
  const std::vector<SemanticEntry> ties(10000, {"tie", "POLYGON((0 0,2 2,2 0,0 2,0 0))"});
  EXPECT_TRUE(Read(ties).status.ok());
}

SemanticObject Object(const std::string& label, const Words& tags, const Classes& classes) {
  SemanticObject object;
  object.label = label;
  object.tags = tags;
  object.classes = classes;
  object.shape = *Polygon::Make({{0, 0}, {2, 0}, {2, 2}, {0, 2}});
  return object;
}

TEST(ToSemanticEntryTest, WhatItDoesNotCallLostComesBack) {
  for (const SemanticObject& object :
       {Object("a", {}, {{"a", 1.0}}), Object("a", {"x"}, {{"a", 1.0}}),
        Object("a", {"x", "y"}, {{"x", 0.5}, {"y", 0.25}}), Object("a", {"a"}, {{"a", 1.0}}),
        Object("a", {"a", "b"}, {{"a", 1.0}}), Object("a", {"x", "x"}, {{"a", 1.0}})}) {
    EXPECT_FALSE(LostBy(object).classes);
    EXPECT_THAT(Read({ToSemanticEntry(object)}).objects, ElementsAre(object));
  }
}

TEST(ToSemanticEntryTest, TellsWhatIsLost) {
  EXPECT_TRUE(LostBy(Object("a", {}, {{"a", 0.5}})).classes);
  EXPECT_TRUE(LostBy(Object("a", {"x"}, {{"x", 0.5}, {"y", 0.5}})).classes);
  EXPECT_TRUE(LostBy(Object("a", {"x", "y"}, {{"x", 0.5}})).classes);
  EXPECT_EQ(ToSemanticEntry(Object("a", {"x", "y"}, {{"x", 0.5}})).confidence, std::nullopt);
  SemanticObject object = Object("a", {}, {{"a", 1.0}});
  EXPECT_FALSE(LostBy(object).existence || LostBy(object).height || LostBy(object).attributes);
  object.existence = 0.5;
  object.height = HeightRange{0, 1};
  object.attributes["k"] = true;
  EXPECT_TRUE(LostBy(object).existence && LostBy(object).height && LostBy(object).attributes);
}

}  // namespace
}  // namespace hypermap::storage
