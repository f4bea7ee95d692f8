#include "client_libs/cpp/replica/durable_copy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "map/edits/apply.h"
#include "map/edits/difference.h"
#include "storage/geopackage/geopackage_store.h"
#include "storage/sqlite/sqlite.h"
#include "tests/support/eventually.h"
#include "tests/support/random_map.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::client {
namespace {

using ::hypermap::testing::Rng;
using ::hypermap::testing::TemporaryFolder;
using ::testing::HasSubstr;
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
  void GoOn() { Edit(hypermap::testing::RandomEdits(rng_, *newest_)); }
  void Edit(const EditBatch& edits) {
    const auto applied = Apply(*newest_, edits);
    ASSERT_TRUE(applied.ok()) << applied.status();
    newest_ = applied->snapshot;
  }

 private:
  Rng rng_;
  SnapshotPtr newest_;
};

// The files of a replica that was killed after it had written the new file and removed the old one.
void InterruptReplacement(const TemporaryFolder& folder) {
  std::filesystem::rename(folder / "site.gpkg", folder / "next.gpkg");
  std::filesystem::rename(folder / ".site.gpkg.lock", folder / ".next.gpkg.lock");
}

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

// The oldest revision of which the file has the history.
Revision OldestKept(const TemporaryFolder& folder) {
  const auto store = storage::OpenGeoPackageStore(folder.path());
  EXPECT_TRUE(store.ok()) << store.status();
  const auto map = (*store)->Open("site");
  EXPECT_TRUE(map.ok()) << map.status();
  const auto kept = (*(*map)->OpenHistory())->Kept();
  EXPECT_TRUE(kept.ok()) << kept.status();
  return kept->oldest;
}

// While it lives, the history of the file can't be deleted, but revisions can be written.
class UndeletableHistory {
 public:
  explicit UndeletableHistory(const TemporaryFolder& folder) : path_(folder / "site.gpkg") {
    Execute(
        "CREATE TRIGGER keep_history BEFORE UPDATE OF oldest_revision ON hypermap_metadata "
        "BEGIN SELECT RAISE(ABORT, 'history is kept'); END");
  }
  ~UndeletableHistory() { Execute("DROP TRIGGER keep_history"); }
  UndeletableHistory(const UndeletableHistory&) = delete;
  UndeletableHistory& operator=(const UndeletableHistory&) = delete;

 private:
  void Execute(const std::string& sql) const {
    const auto file = storage::Database::Open(path_, storage::Database::OpenMode::kExisting,
                                              absl::ZeroDuration());
    ASSERT_TRUE(file.ok()) << file.status();
    // A checkpoint by this connection would look like a change of the file.
    EXPECT_EQ((*file)->Execute("PRAGMA wal_autocheckpoint = 0; " + sql), absl::OkStatus());
  }

  const std::string path_;
};

EditBatch PutChair() {
  SemanticObject chair;
  chair.label = "chair";
  chair.shape = Polygon::FromBox({{0.0, 0.0}, {1.0, 1.0}});
  return {{PutObject{"semantic", chair, ""}}};
}

TEST(DurableCopyTest, InterruptedReplacementIsCompleted) {
  const TemporaryFolder folder;
  Life life(7);
  KnownRevision written = life.newest();
  written.incarnation = 5;
  {
    const auto copy = Open(folder);
    copy->Write(written);
    ASSERT_TRUE(copy->Flush().ok());
  }
  InterruptReplacement(folder);
  for (int i = 0; i < 2; ++i) {
    const auto stored = Open(folder)->stored();
    ASSERT_TRUE(stored.has_value());
    EXPECT_EQ(stored->incarnation, 5);
    EXPECT_EQ(stored->time, written.time);
    EXPECT_EQ(stored->snapshot->map_name, "site");
    EXPECT_TRUE(Difference(*stored->snapshot, *written.snapshot).empty());
    EXPECT_FALSE(std::filesystem::exists(folder / "next.gpkg"));
  }
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
  EXPECT_EQ(OldestKept(folder), life.newest().snapshot->revision);
}

TEST(DurableCopyTest, TheFileFollowsTheMapAlsoWhenHistoryCanNotBeDeleted) {
  const TemporaryFolder folder;
  Life life(1);
  {
    const auto copy = Open(folder);
    copy->Write(life.newest());
    ASSERT_EQ(copy->Flush(), absl::OkStatus());
    const ObjectId chair = life.newest().snapshot->next_object_id;
    {
      const UndeletableHistory undeletable(folder);
      life.Edit(PutChair());
      copy->Write(life.newest());
      EXPECT_EQ(copy->Flush(), absl::OkStatus());
      EXPECT_THAT(std::string(copy->problem().message()), HasSubstr("history is kept"));
      ExpectStored(*copy, life.newest());
    }
    life.Edit({{DeleteObject{"semantic", chair}}});
    copy->Write(life.newest());
    ASSERT_EQ(copy->Flush(), absl::OkStatus());
    EXPECT_EQ(copy->problem(), absl::OkStatus());
  }
  ExpectStored(*Open(folder), life.newest());
}

TEST(DurableCopyTest, HistoryThatCouldNotBeDeletedIsDeletedLater) {
  const TemporaryFolder folder;
  Life life(1);
  {
    const auto copy = Open(folder);
    copy->Write(life.newest());
    ASSERT_EQ(copy->Flush(), absl::OkStatus());
    life.Edit(PutChair());
    copy->Write(life.newest());
    {
      const UndeletableHistory undeletable(folder);
      ASSERT_EQ(copy->Flush(), absl::OkStatus());
      EXPECT_FALSE(copy->problem().ok());
    }
    ASSERT_EQ(copy->Flush(), absl::OkStatus());
    EXPECT_EQ(copy->problem(), absl::OkStatus());
  }
  EXPECT_EQ(OldestKept(folder), life.newest().snapshot->revision);
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
