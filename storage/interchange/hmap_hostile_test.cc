// Files that mean harm: each is refused, with the right error, quickly and in little memory.
#include <functional>
#include <random>

#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/interchange/hmap.h"
#include "storage/interchange/nav2.h"
#include "storage/interchange/png_codec.h"
#include "storage/interchange/testing/archive.h"
#include "storage/interchange/testing/content.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::testing::HasSubstr;
using testing::kOccupancyYaml;
using testing::OccupancyHmap;
using testing::SemanticHmap;
using testing::Zip;

std::string Png(int side) {
  return *EncodePng({side, side, std::vector<GreyAlpha>(side * side, {0, 255})},
                    PngChannels::kGreyAlpha);
}

struct HostileCase {
  const char* name;
  std::function<std::string()> data;
  absl::StatusCode code;
  const char* message;
};

constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;
constexpr auto kExhausted = absl::StatusCode::kResourceExhausted;

const HostileCase kHostileCases[] = {
    {"NotAZip", [] { return std::string("#!/bin/sh\n"); }, kInvalid, "no zip archive"},
    {"Nothing", [] { return std::string(); }, kInvalid, "no zip archive"},
    {"NoConfig",
     [] {
       return Zip({{"a", "b"}});
     },
     kInvalid, "\"hmap_config.yaml\": missing"},
    {"ConfigIsNoYaml",
     [] {
       return Zip({{"hmap_config.yaml", "a: b: c"}});
     },
     kInvalid, "no YAML"},
    {"ConfigIsBinary",
     [] {
       return Zip({{"hmap_config.yaml", std::string("\0\xFF\x80", 3)}});
     },
     kInvalid, "hmap_config.yaml"},
    {"ConfigIsDeep",
     [] {
       return Zip({{"hmap_config.yaml", std::string(100000, '[')}});
     },
     kInvalid, "hmap_config.yaml"},
    {"ConfigIsLarge",
     [] {
       return Zip({{"hmap_config.yaml", "layers: []\n#" + std::string(5 << 20, 'x')}});
     },
     kExhausted, "YAML of"},
    {"MemberLeadsOut",
     [] {
       return Zip({{"hmap_config.yaml", "layers: []"}, {"../evil", "x"}});
     },
     kInvalid, "leads out"},
    {"FileLeadsOut",
     [] {
       return Zip({{"hmap_config.yaml",
                    "layers: [{name: a, frame_id: m, class: SemanticLayer, load_file: true,"
                    " file: ../../etc/passwd}]"}});
     },
     kInvalid, "leads out"},
    {"ImageLeadsOut",
     [] { return OccupancyHmap("image: /etc/passwd\nresolution: 1\norigin: [0, 0, 0]", Png(1)); },
     kInvalid, "leads out"},
    {"SemanticMemberMissing",
     [] {
       return Zip({{"hmap_config.yaml",
                    "layers: [{name: a, frame_id: m, class: SemanticLayer, load_file: true,"
                    " file: gone}]"}});
     },
     kInvalid, "layer \"a\": member \"gone\": missing"},
    {"ImageMissing",
     [] { return OccupancyHmap("image: no.png\nresolution: 1\norigin: [0, 0, 0]", Png(1)); },
     kInvalid, "member \"no.png\": missing"},
    {"ImageIsText", [] { return OccupancyHmap(kOccupancyYaml, "not an image"); }, kInvalid,
     "neither PNG nor PGM"},
    {"ImageIsCut", [] { return OccupancyHmap(kOccupancyYaml, Png(50).substr(0, 60)); }, kInvalid,
     "broken PNG"},
    {"ResolutionIsTiny",
     [] {
       return OccupancyHmap("image: occupancy.png\nresolution: 1e-300\norigin: [0, 0, 0]", Png(1));
     },
     kInvalid, "resolution"},
    {"ResolutionIsHuge",
     [] {
       return OccupancyHmap("image: occupancy.png\nresolution: 1e300\norigin: [0, 0, 0]", Png(1));
     },
     kInvalid, "resolution"},
    {"SemanticIsNoList", [] { return SemanticHmap("a: b"); }, kInvalid, "member \"semantic\""},
    {"SemanticIsDeep", [] { return SemanticHmap("- name: " + std::string(100000, '[')); }, kInvalid,
     "member \"semantic\""},
    {"SemanticHasAliases",
     [] {
       std::string text = "- &a {name: lol, shape: 'POLYGON((0 0,1 0,0 1))'}\n";
       for (int i = 0; i < 1000; ++i) text += "- *a\n";
       return SemanticHmap(text);
     },
     kInvalid, "alias"},
    {"ShapeIsInfinite",
     [] { return SemanticHmap("- {name: a, shape: 'POLYGON((0 0,1e999 0,0 1))'}"); }, kInvalid,
     "semantic object 1 (a)"},
    {"ShapeIsMissing", [] { return SemanticHmap("- {name: a}"); }, kInvalid,
     "semantic object 1 (a): no shape"},
    {"ShapeHasParentheses",
     [] { return SemanticHmap("- {name: a, shape: '" + std::string(100000, '(') + "'}"); },
     kInvalid, "semantic object 1 (a)"},
};

