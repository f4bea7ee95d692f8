// Tests that damage stays where it is: a map of which some pages fail their checksums is opened,
// the layers that can't be read are named, and all others are served and edited.
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/edits/apply.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/geopackage/map_check.h"
#include "storage/geopackage/testing/map.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::Rng;
using ::hypermap::testing::TestSeed;
using ::hypermap::testing::UniformInt;
using ::testing::HasSubstr;

class DamagedLayersTest : public ::testing::Test {
 protected:
  // Layers of each kind of table, large enough for several pages each.
  void SetUp() override {
    store_ = OpenStore(folder_.path());
    EditedMap map = CreateMap(*store_, "site");
    map.Edit({{CreateLayer{SemanticSpec("things")}, CreateLayer{SemanticSpec("rooms")},
               CreateLayer{GridSpec("wifi", LayerKind::kScalar, {}, 0.25)},
               CreateLayer{GridSpec("heat", LayerKind::kScalar, {}, 0.25)}}});
    EditBatch batch;
    for (int i = 0; i < 60; ++i) {
      batch.edits.push_back(PutObject{"things", UnitSquare("chair"), ""});
      batch.edits.push_back(PutObject{"rooms", UnitSquare("hall"), ""});
    }
    for (int i = 0; i < 12; ++i) {
      batch.edits.push_back(WriteCells{"wifi", {0, 1, 128 * i, 128 * i + 2}, {-60.5, i + 0.5}});
      batch.edits.push_back(WriteCells{"heat", {0, 1, 128 * i, 128 * i + 2}, {20.5, i + 0.25}});
    }
    map.Edit(batch);
    expected_ = map.snapshot;
    map.stored = nullptr;
    bytes_ = ReadFile(path_);
    for (const char* layer : {"things", "wifi"}) pages_[layer] = PagesOf(path_, layer);
  }

  // Flips a bit of a page and opens the map.
  void Damage(Rng& rng, int64_t page) {
    map_ = nullptr;
    WriteFile(path_, bytes_);
    FlipBitOfPage(rng, path_, page);
    auto opened = store_->Open("site");
    ASSERT_TRUE(opened.ok()) << opened.status();
    map_ = *std::move(opened);
    EXPECT_THAT(map_->opening_notes(), ::testing::IsEmpty());
    auto loaded = map_->Load();
    ASSERT_TRUE(loaded.ok()) << loaded.status();
    loaded_ = *std::move(loaded);
  }

  // Expects that all layers but `damaged` are as they were.
  void ExpectOthersWhole(const std::string& damaged) {
    Snapshot expected = *expected_;
    expected.layers.erase(damaged);
    ExpectSame(*loaded_, expected);
  }

  const testing::TemporaryFolder folder_;
  const std::string path_ = folder_ / "site.gpkg";
  std::unique_ptr<MapStore> store_;
  SnapshotPtr expected_;
  std::string bytes_;
  std::map<std::string, std::vector<int64_t>> pages_;  // by layer
  std::unique_ptr<StoredMap> map_;
  SnapshotPtr loaded_;
};

TEST_F(DamagedLayersTest, PageOfALayerTakesAwayThatLayerOnly) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  for (const char* layer : {"things", "wifi"}) {
    ASSERT_GT(pages_[layer].size(), 2u);
    for (const int64_t page : pages_[layer]) {
      SCOPED_TRACE(absl::StrCat(layer, ", page ", page));
      Damage(rng, page);
      ASSERT_FALSE(HasFatalFailure());
      ExpectOthersWhole(layer);
      ASSERT_TRUE(loaded_->damaged.contains(layer));
      const std::string problem(loaded_->damaged.at(layer).damage.message());
      EXPECT_THAT(problem, HasSubstr(absl::StrCat("layer ", layer)));
      EXPECT_THAT(problem, HasSubstr(absl::StrCat("page ", page)));
      EXPECT_THAT(std::string(map_->damage().message()), HasSubstr(absl::StrCat("(in ", layer)));
    }
  }
}

TEST_F(DamagedLayersTest, OtherLayersGoOn) {
  Rng rng(TestSeed());
  Damage(rng, pages_["things"].back());
  ASSERT_FALSE(HasFatalFailure());
  EditedMap map{std::move(map_), loaded_};
  map.Edit({{PutObject{"rooms", UnitSquare("kitchen"), ""}, DeleteLayer{"heat"}}});
  map.stored = nullptr;
  auto again = store_->Open("site");
  ASSERT_TRUE(again.ok()) << again.status();
  const SnapshotPtr reloaded = *(*again)->Load();
  ExpectSame(*reloaded, *map.snapshot);
  EXPECT_TRUE(reloaded->damaged.contains("things"));
}

TEST_F(DamagedLayersTest, DamagedLayerIsNeitherSilentlyMissingNorReplaced) {
  Rng rng(TestSeed());
  Damage(rng, pages_["things"].back());
  ASSERT_FALSE(HasFatalFailure());
  const auto is_damaged = [](const absl::Status& status) { return absl::IsDataLoss(status); };
  EXPECT_PRED1(is_damaged, loaded_->GetLayer("things").status());
  EXPECT_PRED1(is_damaged, loaded_->SelectLayers({}).status());
  EXPECT_PRED1(is_damaged, Apply(*loaded_, {{PutObject{"things", UnitSquare("a"), ""}}}).status());
  EXPECT_PRED1(is_damaged, Apply(*loaded_, {{DeleteLayer{"things"}}}).status());
  EXPECT_TRUE(
      absl::IsAlreadyExists(Apply(*loaded_, {{CreateLayer{SemanticSpec("things")}}}).status()));
}

TEST_F(DamagedLayersTest, NoFlippedBitIsSilent) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  int isolated = 0;
  for (int i = 0; i < 60; ++i) {
    std::string damaged = bytes_;
    const int64_t at = UniformInt(rng, 0, static_cast<int>(bytes_.size()) - 1);
    damaged[at] = static_cast<char>(damaged[at] ^ 1 << UniformInt(rng, 0, 7));
    map_ = nullptr;
    WriteFile(path_, damaged);
    auto opened = store_->Open("site");
    if (!opened.ok()) continue;
    const absl::StatusOr<SnapshotPtr> loaded = (*opened)->Load();
    if (!loaded.ok()) continue;
    SCOPED_TRACE(absl::StrCat("byte ", at));
    Snapshot expected = *expected_;
    for (const auto& [name, layer] : (*loaded)->damaged) expected.layers.erase(name);
    ExpectSame(**loaded, expected);
    if (!(*loaded)->damaged.empty()) ++isolated;
    if (absl::IsDataLoss((*opened)->damage())) continue;
    // A free page, or the end of the file: nothing was lost.
    EXPECT_TRUE((*loaded)->damaged.empty());
  }
  EXPECT_GT(isolated, 5);
}

}  // namespace
}  // namespace hypermap::storage
