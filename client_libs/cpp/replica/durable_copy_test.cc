#include "client_libs/cpp/replica/durable_copy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <memory>
#include <string>
#include <utility>

#include "map/edits/apply.h"
#include "map/edits/difference.h"
#include "storage/geopackage/geopackage_store.h"
#include "tests/support/eventually.h"
#include "tests/support/random_map.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::client {
namespace {

using ::hypermap::testing::Rng;
using ::hypermap::testing::TemporaryFolder;
using ::testing::IsEmpty;

constexpr absl::Duration kNever = absl::Hours(1);
const absl::Time kCreatedAt = absl::FromUnixSeconds(1000);

absl::Time TimeOf(Revision revision) { return kCreatedAt + absl::Seconds(revision); }

// A site under random edits, which are the same for the same seed.
class Life {
 public:
  explicit Life(uint64_t seed) : rng_(seed) {
    newest_ = std::make_shared<Snapshot>(
        hypermap::testing::MakeSnapshot("site", hypermap::testing::RandomSite(rng_, 20)));
  }

  KnownRevision newest() const { return {newest_, TimeOf(newest_->revision), kCreatedAt}; }
  void GoOn() {
    const auto applied = Apply(*newest_, hypermap::testing::RandomEdits(rng_, *newest_));
    ASSERT_TRUE(applied.ok()) << applied.status();
    newest_ = applied->snapshot;
  }

 private:
  Rng rng_;
  SnapshotPtr newest_;
};

std::unique_ptr<DurableCopy> Open(const TemporaryFolder& folder,
                                  absl::Duration write_delay = kNever) {
  auto copy = DurableCopy::Open(folder.path(), "site", "all", write_delay);
  EXPECT_TRUE(copy.ok()) << copy.status();
  return copy.ok() ? *std::move(copy) : nullptr;
}

void ExpectStored(const DurableCopy& copy, const KnownRevision& wanted) {
  const std::optional<KnownRevision> stored = copy.stored();
  ASSERT_TRUE(stored.has_value());
  EXPECT_EQ(stored->snapshot->revision, wanted.snapshot->revision);
  EXPECT_EQ(stored->time, wanted.time);
  EXPECT_EQ(stored->created_at, wanted.created_at);
  EXPECT_THAT(Difference(*stored->snapshot, *wanted.snapshot), IsEmpty());
  EXPECT_THAT(Difference(*wanted.snapshot, *stored->snapshot), IsEmpty());
  EXPECT_EQ(stored->snapshot->layer_versions, wanted.snapshot->layer_versions);
  EXPECT_EQ(stored->snapshot->frames.transforms(), wanted.snapshot->frames.transforms());
}

TEST(DurableCopyTest, BringsTheFileFromOneRevisionToAnother) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  const TemporaryFolder folder;
  Life life(seed);
  for (int round = 0; round < 10; ++round) {
    {
      const auto copy = Open(folder);
      copy->Write(life.newest());
      ASSERT_TRUE(copy->Flush().ok());
      // The destructor writes the last of several revisions that are given at once.
      for (int i = 0; i < round; ++i) life.GoOn();
      copy->Write(life.newest());
    }
    ExpectStored(*Open(folder), life.newest());
  }
}

TEST(DurableCopyTest, WritesByItselfAfterAWhile) {
  const TemporaryFolder folder;
  const auto copy = Open(folder, absl::Milliseconds(1));
  copy->Write(Life(1).newest());
  EXPECT_TRUE(testing::Eventually([&] { return copy->stored().has_value(); }));
  EXPECT_TRUE(copy->problem().ok());
}

TEST(DurableCopyTest, AMapThatNoChangesLeadToTakesThePlaceOfTheOther) {
  const TemporaryFolder folder;
  Life life(1);
  life.GoOn();
  life.GoOn();
  const auto copy = Open(folder);
  copy->Write(life.newest());
  ASSERT_TRUE(copy->Flush().ok());

  KnownRevision back = Life(2).newest();  // with a smaller number
  copy->Write(back);
  ASSERT_TRUE(copy->Flush().ok());
  ExpectStored(*copy, back);

  back.time += absl::Seconds(1);  // with the same number
  copy->Write(back);
  ASSERT_TRUE(copy->Flush().ok());
  ExpectStored(*copy, back);

  Life another(3);  // with a larger number, but of another map, which has no frames
  another.GoOn();
  auto bare = std::make_shared<Snapshot>(*another.newest().snapshot);
  bare->frames = FrameTree();
  const KnownRevision anew{bare, TimeOf(9), kCreatedAt + absl::Seconds(1)};
  copy->Write(anew);
  ASSERT_TRUE(copy->Flush().ok());
  ExpectStored(*copy, anew);
}

