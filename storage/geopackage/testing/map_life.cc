#include "storage/geopackage/testing/map_life.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/conformance/testing/recorded_map.h"

namespace hypermap::storage {

using ::hypermap::testing::Rng;
using ::hypermap::testing::UniformInt;

namespace {

constexpr int kObjects = 12;
constexpr int kKeptRevisions = 8;

std::string RequestOf(Revision revision) { return absl::StrCat("request ", revision); }

void ExpectSameTiles(const TileMap& actual, const GridLayer& expected) {
  ASSERT_EQ(actual.size(), expected.tiles().size());
  for (const auto& [index, tile] : expected.tiles()) {
    const auto found = actual.find(index);
    ASSERT_NE(found, actual.end()) << "tile " << index.row << ", " << index.col;
    EXPECT_TRUE(SameTile(found->second, tile)) << "tile " << index.row << ", " << index.col;
  }
}

void ExpectSameObjects(const std::vector<ObjectPtr>& actual, const Layer& expected) {
  const auto objects = dynamic_cast<const SemanticLayer&>(expected).Objects();
  ASSERT_EQ(actual.size(), objects.size());
  for (size_t i = 0; i < objects.size(); ++i) {
    EXPECT_TRUE(SameObject(actual[i], objects[i])) << "object " << objects[i]->id;
  }
}

}  // namespace

MapLife::MapLife(Rng& rng, const std::string& map_name, int num_commits) {
  auto empty = std::make_shared<Snapshot>();
  empty->map_name = map_name;
  snapshots_.push_back(std::move(empty));
  LifeProgress progress;
  bool has_reopened = false;
  const auto add = [&](Step::Kind kind) { steps_.push_back({kind, progress}); };
  while (progress.revision < num_commits) {
    const int group = progress.revision == 0 || UniformInt(rng, 0, 3) > 0 ? 1 : 2;
    for (int i = 0; i < group; ++i) {
      const Snapshot& now = *snapshots_.back();
      commits_.push_back(MakeCommit(
          now,
          now.revision == 0 ? testing::RandomSite(rng, kObjects) : testing::RandomEdits(rng, now),
          RequestOf(now.revision + 1)));
      snapshots_.push_back(commits_.back().applied.snapshot);
    }
    progress.revision += group;
    add(Step::Kind::kWrite);
    switch (UniformInt(rng, 0, 7)) {
      case 0:
        ++progress.num_marks;
        add(Step::Kind::kAddMark);
        break;
      case 1:
        progress.oldest = std::max(progress.oldest, progress.revision - kKeptRevisions);
        add(Step::Kind::kCompact);
        break;
      case 2:
        add(Step::Kind::kOpenReader);
        break;
      case 3:
        add(Step::Kind::kCloseReader);
        break;
      default:
        break;
    }
    if (UniformInt(rng, 0, 30) == 0 || (progress.revision >= num_commits / 5 && !has_reopened)) {
      has_reopened = true;
      add(Step::Kind::kReopen);
    }
  }
}

std::vector<Commit> MapLife::CommitsOf(const LifeProgress& before,
                                       const LifeProgress& after) const {
  return {commits_.begin() + before.revision, commits_.begin() + after.revision};
}

TimeMark MapLife::MarkOf(int number) const {
  TimeMark mark;
  mark.commit_time = absl::FromUnixSeconds(2'000'000'000 + number);
  mark.passed = absl::Seconds(number);
  mark.lived = absl::Seconds(2 * number);
  mark.server_time = absl::FromUnixSeconds(number);
  mark.boot_id = "boot";
  mark.since_boot = absl::Seconds(3 * number);
  return mark;
}

absl::Status MapLife::Do(const Step& step, const LifeProgress& before, StoredMap& map) {
  constexpr int kRows = 30;
  switch (step.kind) {
    case Step::Kind::kWrite:
      return map.Write(CommitsOf(before, step.after));
    case Step::Kind::kAddMark:
      return map.AddTimeMark(MarkOf(step.after.num_marks), absl::ZeroDuration());
    case Step::Kind::kCompact:
      return map.Compact(step.after.oldest, absl::InfinitePast(), kRows).status();
    case Step::Kind::kOpenReader: {
      absl::StatusOr<std::unique_ptr<HistoryReader>> reader = map.OpenHistory();
      if (!reader.ok()) return reader.status();
      reader_ = *std::move(reader);
      return reader_->Commits(before.revision - 1, 1).status();
    }
    case Step::Kind::kCloseReader:
      CloseReader();
      return absl::OkStatus();
    case Step::Kind::kReopen:
      break;
  }
  return absl::UnimplementedError("the caller opens the map");
}

LifeProgress MapLife::ExpectWhole(Rng& rng, StoredMap& map, const LifeProgress& least,
                                  const LifeProgress& most) const {
  LifeProgress found;
  const auto snapshot = map.Load();
  EXPECT_TRUE(snapshot.ok()) << snapshot.status();
  if (!snapshot.ok()) return found;
  found.revision = (*snapshot)->revision;
  // A group of commits is there whole or not at all.
  EXPECT_TRUE(found.revision == least.revision || found.revision == most.revision)
      << "revision " << found.revision << ", where " << least.revision << " was acknowledged and "
      << most.revision << " begun";
  if (found.revision < least.revision || found.revision > most.revision) return found;
  ExpectSameNewest(**snapshot);
  ExpectReceipts(rng, map, found.revision);

  const auto marks = map.TimeMarks();
  EXPECT_TRUE(marks.ok()) << marks.status();
  if (marks.ok()) {
    found.num_marks = static_cast<int>(marks->size());
    EXPECT_GE(found.num_marks, least.num_marks);
    EXPECT_LE(found.num_marks, most.num_marks);
    for (int i = 0; i < found.num_marks; ++i) EXPECT_EQ((*marks)[i], MarkOf(i + 1));
  }

  const auto reader = map.OpenHistory();
  EXPECT_TRUE(reader.ok()) << reader.status();
  if (!reader.ok()) return found;
  const auto kept = (*reader)->Kept();
  EXPECT_TRUE(kept.ok()) << kept.status();
  if (!kept.ok()) return found;
  EXPECT_EQ(kept->newest, found.revision);
  EXPECT_TRUE(kept->oldest == least.oldest || kept->oldest == most.oldest) << kept->oldest;
  found.oldest = kept->oldest;
  ExpectSamePast(rng, **reader, found);
  ExpectSameCommits(**reader, found.oldest, found.revision);
  return found;
}

LifeProgress MapLife::Next(const LifeProgress& now) const {
  LifeProgress next = now;
  if (now.revision < static_cast<Revision>(commits_.size())) ++next.revision;
  return next;
}

void MapLife::ExpectGoesOn(StoredMap& map, const LifeProgress& now) const {
  const LifeProgress next = Next(now);
  if (next.revision == now.revision) return;
  const absl::Status status = map.Write({commits_[now.revision]});
  EXPECT_TRUE(status.ok()) << status;
  const auto receipt = map.FindReceipt(RequestOf(next.revision));
  ASSERT_TRUE(receipt.ok()) << receipt.status();
  EXPECT_TRUE(receipt->has_value());
}

void MapLife::ExpectSameNewest(const Snapshot& actual) const {
  const Snapshot& expected = *snapshots_[actual.revision];
  EXPECT_EQ(actual.map_name, expected.map_name);
  EXPECT_EQ(actual.next_object_id, expected.next_object_id);
  EXPECT_EQ(actual.layer_versions, expected.layer_versions);
  EXPECT_EQ(actual.frames.transforms(), expected.frames.transforms());
  EXPECT_EQ(StructureOf(actual)->layers, StructureOf(expected)->layers);
  for (const auto& [name, layer] : expected.layers) {
    SCOPED_TRACE(name);
    const Layer* found = actual.FindLayer(name);
    ASSERT_NE(found, nullptr);
    if (const auto* grid = AsGrid(layer.get())) {
      ExpectSameTiles(dynamic_cast<const GridLayer&>(*found).tiles(), *grid);
    } else {
      ExpectSameObjects(dynamic_cast<const SemanticLayer&>(*found).Objects(), *layer);
    }
  }
}

void MapLife::ExpectSamePast(Rng& rng, HistoryReader& reader, const LifeProgress& now) const {
  const int revision =
      UniformInt(rng, static_cast<int>(now.oldest), static_cast<int>(now.revision));
  SCOPED_TRACE(::testing::Message() << "past revision " << revision);
  const auto past = reader.At(revision);
  ASSERT_TRUE(past.ok()) << past.status();
  const Snapshot& expected = *snapshots_[revision];
  EXPECT_EQ((*past)->structure()->layers, StructureOf(expected)->layers);
  EXPECT_EQ((*past)->structure()->frames.transforms(), expected.frames.transforms());
  for (const auto& [name, layer] : expected.layers) {
    SCOPED_TRACE(name);
    if (const auto* grid = AsGrid(layer.get())) {
      const auto tiles = (*past)->Tiles(name, kAllCells);
      ASSERT_TRUE(tiles.ok()) << tiles.status();
      ExpectSameTiles(*tiles, *grid);
    } else {
      const auto objects = (*past)->Objects(name);
      ASSERT_TRUE(objects.ok()) << objects.status();
      ExpectSameObjects(*objects, *layer);
    }
  }
}

void MapLife::ExpectSameCommits(HistoryReader& reader, Revision after, Revision newest) const {
  // Old commits are long; the newest are the ones that an interruption may harm.
  after = std::max(after, newest - 3);
  const auto commits = reader.Commits(after, 1 << 20);
  ASSERT_TRUE(commits.ok()) << commits.status();
  ASSERT_EQ(static_cast<Revision>(commits->size()), newest - after);
  for (const PastCommit& past : *commits) {
    SCOPED_TRACE(::testing::Message() << "revision " << past.record.revision);
    ASSERT_EQ(past.record.revision, ++after);
    const Commit& commit = commits_[after - 1];
    EXPECT_EQ(past.record.time, commit.time);
    ASSERT_EQ(past.changes.size(), commit.applied.changes.size());
    for (size_t i = 0; i < past.changes.size(); ++i) {
      EXPECT_TRUE(SameChange(past.changes[i], commit.applied.changes[i])) << "change " << i;
    }
  }
}

void MapLife::ExpectReceipts(Rng& rng, StoredMap& map, Revision newest) const {
  const int some = UniformInt(rng, 1, static_cast<int>(commits_.size()));
  for (const Revision revision : {Revision{some}, newest, newest + 1}) {
    if (revision == 0) continue;
    const auto receipt = map.FindReceipt(RequestOf(revision));
    ASSERT_TRUE(receipt.ok()) << receipt.status();
    ASSERT_EQ(receipt->has_value(), revision <= newest) << RequestOf(revision);
    if (!receipt->has_value()) continue;
    EXPECT_EQ((**receipt).revision, revision);
    EXPECT_EQ((**receipt).object_ids, commits_[revision - 1].applied.object_ids);
  }
}

}  // namespace hypermap::storage
