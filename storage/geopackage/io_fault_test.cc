// Tests that a map outlives calls to the file system that fail: reads, writes, syncs and others,
// once or until the disk is mended. An error is a Status, nothing acknowledged is lost, nothing is
// there by half, and another map of the store goes on meanwhile.
#include <fcntl.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <ostream>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/geopackage/testing/faulty_files.h"
#include "storage/geopackage/testing/map.h"
#include "storage/geopackage/testing/map_life.h"
#include "storage/sqlite/durable_file.h"

namespace hypermap::storage {
namespace {

using ::testing::AnyOf;
using ::testing::Conditional;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr char kLockOfSite[] = ".site.gpkg.lock";
constexpr int kUntilMended = 1 << 30;

bool IsOfSite(absl::string_view name) { return absl::StrContains(name, "site.gpkg"); }
bool IsFileOfSite(absl::string_view name) { return name == "site.gpkg"; }

// Two maps of a store. The files of one of them, called site, fail.
class FaultyStore {
 public:
  FaultyStore(uint64_t seed, MapLife* life)
      : rng_(seed), life_(*life), files_(folder_.path(), kLockOfSite) {
    options_.busy_timeout = absl::ZeroDuration();
    if (testing::UniformInt(rng_, 0, 1) == 0) options_.max_checked_bytes = 0;
    store_ = OpenStore(folder_.path(), options_);
    other_ = CreateMap(*store_, "other");
    other_.Edit({{CreateLayer{SemanticSpec("s")}}});
  }
  ~FaultyStore() { life_.CloseReader(); }

  FaultyFiles& files() { return files_; }

  // From the creation of the map to its closing. Each step is tried again until it succeeds, or
  // until the disk is mended and it must succeed.
  void Live() {
    Until([&] { return Create(); });
    for (const MapLife::Step& step : life_.steps()) {
      most_ = step.after;
      Until([&] {
        if (step.kind == MapLife::Step::Kind::kReopen) return Reopen();
        return life_.Do(step, least_, *map_);
      });
      least_ = step.after;
      if (map_ == nullptr || ::testing::Test::HasFailure()) return;
    }
  }

  // The process dies, or power is lost, before a step that was begun: everything acknowledged is
  // in the files.
  void ExpectNothingIsLostByCrash() {
    const bool loses_power = testing::UniformInt(rng_, 0, 1) == 0;
    SCOPED_TRACE(loses_power ? "power loss" : "kill");
    const testing::TemporaryFolder crashed;
    if (loses_power) {
      SimulatedDisk disk(rng_());
      for (const FileEvent& event : files_.events()) disk.Apply(event);
      for (const auto& [name, bytes] : disk.LosePower()) WriteFile(crashed / name, bytes);
    } else {
      for (const char* name : {"site.gpkg", "site.gpkg-wal"}) {
        WriteFile(crashed / name, ReadFile(folder_ / name));
      }
    }
    WriteFile(crashed / kLockOfSite, ReadFile(folder_ / kLockOfSite));
    const auto store = OpenStore(crashed.path());
    auto opened = store->Open("site");
    ASSERT_TRUE(opened.ok()) << opened.status();
    ExpectSameHistory(**opened);
    life_.ExpectWhole(rng_, **opened, least_, most_);
  }

  void ExpectNothingIsLostByRestart() {
    life_.CloseReader();
    map_ = nullptr;
    store_ = nullptr;
    store_ = OpenStore(folder_.path());
    auto opened = store_->Open("site");
    ASSERT_TRUE(opened.ok()) << opened.status();
    ExpectSameHistory(**opened);
    const LifeProgress found = life_.ExpectWhole(rng_, **opened, least_, most_);
    life_.ExpectGoesOn(**opened, found);
  }

  int num_errors() const { return num_errors_; }

 private:
  template <typename Attempt>
  void Until(Attempt attempt) {
    constexpr int kTries = 3;
    for (int i = 0; i < kTries; ++i) {
      const absl::Status status = attempt();
      ExpectOtherGoesOn();
      if (status.ok()) return;
      ++num_errors_;
      const bool may_pass = absl::IsUnavailable(status) || absl::IsResourceExhausted(status) ||
                            absl::IsFailedPrecondition(status);
      EXPECT_TRUE(may_pass) << status;
      if (i == kTries - 2) files_.Disarm();
    }
    ADD_FAILURE() << "fails for ever";
  }