TEST(HostileHmapTest, IsRefusedWithItsReason) {
  for (const HostileCase& c : kHostileCases) {
    const absl::Status status = DecodeHmap(c.data(), Limits()).status();
    EXPECT_EQ(status.code(), c.code) << c.name << ": " << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(c.message)) << c.name;
  }
}

TEST(HostileHmapTest, EachLimitIsNamed) {
  Limits limits;
  limits.max_cells = 99;
  const absl::Status pixels = DecodeHmap(OccupancyHmap(kOccupancyYaml, Png(10)), limits).status();
  EXPECT_EQ(pixels.code(), kExhausted);
  EXPECT_THAT(std::string(pixels.message()), HasSubstr("--max_cells"));

  limits = {};
  limits.max_import_objects = 1;
  const std::string two =
      "- {name: a, shape: 'POLYGON((0 0,1 0,0 1))'}\n- {name: b, shape: 'POLYGON((0 0,1 0,0 1))'}";
  const absl::Status objects = DecodeHmap(SemanticHmap(two), limits).status();
  EXPECT_EQ(objects.code(), kExhausted);
  EXPECT_THAT(std::string(objects.message()), HasSubstr("--max_import_objects"));

  limits = {};
  limits.max_vertices = 2;
  const absl::Status vertices = DecodeHmap(SemanticHmap(two), limits).status();
  EXPECT_EQ(vertices.code(), kExhausted);
  EXPECT_THAT(std::string(vertices.message()), HasSubstr("--max_vertices"));

  limits = {};
  limits.max_unpacked_bytes = 1 << 20;
  const absl::Status bytes = DecodeHmap(SemanticHmap(std::string(2 << 20, ' ')), limits).status();
  EXPECT_EQ(bytes.code(), kExhausted);
  EXPECT_THAT(std::string(bytes.message()), HasSubstr("--max_unpacked_bytes"));
}

// One image named by many layers counts each time.
TEST(HostileHmapTest, PixelsOfAllLayersAreCountedTogether) {
  std::string config = "layers:\n";
  for (int i = 0; i < 11; ++i) {
    absl::StrAppend(&config, "  - {name: l", i,
                    ", frame_id: map, load_file: true, file: occupancy,"
                    " class: OccupancyGridLayer}\n");
  }
  const std::string data = Zip({{"hmap_config.yaml", config},
                                {"occupancy.yaml", kOccupancyYaml},
                                {"occupancy.png", Png(10)}});
  Limits limits;
  limits.max_cells = 1000;
  EXPECT_EQ(DecodeHmap(data, limits).status().code(), kExhausted);
  limits.max_cells = 1100;
  EXPECT_TRUE(DecodeHmap(data, limits).ok());
}