TEST(DurableCopyTest, AnotherIncarnationTakesThePlaceOfTheOther) {
  const TemporaryFolder folder;
  KnownRevision known = Life(1).newest();
  known.incarnation = 7;
  {
    const auto copy = Open(folder);
    copy->Write(known);
    ASSERT_TRUE(copy->Flush().ok());
  }
  const auto copy = Open(folder);
  ExpectStored(*copy, known);
  EXPECT_EQ(copy->stored()->incarnation, 7u);
  known.incarnation = 8;  // a copy of the map, with the same revision made at the same time
  copy->Write(known);
  ASSERT_TRUE(copy->Flush().ok());
  EXPECT_EQ(copy->stored()->incarnation, 8u);
}

TEST(DurableCopyTest, ANumberAloneIsWrittenAtTheEndOnly) {
  const TemporaryFolder folder;
  KnownRevision known = Life(1).newest();
  KnownRevision later = known;
  auto same = std::make_shared<Snapshot>(*known.snapshot);
  same->revision = 7;
  later.snapshot = same;
  {
    const auto copy = Open(folder, absl::Milliseconds(1));
    copy->Write(known);
    ASSERT_TRUE(copy->Flush().ok());
    copy->Write(later);
  }
  EXPECT_EQ(Open(folder)->stored()->snapshot->revision, 7);
}

TEST(DurableCopyTest, WhatTheMapWasIsNotKept) {
  const TemporaryFolder folder;
  Life life(1);
  {
    const auto copy = Open(folder);
    for (int i = 0; i < 5; ++i) {
      life.GoOn();
      copy->Write(life.newest());
      ASSERT_TRUE(copy->Flush().ok());
    }
  }
  const auto store = storage::OpenGeoPackageStore(folder.path());
  ASSERT_TRUE(store.ok()) << store.status();
  const auto map = (*store)->Open("site");
  ASSERT_TRUE(map.ok()) << map.status();
  const auto kept = (*(*map)->OpenHistory())->Kept();
  ASSERT_TRUE(kept.ok()) << kept.status();
  EXPECT_EQ(kept->oldest, life.newest().snapshot->revision);
}

// Writes revision after revision until it is killed, and reports when the first is on disk.
[[noreturn]] void WriteForEver(const std::string& folder, uint64_t seed, int told) {
  auto copy = DurableCopy::Open(folder, "site", "all", kNever);
  if (!copy.ok()) _exit(1);
  Life life(seed);
  while (true) {
    (*copy)->Write(life.newest());
    if (!(*copy)->Flush().ok()) _exit(2);
    const char done = 1;
    if (write(told, &done, 1) != 1) _exit(3);
    life.GoOn();
  }
}

TEST(DurableCopyTest, IsOneRevisionWholeWheneverItIsKilled) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  for (int round = 0; round < 8; ++round) {
    const TemporaryFolder folder;
    int pipe_ends[2];
    ASSERT_EQ(pipe(pipe_ends), 0);
    const pid_t child = fork();
    if (child == 0) {
      close(pipe_ends[0]);
      WriteForEver(folder.path(), seed, pipe_ends[1]);
    }
    close(pipe_ends[1]);
    const int wanted = hypermap::testing::UniformInt(rng, 1, 6);
    int written = 0;
    for (char done; read(pipe_ends[0], &done, 1) == 1;) {
      if (++written != wanted) continue;
      // Kills the writer at a random moment.
      usleep(hypermap::testing::UniformInt(rng, 0, 20'000));
      kill(child, SIGKILL);
    }
    close(pipe_ends[0]);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status)) << status;

    const auto copy = Open(folder);
    ASSERT_TRUE(copy->stored().has_value());
    const Revision stored = copy->stored()->snapshot->revision;
    EXPECT_GE(stored, written);
    Life life(seed);
    while (life.newest().snapshot->revision < stored) life.GoOn();
    ExpectStored(*copy, life.newest());
  }
}

}  // namespace
}  // namespace hypermap::client
