// Readers of the history beside the writer and each other, and what they charge.
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "base/metering/memory_meter.h"
#include "gtest/gtest.h"
#include "storage/conformance/contract.h"
#include "storage/conformance/testing/recorded_history.h"
#include "storage/conformance/testing/recorded_map.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::RandomSite;
using ::hypermap::testing::Rng;

class ReaderContract : public StoreContract {
 protected:
  RecordedMap NewMap() { return RecordedMap(CreateMap(*store_, "site")); }
};

HYPERMAP_CONFORMANCE_SUITE(ReaderContract);

TEST_P(ReaderContract, PastMapShowsNothingThatIsWrittenOrForgottenMeanwhile) {
  Rng rng(seed_);
  RecordedMap map = NewMap();
  map.Write({RandomSite(rng, 20)});
  for (int i = 0; i < 5; ++i) map.Write({RandomBatch(rng, map.now())});
  const auto reader = map.Reader();
  auto past = reader->At(3);
  ASSERT_TRUE(past.ok()) << past.status();
  EditBatch drop;
  for (const auto& [name, layer] : map.now().layers) drop.edits.push_back(DeleteLayer{name});
  map.Write({drop});
  map.Compact(map.newest(), 1000);
  ExpectContentAsRecorded(rng, **past, map.at(3));
  past->reset();
  EXPECT_EQ(reader->At(3).status().code(), absl::StatusCode::kOutOfRange);
}

TEST_P(ReaderContract, ReaderOutlivesTheMapAndIsOpenBesideTheNextOne) {
  Rng rng(3);
  RecordedMap map = NewMap();
  map.Write({{{CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("chair"), ""}}}});
  const auto reader = map.Reader();
  map.Reopen(*store_);
  map.Write({{{DeleteObject{"s", 1}}}});
  ExpectPastIsAsRecorded(rng, *reader, map, 1);
  ASSERT_TRUE(map.Reader()->At(2).ok());
}

TEST_P(ReaderContract, ReaderAnswersAfterItsMapWasClosed) {
  Rng rng(seed_);
  RecordedMap map = NewMap();
  map.Write({RandomSite(rng, 20)});
  for (int i = 0; i < 5; ++i) map.Write({RandomBatch(rng, map.now())});
  const auto reader = map.Reader();
  auto past = reader->At(3);
  ASSERT_TRUE(past.ok()) << past.status();
  map.Close();
  ExpectContentAsRecorded(rng, **past, map.at(3));
  past->reset();
  ExpectAllAsRecorded(rng, *reader, map, 0);
}

TEST_P(ReaderContract, ReadersOfOneMapAreIndependent) {
  Rng rng(seed_);
  RecordedMap map = NewMap();
  map.Write({RandomSite(rng, 20)});
  for (int i = 0; i < 5; ++i) map.Write({RandomBatch(rng, map.now())});
  std::vector<std::unique_ptr<HistoryReader>> readers;
  std::vector<std::unique_ptr<PastMap>> pasts;
  for (Revision revision = 0; revision <= 6; ++revision) {
    readers.push_back(map.Reader());
    auto past = readers.back()->At(revision);
    ASSERT_TRUE(past.ok()) << past.status();
    pasts.push_back(*std::move(past));
  }
  for (int i = 0; i < 3; ++i) map.Write({RandomBatch(rng, map.now())});
  map.Compact(map.newest(), 1000);
  for (Revision revision = 6; revision >= 0; --revision) {
    SCOPED_TRACE(::testing::Message() << "revision " << revision);
    EXPECT_EQ(pasts[revision]->structure()->revision, revision);
    ExpectContentAsRecorded(rng, *pasts[revision], map.at(revision));
  }
  pasts.clear();
  // All of them see the newest revision.
  for (const auto& reader : readers) ExpectPastIsAsRecorded(rng, *reader, map, map.newest());
}

TEST_P(ReaderContract, ReadsOfManyThreadsBesideTheWriterAreOfOneRevision) {
  Rng rng(seed_);
  RecordedMap map = NewMap();
  EditBatch make{{CreateLayer{SemanticSpec("s")}}};
  for (int i = 0; i < 10; ++i) make.edits.push_back(PutObject{"s", UnitSquare("0"), ""});
  map.Write({make});
  std::atomic<bool> done = false;
  std::atomic<int> reads = 0;
  // Every commit gives all ten objects the label of its revision.
  const auto read = [&](std::unique_ptr<HistoryReader> reader) {
    while (!done || reads < 10) {
      const Revision newest = reader->Kept()->newest;
      auto past = reader->At(newest);
      if (past.status().code() == absl::StatusCode::kOutOfRange) continue;
      ASSERT_TRUE(past.ok()) << past.status();
      auto objects = (*past)->Objects("s", Box{{0, 0}, {1, 1}});
      ASSERT_TRUE(objects.ok()) << objects.status();
      ASSERT_EQ(objects->size(), 10u);
      for (const ObjectPtr& object : *objects) {
        EXPECT_EQ(object->label, std::to_string(newest - 1)) << "revision " << newest;
      }
      ++reads;
    }
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < 3; ++i) threads.emplace_back(read, map.Reader());
  for (int i = 1; i <= 30; ++i) {
    EditBatch batch;
    for (ObjectId id = 1; id <= 10; ++id) {
      SemanticObject object = UnitSquare(std::to_string(i));
      object.id = id;
      batch.edits.push_back(PutObject{"s", object, ""});
    }
    map.Write({batch});
    if (i % 7 == 0) map.Compact(map.newest() - 2, 50);
  }
  done = true;
  for (std::thread& thread : threads) thread.join();
}

