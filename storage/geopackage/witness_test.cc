// Tests that a map whose file is not the one that was written last becomes another incarnation, and
// that acknowledged commits are never missing without a word.
#include <sys/stat.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/geopackage/map_metadata.h"
#include "storage/geopackage/testing/map.h"
#include "storage/sqlite/revision_witness.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr char kFile[] = "site.gpkg";
constexpr char kLog[] = "site.gpkg-wal";
constexpr char kLock[] = ".site.gpkg.lock";

TEST(RevisionWitnessTest, C5IsReadAsItWasWritten) {
  for (const bool settled : {false, true}) {
    const RevisionWitness witness{0xfedcba9876543210, 12345678901, -3, settled};
    EXPECT_EQ(DecodeWitness(EncodeWitness(witness)), witness);
    EXPECT_EQ(DecodeWitness(EncodeWitness(witness) + "rest"), witness);
    EXPECT_LE(EncodeWitness(witness).size(), 128u);
  }
}

TEST(RevisionWitnessTest, C5DamagedOneIsNone) {
  const std::string bytes = EncodeWitness({7, 8, 9, true});
  for (size_t i = 0; i < bytes.size(); ++i) {
    EXPECT_EQ(DecodeWitness(bytes.substr(0, i)), std::nullopt) << i;
    for (int bit = 0; bit < 8; ++bit) {
      std::string damaged = bytes;
      damaged[i] = static_cast<char>(damaged[i] ^ (1 << bit));
      EXPECT_EQ(DecodeWitness(damaged), std::nullopt) << i << ", bit " << bit;
    }
  }
}

// The files of a map as the death of the process at that moment would leave them.
struct CrashedFiles {
  std::string file;
  std::string log;
  std::string lock;

  void WriteTo(const testing::TemporaryFolder& folder) const {
    WriteFile(folder / kFile, file);
    WriteFile(folder / kLog, log);
    WriteFile(folder / kLock, lock);
  }
};

class WitnessTest : public ::testing::Test {
 protected:
  void SetUp() override {
    store_ = OpenStore(folder_.path());
    map_ = CreateMap(*store_, "site");
    incarnation_ = map_.stored->header().incarnation;
    EXPECT_NE(incarnation_, 0u);
    map_.Edit({{CreateLayer{SemanticSpec("s")}}});
    for (int i = 0; i < 9; ++i) AddChair();
  }

  void AddChair() { map_.Edit({{PutObject{"s", UnitSquare("chair"), ""}}}); }

  CrashedFiles Crash() const {
    return {ReadFile(folder_ / kFile), ReadFile(folder_ / kLog), ReadFile(folder_ / kLock)};
  }

  // Opens the map again, and keeps it open.
  void Reopen() {
    map_.stored.reset();
    auto stored = store_->Open("site");
    ASSERT_TRUE(stored.ok()) << stored.status();
    map_.stored = *std::move(stored);
    map_.snapshot = *map_.stored->Load();
  }

  void ExpectAnotherIncarnation(const std::string& reason) {
    EXPECT_NE(map_.stored->header().incarnation, incarnation_);
    EXPECT_NE(map_.stored->header().incarnation, 0u);
    EXPECT_THAT(map_.stored->opening_notes(),
                ElementsAre(::testing::AllOf(HasSubstr("map site: "), HasSubstr(reason))));
    // It stays, also when the process dies now.
    const uint64_t incarnation = map_.stored->header().incarnation;
    AddChair();
    const testing::TemporaryFolder crashed;
    Crash().WriteTo(crashed);
    const auto after_crash = OpenStore(crashed.path())->Open("site");
    ASSERT_TRUE(after_crash.ok()) << after_crash.status();
    EXPECT_EQ((*after_crash)->header().incarnation, incarnation);
    Reopen();
    EXPECT_EQ(map_.stored->header().incarnation, incarnation);
    EXPECT_THAT(map_.stored->opening_notes(), IsEmpty());
  }

  // Opens the map of damaged files. Returns its revision, or -1 if it is refused.
  Revision OpenDamaged(const CrashedFiles& files) const {
    const testing::TemporaryFolder folder;
    files.WriteTo(folder);
    const auto store = OpenStore(folder.path());
    const auto stored = store->Open("site");
    const auto loaded = stored.ok() ? (*stored)->Load() : stored.status();
    if (!loaded.ok()) {
      EXPECT_EQ(loaded.status().code(), absl::StatusCode::kDataLoss) << loaded.status();
      return -1;
    }
    const Revision revision = (*loaded)->revision;
    if (revision == map_.snapshot->revision) {
      EXPECT_EQ((*stored)->header().incarnation, incarnation_);
      EXPECT_THAT((*stored)->opening_notes(), IsEmpty());
      ExpectSame(**loaded, *map_.snapshot);
    } else {
      EXPECT_LT(revision, map_.snapshot->revision);
      EXPECT_NE((*stored)->header().incarnation, incarnation_);
      EXPECT_THAT((*stored)->opening_notes(),
                  ElementsAre(HasSubstr("acknowledged commits are missing")));
    }
    return revision;
  }

