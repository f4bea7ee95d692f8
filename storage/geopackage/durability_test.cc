// Tests that acknowledged commits survive the death of the process.
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <system_error>

#include "gtest/gtest.h"
#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/geopackage/testing/map.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

// Every commit adds an object and a cell, so that the content follows from the revision.
EditBatch EditOf(Revision revision) {
  if (revision == 1) {
    return {{CreateLayer{SemanticSpec("s")},
             CreateLayer{GridSpec("g", LayerKind::kOccupancy, {}, 0.05)}}};
  }
  SemanticObject object;
  object.label = "chair";
  object.shape = Polygon::FromBox({{0, 0}, {1, 1}});
  const auto cell = static_cast<int32_t>(100 * revision);
  return {{PutObject{"s", object, ""}, WriteCells{"g", {0, 1, cell, cell + 1}, {0.5}}}};
}

// Writes commit after commit, and a byte to `acknowledged` after each, until it is killed.
[[noreturn]] void WriteForEver(const std::string& folder, int acknowledged) {
  auto store = OpenGeoPackageStore(folder);
  auto stored = store.ok() ? (*store)->Open("site") : store.status();
  if (!stored.ok()) _exit(1);
  SnapshotPtr snapshot = *(*stored)->Load();
  while (true) {
    const Commit commit = MakeCommit(*snapshot, EditOf(snapshot->revision + 1));
    if (!(*stored)->Write({commit}).ok()) _exit(2);
    snapshot = commit.applied.snapshot;
    const char done = 1;
    if (write(acknowledged, &done, 1) != 1) _exit(3);
  }
}

// Kills a writer after `wanted` acknowledged commits. Returns the number that it acknowledged
// before it died.
Revision KillWriter(const std::string& folder, int wanted) {
  int pipe_ends[2];
  EXPECT_EQ(pipe(pipe_ends), 0);
  const pid_t child = fork();
  if (child == 0) {
    close(pipe_ends[0]);
    WriteForEver(folder, pipe_ends[1]);
  }
  close(pipe_ends[1]);
  Revision acknowledged = 0;
  char done;
  while (read(pipe_ends[0], &done, 1) == 1) {
    if (++acknowledged == wanted) kill(child, SIGKILL);
  }
  close(pipe_ends[0]);
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFSIGNALED(status)) << "the writer ended by itself";
  return acknowledged;
}

TEST(DurabilityTest, AcknowledgedCommitsOutliveAKill) {
  const uint64_t seed = testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  testing::Rng rng(seed);
  const testing::TemporaryFolder folder;
  CreateMap(*OpenStore(folder.path()), "site");
  Revision acknowledged = 0;
  for (int round = 0; round < 5; ++round) {
    acknowledged += KillWriter(folder.path(), testing::UniformInt(rng, 1, 20));
    const auto store = OpenStore(folder.path());
    auto stored = store->Open("site");
    ASSERT_TRUE(stored.ok()) << stored.status();
    auto snapshot = (*stored)->Load();
    ASSERT_TRUE(snapshot.ok()) << snapshot.status();
    const Revision revision = (*snapshot)->revision;
    ASSERT_GE(revision, acknowledged);
    // One commit may have reached the disk before its acknowledgement could be given.
    ASSERT_LE(revision, acknowledged + 1);
    Snapshot expected;
    expected.map_name = "site";
    for (Revision r = 1; r <= revision; ++r) {
      expected = *MakeCommit(expected, EditOf(r)).applied.snapshot;
    }
    ExpectSame(**snapshot, expected);
    acknowledged = revision;
  }
}

constexpr int kManyObjects = 6000;

EditBatch FirstLoad() {
  EditBatch batch;
  for (int i = 0; i < kManyObjects; ++i) {
    SemanticObject object;
    object.label = "chair";
    const Point corner{i % 80 * 2.0, i / 80 * 2.0};
    object.shape = Polygon::FromBox({corner, {corner.x + 1, corner.y + 1}});
    batch.edits.push_back(PutObject{"s", object, ""});
  }
  return batch;
}

// Loads many objects into the empty layer in a process that is killed when the log has grown by
// `log_bytes`, unless it ends before.
void KillFirstLoad(const std::string& folder, uintmax_t log_bytes) {
  const std::string log = folder + "/site.gpkg-wal";
  const pid_t child = fork();
  if (child == 0) {
    auto store = OpenGeoPackageStore(folder);
    auto stored = store.ok() ? (*store)->Open("site") : store.status();
    if (!stored.ok()) _exit(1);
    const Commit commit = MakeCommit(**(*stored)->Load(), FirstLoad());
    _exit((*stored)->Write({commit}).ok() ? 0 : 2);
  }
  int status = 0;
  std::error_code no_log;
  while (waitpid(child, &status, WNOHANG) == 0) {
    const uintmax_t size = std::filesystem::file_size(log, no_log);
    if (!no_log && size >= log_bytes) {
      kill(child, SIGKILL);
      ASSERT_EQ(waitpid(child, &status, 0), child);
      break;
    }
  }
  EXPECT_TRUE(WIFSIGNALED(status) || WEXITSTATUS(status) == 0);
}

TEST(DurabilityTest, FirstLoadThatIsKilledIsThereWholeOrNotAtAll) {
  const uint64_t seed = testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  testing::Rng rng(seed);
  for (int round = 0; round < 6; ++round) {
    const testing::TemporaryFolder folder;
    SnapshotPtr before;
    {
      const auto store = OpenStore(folder.path());
      EditedMap map = CreateMap(*store, "site");
      map.Edit({{CreateLayer{SemanticSpec("s")}}});
      before = map.snapshot;
    }
    KillFirstLoad(folder.path(), testing::UniformInt(rng, 1, 3'000'000));
    const auto store = OpenStore(folder.path());
    auto stored = store->Open("site");
    ASSERT_TRUE(stored.ok()) << stored.status();
    auto snapshot = (*stored)->Load();
    ASSERT_TRUE(snapshot.ok()) << snapshot.status();
    if ((*snapshot)->revision > 1) {
      ExpectSame(**snapshot, *MakeCommit(*before, FirstLoad()).applied.snapshot);
    } else {
      ExpectSame(**snapshot, *before);
    }
    const auto other = Connect(folder / "site.gpkg");
    EXPECT_EQ(**other->QueryInt64("SELECT rtreecheck('rtree_s_geom') = 'ok'"), 1);
    EXPECT_EQ(**other->QueryInt64("SELECT count(*) FROM rtree_s_geom"),
              (*snapshot)->revision > 1 ? kManyObjects : 0);
  }
}

}  // namespace
}  // namespace hypermap::storage