TEST_P(ReaderContract, FollowersOfTheCommitsMissNoneAndSeeNoneTwice) {
  constexpr Revision kLast = 60;
  constexpr int kFollowers = 3;
  RecordedMap map = NewMap();
  std::atomic<Revision> followed[kFollowers] = {};
  std::atomic<bool> failed = false;
  const auto follow = [&](int number, std::unique_ptr<HistoryReader> reader) {
    Revision at = 0;
    while (at < kLast && !failed) {
      const auto commits = reader->Commits(at, number + 1);
      if (!commits.ok()) {
        failed = true;
        FAIL() << commits.status();
      }
      for (const PastCommit& commit : *commits) {
        EXPECT_EQ(commit.record.revision, ++at);
        ASSERT_EQ(commit.changes.size(), 1u);
        const auto& set = std::get<TransformSet>(commit.changes.front());
        EXPECT_EQ(set.transform.parent_from_child.x(), static_cast<double>(at));
      }
      followed[number] = at;
    }
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < kFollowers; ++i) threads.emplace_back(follow, i, map.Reader());
  while (map.newest() < kLast) {
    std::vector<EditBatch> group;
    for (Revision next = map.newest() + 1; group.size() < 3; ++next) {
      group.push_back({{SetTransform{{"map", "robot", {static_cast<double>(next), 0, 0}}}}});
    }
    map.Write(group);
    // What all of them have seen may go.
    map.Compact(*std::min_element(std::begin(followed), std::end(followed)), 20);
  }
  for (std::thread& thread : threads) thread.join();
  for (const std::atomic<Revision>& at : followed) EXPECT_EQ(at, kLast);
}

TEST_P(ReaderContract, ReadersAreOpenedByManyThreadsBesideTheWriter) {
  Rng rng(seed_);
  RecordedMap map = NewMap();
  map.Write({RandomSite(rng, 20)});
  std::atomic<bool> done = false;
  const auto read = [&, snapshot = map.now(), seed = rng()] {
    Rng own(seed);
    for (int i = 0; i < 5 || !done; ++i) {
      const auto reader = map.stored().OpenHistory();
      ASSERT_TRUE(reader.ok()) << reader.status();
      const auto past = (*reader)->At(1);
      ASSERT_TRUE(past.ok()) << past.status();
      ExpectContentAsRecorded(own, **past, snapshot);
    }
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < 3; ++i) threads.emplace_back(read);
  while (map.newest() < 15) map.Write({RandomBatch(rng, map.now())});
  done = true;
  for (std::thread& thread : threads) thread.join();
}

// Allows a number of bytes.
class Allowance : public MemoryAccount {
 public:
  explicit Allowance(int64_t bytes) : bytes_(bytes) {}
  absl::Status ChargeMemory(int64_t bytes) override {
    if (bytes > bytes_) return absl::ResourceExhaustedError("too much");
    bytes_ -= bytes;
    return absl::OkStatus();
  }
  void FreeMemory(int64_t bytes) override { bytes_ += bytes; }

 private:
  int64_t bytes_;
};

TEST_P(ReaderContract, ReadsStopWhereTheirMemoryIsUsedUp) {
  if (GetParam().exceptions.metering) GTEST_SKIP();
  Rng rng(seed_);
  RecordedMap map = NewMap();
  map.Write({RandomSite(rng, 200)});
  while (map.newest() < 10) {
    std::vector<EditBatch> group{RandomBatch(rng, map.now())};
    map.Write(group);
  }
  const std::unique_ptr<HistoryReader> reader = map.Reader();
  const auto read_all = [&](int64_t bytes) {
    Allowance allowance(bytes);
    MemoryMeter meter(&allowance);
    const ScopedMeter here(&meter);
    auto past = reader->At(map.newest() - 1);
    EXPECT_TRUE(past.ok()) << past.status();
    absl::Status status;
    for (const auto& [name, layer] : (*past)->structure()->layers) {
      status.Update(layer.spec.grid ? (*past)->Tiles(name, kAllCells).status()
                                    : (*past)->Objects(name).status());
    }
    past->reset();
    status.Update(reader->Commits(0, 1000).status());
    return std::pair(status, meter.taken());
  };
  const auto [all, bytes] = read_all(int64_t{1} << 30);
  ASSERT_TRUE(all.ok()) << all;
  ASSERT_GT(bytes, MemoryMeter::kFreeBytes);
  const auto [some, at_most] = read_all((bytes - MemoryMeter::kFreeBytes) / 2);
  EXPECT_TRUE(absl::IsResourceExhausted(some)) << some;
  EXPECT_LT(at_most, bytes);
  ExpectAllAsRecorded(rng, *reader, map, 0);
}

TEST_P(ReaderContract, ListOfRevisionsIsChargedWhileItIsRead) {
  if (GetParam().exceptions.metering) GTEST_SKIP();
  constexpr int kCommits = 2000;
  RecordedMap map = NewMap();
  std::vector<EditBatch> group;
  for (int i = 0; i < kCommits; ++i) {
    group.push_back({{SetTransform{{"map", "dock", {1.0 * i, 0, 0}}}}});
  }
  map.Write(group);
  const auto reader = map.Reader();
  const auto list = [&](int64_t bytes) {
    Allowance allowance(bytes);
    MemoryMeter meter(&allowance);
    const ScopedMeter here(&meter);
    const absl::Status status = reader->Revisions(0, kCommits + 1, false, kCommits).status();
    return std::pair(status, meter.taken());
  };
  const auto [all, bytes] = list(int64_t{1} << 30);
  ASSERT_TRUE(all.ok()) << all;
  EXPECT_GE(bytes, kCommits * static_cast<int64_t>(sizeof(RevisionRecord)));
  const auto [refused, at_most] = list(0);
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_LE(at_most, MemoryMeter::kFreeBytes);
}

}  // namespace
}  // namespace hypermap::storage