  const testing::TemporaryFolder folder_;
  std::unique_ptr<MapStore> store_;
  EditedMap map_;
  uint64_t incarnation_ = 0;
};

TEST_F(WitnessTest, C5CleanRestartKeepsTheIncarnation) {
  for (int i = 0; i < 3; ++i) {
    Reopen();
    EXPECT_EQ(map_.stored->header().incarnation, incarnation_);
    EXPECT_THAT(map_.stored->opening_notes(), IsEmpty());
    AddChair();
  }
}

TEST_F(WitnessTest, C5LogCutAnywhereIsNeverSilent) {
  const CrashedFiles files = Crash();
  constexpr int kCuts = 200;
  int num_behind = 0;
  for (int i = 0; i <= kCuts; ++i) {
    SCOPED_TRACE(i);
    CrashedFiles cut = files;
    cut.log.resize(files.log.size() * i / kCuts);
    if (OpenDamaged(cut) < map_.snapshot->revision) ++num_behind;
  }
  EXPECT_EQ(num_behind, kCuts);
}

TEST_F(WitnessTest, C5BitFlippedInTheLogIsNeverSilent) {
  const uint64_t seed = testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  testing::Rng rng(seed);
  const CrashedFiles files = Crash();
  for (int i = 0; i < 20; ++i) {
    CrashedFiles flipped = files;
    const int at = testing::UniformInt(rng, 0, static_cast<int>(files.log.size()) - 1);
    SCOPED_TRACE(at);
    flipped.log[at] = static_cast<char>(flipped.log[at] ^ (1 << testing::UniformInt(rng, 0, 7)));
    OpenDamaged(flipped);
  }
}

TEST_F(WitnessTest, C5LogThatIsGoneIsNeverSilent) {
  const testing::TemporaryFolder crashed;
  Crash().WriteTo(crashed);
  std::filesystem::remove(crashed / kLog);
  const auto stored = OpenStore(crashed.path())->Open("site");
  ASSERT_TRUE(stored.ok()) << stored.status();
  EXPECT_NE((*stored)->header().incarnation, incarnation_);
  EXPECT_THAT((*stored)->opening_notes(), ElementsAre(HasSubstr("commits are missing")));
}

TEST_F(WitnessTest, C5MapWhoseFirstCommitIsLostIsNotTakenForAnIncompleteOne) {
  const testing::TemporaryFolder made;
  CrashedFiles files;
  {
    const auto store = OpenStore(made.path());
    MapHeader header = map_.stored->header();
    header.provisional = true;
    header.incarnation = 0;
    auto stored = store->Create(header);
    ASSERT_TRUE(stored.ok()) << stored.status();
    EditedMap map{*std::move(stored), nullptr};
    map.snapshot = *map.stored->Load();
    map.Edit({{CreateLayer{SemanticSpec("s")}}});
    files = {ReadFile(made / kFile), "", ReadFile(made / kLock)};
  }
  const testing::TemporaryFolder crashed;
  files.WriteTo(crashed);
  for (const bool is_first : {true, false}) {
    const auto opened = OpenStore(crashed.path())->Open("site");
    ASSERT_TRUE(opened.ok()) << opened.status();
    if (is_first) {
      EXPECT_THAT((*opened)->opening_notes(),
                  ElementsAre(HasSubstr("acknowledged commits are missing")));
    }
    EXPECT_EQ((*(*opened)->Load())->revision, 0);
  }
}

TEST_F(WitnessTest, C5BackupAndItsRestorationAreOtherIncarnations) {
  const std::string backup = folder_ / "backup";
  ASSERT_TRUE(map_.stored->BackupTo(backup).ok());
  const auto metadata = ReadMetadata(Connect(backup).get());
  ASSERT_TRUE(metadata.ok()) << metadata.status();
  EXPECT_NE(metadata->header.incarnation, 0u);
  EXPECT_NE(metadata->header.incarnation, incarnation_);
  AddChair();
  map_.stored.reset();
  std::filesystem::rename(backup, folder_ / kFile);
  Reopen();
  EXPECT_NE(map_.stored->header().incarnation, metadata->header.incarnation);
  ExpectAnotherIncarnation("replaced or restored");
}

TEST_F(WitnessTest, C5OlderCopyOfTheFileIsAnotherIncarnation) {
  Reopen();
  map_.stored.reset();
  const std::string copy = ReadFile(folder_ / kFile);
  Reopen();
  AddChair();
  map_.stored.reset();
  WriteFile(folder_ / kFile, copy);
  Reopen();
  EXPECT_EQ(map_.snapshot->revision, 10);
  ExpectAnotherIncarnation("revision 10, where revision 11 was acknowledged");
}