  absl::Status Create() {
    auto created = store_->Create(HeaderOf("site"));
    EXPECT_THAT(store_->List().value(),
                Conditional(created.ok(), Contains("site"), Not(Contains("site"))));
    if (!created.ok()) return created.status();
    map_ = *std::move(created);
    incarnation_ = map_->header().incarnation;
    return absl::OkStatus();
  }

  absl::Status Reopen() {
    map_ = nullptr;
    auto opened = store_->Open("site");
    if (!opened.ok()) return opened.status();
    map_ = *std::move(opened);
    ExpectSameHistory(*map_);
    return absl::OkStatus();
  }

  // No error makes the store take the file for another one.
  void ExpectSameHistory(const StoredMap& map) const {
    EXPECT_THAT(map.opening_notes(), IsEmpty());
    EXPECT_EQ(map.header().incarnation, incarnation_);
  }

  void ExpectOtherGoesOn() { other_.Edit({{PutObject{"s", UnitSquare("chair"), ""}}}); }

  testing::Rng rng_;
  const testing::TemporaryFolder folder_;
  MapLife& life_;
  FaultyFiles files_;
  GeoPackageOptions options_;
  std::unique_ptr<MapStore> store_;
  EditedMap other_;
  std::unique_ptr<StoredMap> map_;
  LifeProgress least_;
  LifeProgress most_;
  uint64_t incarnation_ = 0;
  int num_errors_ = 0;
};

// Numbers from 1 to `last`, or some of them if those are many.
std::set<int> ChooseCalls(testing::Rng& rng, int last, int max_calls) {
  std::set<int> calls;
  for (int i = 1; i <= std::min(last, max_calls); ++i) {
    calls.insert(last <= max_calls ? i : testing::UniformInt(rng, 1, last));
  }
  return calls;
}

void ExpectNothingIsLostByFaults(FileFault fault, int num_commits, int max_calls,
                                 bool (*files)(absl::string_view)) {
  const uint64_t seed = testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  testing::Rng rng(seed);
  MapLife life(rng, "site", num_commits);
  int num_calls = 0;
  {
    FaultyStore store(seed, &life);
    store.files().Count(files);
    store.Live();
    num_calls = store.files().num_calls(fault.call);
  }
  ASSERT_GT(num_calls, 0);
  for (const int call : ChooseCalls(rng, num_calls, max_calls)) {
    fault.first = call;
    fault.count = testing::UniformInt(rng, 0, 2) > 0 ? 1 : kUntilMended;
    SCOPED_TRACE(::testing::Message() << "call " << call << " of " << num_calls
                                      << (fault.count > 1 ? " and later ones fail" : " fails"));
    FaultyStore store(seed, &life);
    store.files().Arm(files, fault);
    store.Live();
    store.files().Disarm();
    EXPECT_GT(store.files().num_failed(), 0);
    store.ExpectNothingIsLostByCrash();
    store.ExpectNothingIsLostByRestart();
    if (::testing::Test::HasFailure()) return;
  }
}

struct NamedFault {
  const char* name;
  FileFault fault;
};

void PrintTo(const NamedFault& fault, std::ostream* out) { *out << fault.name; }

class IoFaultTest : public ::testing::TestWithParam<NamedFault> {};

TEST_P(IoFaultTest, NothingAcknowledgedIsLostAndOtherMapsGoOn) {
  ExpectNothingIsLostByFaults(GetParam().fault, 14, 8, IsOfSite);
}

INSTANTIATE_TEST_SUITE_P(
    Calls, IoFaultTest,
    ::testing::Values(NamedFault{"Open", {FileCall::kOpen, SQLITE_CANTOPEN}},
                      NamedFault{"Read", {FileCall::kRead, SQLITE_IOERR_READ}},
                      // SQLite's answer to EIO, which it takes for damage.
                      NamedFault{"ReadWithEio", {FileCall::kRead, SQLITE_IOERR_CORRUPTFS}},
                      NamedFault{"Write", {FileCall::kWrite, SQLITE_IOERR_WRITE}},
                      NamedFault{"WriteToFullDisk", {FileCall::kWrite, SQLITE_FULL}},
                      NamedFault{"ShortWrite", {FileCall::kWrite, SQLITE_FULL, 1, 1, true}},
                      NamedFault{"Truncate", {FileCall::kTruncate, SQLITE_IOERR_TRUNCATE}},
                      NamedFault{"Sync", {FileCall::kSync, SQLITE_IOERR_FSYNC}},
                      NamedFault{"Size", {FileCall::kSize, SQLITE_IOERR_FSTAT}},
                      NamedFault{"Delete", {FileCall::kDelete, SQLITE_IOERR_DELETE}},
                      NamedFault{"Access", {FileCall::kAccess, SQLITE_IOERR_ACCESS}},
                      NamedFault{"Lock", {FileCall::kLock, SQLITE_IOERR_LOCK}},
                      NamedFault{"LogIndex", {FileCall::kShm, SQLITE_IOERR_SHMLOCK}}),
    [](const auto& info) { return std::string(info.param.name); });

// The file itself is written by checkpoints, of which a long life has some.
class CheckpointFaultTest : public ::testing::TestWithParam<NamedFault> {};

TEST_P(CheckpointFaultTest, NothingAcknowledgedIsLost) {
  ExpectNothingIsLostByFaults(GetParam().fault, 50, 3, IsFileOfSite);
}

INSTANTIATE_TEST_SUITE_P(
    Calls, CheckpointFaultTest,
    ::testing::Values(NamedFault{"Write", {FileCall::kWrite, SQLITE_IOERR_WRITE}},
                      NamedFault{"ShortWrite", {FileCall::kWrite, SQLITE_FULL, 1, 1, true}},
                      NamedFault{"Truncate", {FileCall::kTruncate, SQLITE_IOERR_TRUNCATE}},
                      NamedFault{"Sync", {FileCall::kSync, SQLITE_IOERR_FSYNC}}),
    [](const auto& info) { return std::string(info.param.name); });

// SQLite takes a log for whole that a sync has failed to write to the disk, and recovers it when
// the map is opened again.
TEST(FailedSyncTest, CommitsBehindARecoveredLogAreDurable) {
  int num_recovered = 0;
  FileFault fault{FileCall::kSync, SQLITE_IOERR_FSYNC};
  fault.count = kUntilMended;
  for (fault.first = 1; !::testing::Test::HasFailure(); ++fault.first) {
    SCOPED_TRACE(::testing::Message() << "sync " << fault.first << " and later ones fail");
    const testing::TemporaryFolder folder;
    FaultyFiles files(folder.path());
    const auto store = OpenStore(folder.path());
    EditedMap map = CreateMap(*store, "site");
    map.Edit({{CreateLayer{SemanticSpec("s")}}});
    files.Arm(IsOfSite, fault);
    map.stored = nullptr;
    if (store->Open("site").ok()) break;
    ++num_recovered;
    files.Disarm();
    auto opened = store->Open("site");
    ASSERT_TRUE(opened.ok()) << opened.status();
    map.stored = *std::move(opened);
    map.Edit({{PutObject{"s", UnitSquare("chair"), ""}}});
    for (uint64_t seed = 0; seed < 20; ++seed) {
      SCOPED_TRACE(::testing::Message() << "power loss " << seed);
      SimulatedDisk disk(seed);
      for (const FileEvent& event : files.events()) disk.Apply(event);
      const testing::TemporaryFolder rebooted;
      for (const auto& [name, bytes] : disk.LosePower()) WriteFile(rebooted / name, bytes);
      const auto survivor = OpenStore(rebooted.path())->Open("site");
      ASSERT_TRUE(survivor.ok()) << survivor.status();
      ExpectSame(**(*survivor)->Load(), *map.snapshot);
    }
  }
  EXPECT_GT(num_recovered, 1);
}

// The record of a deletion is in a file of its own.
class DeletionFaultTest : public ::testing::TestWithParam<NamedFault> {};

// Deletes a map while each of the calls fails in turn, and then checks the store.
template <typename Check>
void DeleteWithFaults(FileFault fault, Check check) {
  bool has_failed = true;
  for (fault.first = 1; has_failed && !::testing::Test::HasFailure(); ++fault.first) {
    SCOPED_TRACE(::testing::Message() << "call " << fault.first << " fails");
    const testing::TemporaryFolder folder;
    FaultyFiles files(folder.path());
    auto store = OpenStore(folder.path());
    CreateMap(*store, "site");
    files.Arm([](absl::string_view name) { return absl::StartsWith(name, "catalog.sqlite"); },
              fault);
    const absl::Status status = store->Delete("site", "request");
    files.Disarm();
    has_failed = files.num_failed() > 0;
    check(folder.path(), std::move(store), status);
  }
  EXPECT_GT(fault.first, 2);
}

TEST_P(DeletionFaultTest, AcknowledgedDeletionIsRecorded) {
  DeleteWithFaults(GetParam().fault, [](const std::string& folder, std::unique_ptr<MapStore> store,
                                        absl::Status status) {
    // The caller tries again.
    if (!status.ok()) status = store->Delete("site", "request");
    EXPECT_TRUE(status.ok()) << status;
    for (const bool restart : {false, true}) {
      if (restart) {
        store = nullptr;
        store = OpenStore(folder);
      }
      EXPECT_EQ(store->FindDeletion("request").value(), "site");
      EXPECT_THAT(store->List().value(), IsEmpty());
      EXPECT_TRUE(store->Delete("site", "request").ok());
    }
  });
}

TEST_P(DeletionFaultTest, MapThatIsMadeAfterwardsIsKept) {
  DeleteWithFaults(GetParam().fault, [](const std::string& folder, std::unique_ptr<MapStore> store,
                                        const absl::Status& status) {
    EditedMap map;
    if (store->List().value().empty()) {
      map = CreateMap(*store, "site");
    } else {
      // Nothing was deleted, and the caller was told so.
      EXPECT_FALSE(status.ok());
      auto opened = store->Open("site");
      ASSERT_TRUE(opened.ok()) << opened.status();
      map.stored = *std::move(opened);
      map.snapshot = *map.stored->Load();
    }
    map.Edit({{CreateLayer{SemanticSpec("s")}}});
    map.stored = nullptr;
    store = nullptr;
    store = OpenStore(folder);
    const auto again = store->Open("site");
    ASSERT_TRUE(again.ok()) << again.status();
    ExpectSame(**(*again)->Load(), *map.snapshot);
  });
}

INSTANTIATE_TEST_SUITE_P(
    Calls, DeletionFaultTest,
    ::testing::Values(NamedFault{"Open", {FileCall::kOpen, SQLITE_CANTOPEN}},
                      NamedFault{"Write", {FileCall::kWrite, SQLITE_IOERR_WRITE}},
                      NamedFault{"ShortWrite", {FileCall::kWrite, SQLITE_FULL, 1, 1, true}},
                      NamedFault{"Sync", {FileCall::kSync, SQLITE_IOERR_FSYNC}},
                      NamedFault{"Size", {FileCall::kSize, SQLITE_IOERR_FSTAT}},
                      NamedFault{"Delete", {FileCall::kDelete, SQLITE_IOERR_DELETE}},
                      NamedFault{"Access", {FileCall::kAccess, SQLITE_IOERR_ACCESS}},
                      NamedFault{"Lock", {FileCall::kLock, SQLITE_IOERR_LOCK}}),
    [](const auto& info) { return std::string(info.param.name); });

// Names of files of the map in the folder.
std::vector<std::string> FilesOfSite(const std::string& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename();
    if (absl::StrContains(name, "site")) names.push_back(name);
  }
  return names;
}

void ExpectSiteCanBeMade(const std::string& folder, std::unique_ptr<MapStore> store) {
  EditedMap map = CreateMap(*store, "site");
  map.Edit({{CreateLayer{SemanticSpec("s")}}});
  map.stored = nullptr;
  store = nullptr;
  store = OpenStore(folder);
  const auto again = store->Open("site");
  ASSERT_TRUE(again.ok()) << again.status();
  ExpectSame(**(*again)->Load(), *map.snapshot);
}

// The creation of a map fails at each of its calls.
class CreationFaultTest : public ::testing::TestWithParam<NamedFault> {};

TEST_P(CreationFaultTest, MapIsMadeOrNothingIsLeft) {
  FileFault fault = GetParam().fault;
  bool has_failed = true;
  for (fault.first = 1; has_failed && !HasFailure(); ++fault.first) {
    for (const int count : {1, kUntilMended}) {
      fault.count = count;
      SCOPED_TRACE(::testing::Message()
                   << "call " << fault.first << (count > 1 ? " and later ones fail" : " fails"));
      const testing::TemporaryFolder folder;
      FaultyFiles files(folder.path());
      auto store = OpenStore(folder.path());
      files.Arm(IsOfSite, fault);
      auto created = store->Create(HeaderOf("site"));
      has_failed = files.num_failed() > 0;
      files.Disarm();
      if (created.ok()) {
        EXPECT_THAT(store->List().value(), ElementsAre("site"));
        *created = nullptr;
        EXPECT_TRUE(store->Open("site").ok());
      } else {
        EXPECT_THAT(FilesOfSite(folder.path()), IsEmpty()) << created.status();
        ExpectSiteCanBeMade(folder.path(), std::move(store));
      }
    }
  }
  EXPECT_GT(fault.first, 2);
}

INSTANTIATE_TEST_SUITE_P(
    Calls, CreationFaultTest,
    ::testing::Values(NamedFault{"Open", {FileCall::kOpen, SQLITE_CANTOPEN}},
                      NamedFault{"Read", {FileCall::kRead, SQLITE_IOERR_READ}},
                      NamedFault{"Write", {FileCall::kWrite, SQLITE_IOERR_WRITE}},
                      NamedFault{"WriteToFullDisk", {FileCall::kWrite, SQLITE_FULL}},
                      NamedFault{"Sync", {FileCall::kSync, SQLITE_IOERR_FSYNC}},
                      NamedFault{"Size", {FileCall::kSize, SQLITE_IOERR_FSTAT}},
                      NamedFault{"Access", {FileCall::kAccess, SQLITE_IOERR_ACCESS}},
                      NamedFault{"Lock", {FileCall::kLock, SQLITE_IOERR_LOCK}},
                      NamedFault{"LogIndex", {FileCall::kShm, SQLITE_IOERR_SHMOPEN}}),
    [](const auto& info) { return std::string(info.param.name); });

// A map of an older version is opened, and each call fails in turn.
class MigrationFaultTest : public ::testing::TestWithParam<NamedFault> {};

void MakeOldMap(const std::string& path) {
  const absl::Status made =
      Connect(path)->Execute(ReadFile(absl::StrCat(GEOPACKAGE_TESTDATA, "/map_v7.sql")));
  ASSERT_TRUE(made.ok()) << made;
}

TEST_P(MigrationFaultTest, MapIsMigratedOrAsItWas) {
  const testing::TemporaryFolder intact;
  MakeOldMap(intact / "site.gpkg");
  const std::string old_map = ReadFile(intact / "site.gpkg");
  const auto intact_store = OpenStore(intact.path());
  const SnapshotPtr expected = *(*intact_store->Open("site"))->Load();
  FileFault fault = GetParam().fault;
  bool has_failed = true;
  for (fault.first = 1; has_failed && !HasFailure(); ++fault.first) {
    for (const int count : {1, kUntilMended}) {
      fault.count = count;
      SCOPED_TRACE(::testing::Message()
                   << "call " << fault.first << (count > 1 ? " and later ones fail" : " fails"));
      const testing::TemporaryFolder folder;
      WriteFile(folder / "site.gpkg", old_map);
      FaultyFiles files(folder.path());
      const auto store = OpenStore(folder.path());
      files.Arm(IsOfSite, fault);
      {
        auto opened = store->Open("site");
        if (opened.ok()) {
          const auto loaded = (*opened)->Load();
          if (loaded.ok()) ExpectSame(**loaded, *expected);
        } else {
          EXPECT_THAT(opened.status().code(),
                      AnyOf(absl::StatusCode::kUnavailable, absl::StatusCode::kResourceExhausted,
                            absl::StatusCode::kFailedPrecondition))
              << opened.status();
        }
      }
      has_failed = files.num_failed() > 0;
      files.Disarm();
      auto again = store->Open("site");
      ASSERT_TRUE(again.ok()) << again.status();
      const auto loaded = (*again)->Load();
      ASSERT_TRUE(loaded.ok()) << loaded.status();
      ExpectSame(**loaded, *expected);
      EXPECT_TRUE(PathExists(folder / "site.gpkg.schema-7"));
      EXPECT_FALSE(PathExists(folder / "site.gpkg.new"));
    }
  }
  EXPECT_GT(fault.first, 2);
}

INSTANTIATE_TEST_SUITE_P(
    Calls, MigrationFaultTest,
    ::testing::Values(NamedFault{"Open", {FileCall::kOpen, SQLITE_CANTOPEN}},
                      NamedFault{"Read", {FileCall::kRead, SQLITE_IOERR_READ}},
                      NamedFault{"Write", {FileCall::kWrite, SQLITE_IOERR_WRITE}},
                      NamedFault{"ShortWrite", {FileCall::kWrite, SQLITE_FULL, 1, 1, true}},
                      NamedFault{"Sync", {FileCall::kSync, SQLITE_IOERR_FSYNC}},
                      NamedFault{"Size", {FileCall::kSize, SQLITE_IOERR_FSTAT}},
                      NamedFault{"Delete", {FileCall::kDelete, SQLITE_IOERR_DELETE}},
                      NamedFault{"Lock", {FileCall::kLock, SQLITE_IOERR_LOCK}}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(FullDiskTest, MapIsOpenedAndRead) {
  const testing::TemporaryFolder folder;
  SnapshotPtr expected;
  {
    const auto store = OpenStore(folder.path());
    EditedMap map = CreateMap(*store, "site");
    map.Edit({{CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("chair"), ""}}});
    expected = map.snapshot;
  }
  FaultyFiles files(folder.path());
  const auto store = OpenStore(folder.path());
  files.Arm(IsOfSite, {FileCall::kWrite, SQLITE_FULL, 1, kUntilMended});
  auto map = store->Open("site");
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_GT(files.num_failed(), 0);
  ExpectSame(**(*map)->Load(), *expected);
  const Commit commit = MakeCommit(*expected, {{PutObject{"s", UnitSquare("table"), ""}}});
  EXPECT_TRUE(absl::IsResourceExhausted((*map)->Write({commit})));
  files.Disarm();
  EXPECT_TRUE((*map)->Write({commit}).ok());
}

// While it lives, the process can open at most `more` files.
class FewFiles {
 public:
  explicit FewFiles(int more) {
    EXPECT_EQ(getrlimit(RLIMIT_NOFILE, &before_), 0);
    const int next = open("/dev/null", O_RDONLY | O_CLOEXEC);
    close(next);
    rlimit few = before_;
    few.rlim_cur = next + more;
    EXPECT_EQ(setrlimit(RLIMIT_NOFILE, &few), 0);
  }
  ~FewFiles() { setrlimit(RLIMIT_NOFILE, &before_); }
  FewFiles(const FewFiles&) = delete;
  FewFiles& operator=(const FewFiles&) = delete;

 private:
  rlimit before_{};
};

TEST(FewFilesTest, MapThatFindsNoMoreOpenFilesIsMadeOrNothingIsLeft) {
  int more = 0;
  for (bool was_created = false; !was_created && !HasFailure(); ++more) {
    SCOPED_TRACE(more);
    const testing::TemporaryFolder folder;
    auto store = OpenStore(folder.path());
    {
      const FewFiles few(more);
      const auto created = store->Create(HeaderOf("site"));
      was_created = created.ok();
      if (!was_created) {
        EXPECT_EQ(created.status().code(), absl::StatusCode::kResourceExhausted)
            << created.status();
      }
    }
    if (was_created) {
      EXPECT_THAT(FilesOfSite(folder.path()), Contains("site.gpkg"));
    } else {
      EXPECT_THAT(FilesOfSite(folder.path()), IsEmpty());
      ExpectSiteCanBeMade(folder.path(), std::move(store));
    }
  }
  EXPECT_GT(more, 4);
}

// Makes folders fail to open in this process, for ever, so that their names can't be synced.
// Returns false if the system does not allow that.
bool BreakFolders() {
  constexpr auto kCall = static_cast<uint32_t>(offsetof(seccomp_data, nr));
  constexpr auto kFlags = static_cast<uint32_t>(offsetof(seccomp_data, args[2]));
  sock_filter filter[] = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kCall),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_openat, 0, 3),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kFlags),
      BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, O_DIRECTORY, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EIO),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
  };
  const sock_fprog program{sizeof(filter) / sizeof(filter[0]), filter};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

TEST(PublishFileTest, NameThatCannotBeSyncedIsTakenBack) {
  const testing::TemporaryFolder folder;
  WriteFile(folder / "new", "content");
  enum Result { kRight, kWrong, kNoSuchFault };
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    if (!BreakFolders()) _exit(kNoSuchFault);
    const absl::Status status = PublishFile(folder / "new", folder / "final");
    _exit(absl::IsUnavailable(status) ? kRight : kWrong);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == kNoSuchFault) GTEST_SKIP() << "system calls can't be made to fail";
  EXPECT_EQ(WEXITSTATUS(status), kRight);
  EXPECT_FALSE(PathExists(folder / "final"));
  EXPECT_EQ(ReadFile(folder / "new"), "content");
}

}  // namespace
}  // namespace hypermap::storage