TEST(HostileHmapTest, AReportOfRepairsIsBounded) {
  std::string text;
  for (int i = 0; i < 5000; ++i) {
    absl::StrAppend(&text, "- {name: a, shape: 'POLYGON((0 0,1 0,0 ", i + 1, "))'}\n");
  }
  const absl::StatusOr<ImportedMap> imported = DecodeHmap(SemanticHmap(text), Limits());
  ASSERT_TRUE(imported.ok()) << imported.status();
  EXPECT_EQ(imported->repairs.size(), 1001u);
  EXPECT_EQ(imported->repairs.back(), "and 4000 repairs more");
}

// Flips bytes of a good file. What is taken must also apply: nothing half understood gets through.
void Mutate(const std::string& good,
            const std::function<absl::StatusOr<ImportedMap>(std::string)>& decode) {
  const uint64_t seed = hypermap::testing::TestSeed();
  std::mt19937_64 random(seed);
  for (int round = 0; round < 2000; ++round) {
    std::string bad = good;
    const int num_flips = 1 + random() % 4;
    for (int i = 0; i < num_flips; ++i) bad[random() % bad.size()] = static_cast<char>(random());
    if (random() % 4 == 0) bad.resize(random() % bad.size());
    const absl::StatusOr<ImportedMap> imported = decode(bad);
    if (imported.ok() && !imported->batch.edits.empty()) {
      Snapshot empty;
      const absl::Status applied = Apply(empty, imported->batch).status();
      ASSERT_TRUE(applied.ok()) << applied << ", seed " << seed << ", round " << round;
    } else if (!imported.ok()) {
      ASSERT_TRUE(imported.status().code() == kInvalid || imported.status().code() == kExhausted)
          << imported.status() << ", seed " << seed << ", round " << round;
    }
  }
}

TEST(HostileHmapTest, DamagedArchivesNeverGetThroughHalf) {
  Mutate(
      Zip({{"hmap_config.yaml",
            "layers:\n"
            "  - {name: grid, frame_id: map, load_file: true, file: g, class: OccupancyGridLayer}\n"
            "  - {name: sem, frame_id: map, load_file: true, file: s, class: SemanticLayer}\n"},
           {"g.yaml", "image: g.png\nresolution: 0.5\norigin: [1, 2, 0]\n"},
           {"g.png", Png(4)},
           {"s", "- {name: a, shape: 'POLYGON((0 0,1 0,0 1,0 0))', tags: [b], confidence: [1]}"}}),
      [](const std::string& data) { return DecodeHmap(data, Limits()); });
}

// The checksums of the archive hide the parsers behind it; these see the damage themselves.
TEST(HostileHmapTest, DamagedMembersNeverGetThroughHalf) {
  const std::string config =
      "layers:\n"
      "  - {name: sem, frame_id: map, load_file: true, file: s, class: SemanticLayer}\n"
      "transforms:\n"
      "  - {frame_id: map, child_frame_id: odom, transform_pose: [1, 2, 3]}\n";
  const std::string entries =
      "- {name: a, shape: 'POLYGON((0 0,1 0,0 1,0 0))', tags: [b], confidence: [1]}\n"
      "- name: c\n  shape: MULTIPOLYGON(((0 0,9 0,9 9,0 0),(2 1,3 1,3 2)),((5 1,6 2,6 1 5 2)))\n";
  Mutate(config, [&](const std::string& data) {
    return DecodeHmap(Zip({{"hmap_config.yaml", data}, {"s", entries}}), Limits());
  });
  Mutate(entries, [&](const std::string& data) {
    return DecodeHmap(Zip({{"hmap_config.yaml", config}, {"s", data}}), Limits());
  });
  Mutate(kOccupancyYaml, [&](const std::string& data) {
    return DecodeHmap(OccupancyHmap(data, Png(2)), Limits());
  });
  Limits small;
  small.max_cells = 1 << 16;
  Mutate(Png(5), [&](const std::string& data) {
    return DecodeHmap(OccupancyHmap(kOccupancyYaml, data), small);
  });
  Mutate("P5\n# c\n3 2\n255\nabcdef", [&](const std::string& data) {
    return DecodeNav2(
        {{"m.yaml", "image: m.pgm\nresolution: 1\norigin: [0, 0, 0]\n"}, {"m.pgm", data}}, "m", "",
        small);
  });
}

}  // namespace
}  // namespace hypermap::storage