TEST_F(WitnessTest, C5FileThatThisStoreDidNotWriteIsAnotherIncarnation) {
  map_.stored.reset();
  std::filesystem::remove(folder_ / kLock);
  Reopen();
  ExpectAnotherIncarnation("nothing tells that this store wrote the file last");
}

TEST_F(WitnessTest, C5DamagedWitnessMakesAnotherIncarnation) {
  map_.stored.reset();
  std::string witness = ReadFile(folder_ / kLock);
  witness.back() = static_cast<char>(witness.back() ^ 1);
  WriteFile(folder_ / kLock, witness);
  Reopen();
  ExpectAnotherIncarnation("nothing tells that this store wrote the file last");
}

TEST_F(WitnessTest, C5WitnessThatCannotBeReadIsNoLackOfOne) {
  map_.stored.reset();
  const std::string witness = ReadFile(folder_ / kLock);
  // A pipe can be opened and locked, but not read at a position.
  std::filesystem::remove(folder_ / kLock);
  ASSERT_EQ(mkfifo((folder_ / kLock).c_str(), 0644), 0);
  for (int i = 0; i < 2; ++i) {
    const absl::Status status = store_->Open("site").status();
    EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("map site: the record of the newest"));
    EXPECT_THAT(std::string(status.message()), HasSubstr(kLock));
  }
  std::filesystem::remove(folder_ / kLock);
  WriteFile(folder_ / kLock, witness);
  Reopen();
  EXPECT_EQ(map_.stored->header().incarnation, incarnation_);
  EXPECT_THAT(map_.stored->opening_notes(), IsEmpty());
}

TEST_F(WitnessTest, C5CopyThatWentOnElsewhereIsAnotherIncarnation) {
  map_.stored.reset();
  const testing::TemporaryFolder elsewhere;
  WriteFile(elsewhere / kFile, ReadFile(folder_ / kFile));
  WriteFile(elsewhere / kLock, ReadFile(folder_ / kLock));
  {
    auto stored = OpenStore(elsewhere.path())->Open("site");
    ASSERT_TRUE(stored.ok()) << stored.status();
    EXPECT_EQ((*stored)->header().incarnation, incarnation_);
    Commit commit = MakeCommit(**(*stored)->Load(), {{DeleteObject{"s", 1}}});
    commit.time += absl::Hours(1);
    ASSERT_TRUE((*stored)->Write({commit}).ok());
  }
  Reopen();
  AddChair();
  map_.stored.reset();
  WriteFile(folder_ / kFile, ReadFile(elsewhere / kFile));
  Reopen();
  ExpectAnotherIncarnation("another history");
}

TEST_F(WitnessTest, C5MapMadeAnewIsAnotherIncarnation) {
  map_.stored.reset();
  ASSERT_TRUE(store_->Delete("site", "").ok());
  const EditedMap anew = CreateMap(*store_, "site");
  EXPECT_NE(anew.stored->header().incarnation, incarnation_);
  EXPECT_THAT(anew.stored->opening_notes(), IsEmpty());
}

TEST_F(WitnessTest, C5LogOfAnotherFileIsNotApplied) {
  const std::string backup = folder_ / "backup";
  ASSERT_TRUE(map_.stored->BackupTo(backup).ok());
  const Snapshot expected = *map_.snapshot;
  AddChair();
  CrashedFiles files = Crash();
  files.file = ReadFile(backup);
  const testing::TemporaryFolder crashed;
  files.WriteTo(crashed);
  const auto store = OpenStore(crashed.path());
  {
    auto stored = store->Open("site");
    ASSERT_TRUE(stored.ok()) << stored.status();
    ExpectSame(**(*stored)->Load(), expected);
    EXPECT_THAT((*stored)->opening_notes(),
                ElementsAre(HasSubstr("replaced or restored"), HasSubstr("-wal.orphan")));
  }
  EXPECT_EQ(ReadFile(crashed / std::string(kLog) + ".orphan"), files.log);
  ASSERT_TRUE(store->Delete("site", "").ok());
  EXPECT_FALSE(std::filesystem::exists(crashed / std::string(kLog) + ".orphan"));
}

TEST_F(WitnessTest, C5LogWithTheIncarnationItselfIsApplied) {
  // The file gets another incarnation while another program reads it, so that the incarnation stays
  // in the log.
  map_.stored.reset();
  std::filesystem::remove(folder_ / kLock);
  GeoPackageOptions impatient;
  impatient.busy_timeout = absl::ZeroDuration();
  store_.reset();
  store_ = OpenStore(folder_.path(), impatient);
  const auto reader = Connect(folder_ / kFile);
  ASSERT_TRUE(reader->Execute("BEGIN; SELECT * FROM hypermap_metadata").ok());
  Reopen();
  AddChair();
  incarnation_ = map_.stored->header().incarnation;
  EXPECT_EQ(OpenDamaged(Crash()), map_.snapshot->revision);
  ASSERT_TRUE(reader->Execute("COMMIT").ok());
}

}  // namespace
}  // namespace hypermap::storage
