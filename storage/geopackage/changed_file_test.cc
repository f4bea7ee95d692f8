// Tests that a map whose files are removed, replaced or overwritten while it is open acknowledges
// nothing any more, and that its log is not mixed with another file.
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/geopackage/testing/map.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

class ChangedFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    store_ = OpenStore(data_dir_);
    map_ = CreateMap(*store_, "site");
    map_.Edit({{CreateLayer{SemanticSpec("s")}}});
    for (int i = 0; i < 5; ++i) AddChair();
  }

  void AddChair() { map_.Edit({{PutObject{"s", UnitSquare("chair"), ""}}}); }

  Commit NextCommit() const {
    return MakeCommit(*map_.snapshot, {{PutObject{"s", UnitSquare("lost"), ""}}});
  }

  // The file of another map, which is larger than that of this one.
  std::string ForeignFile() {
    {
      EditedMap foreign = CreateMap(*store_, "foreign");
      testing::Rng rng(3);
      foreign.Edit(testing::RandomSite(rng, 30));
      foreign_ = foreign.snapshot;
    }
    return ReadFile(data_dir_ + "/foreign.gpkg");
  }

  void ExpectDataLoss(const absl::Status& status, const std::string& reason) {
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("map site: "));
    EXPECT_THAT(std::string(status.message()), HasSubstr(reason));
  }

  void ExpectNothingIsAcknowledged(const std::string& reason) {
    ExpectDataLoss(map_.stored->Write({NextCommit()}), reason);
    ExpectDataLoss(map_.stored->CheckFile(), reason);
    ExpectDataLoss(map_.stored->Write({NextCommit()}), reason);
    ExpectDataLoss(map_.stored->AddTimeMark(TimeMark(), absl::ZeroDuration()), reason);
    ExpectDataLoss(map_.stored->Compact(1, absl::InfinitePast(), 10).status(), reason);
    ExpectDataLoss(map_.stored->BackupTo(folder_ / "backup"), reason);
  }

  // Closes the map, whose file is another one by now, and opens that.
  void ExpectForeignMapIsUnharmed(const std::string& content) {
    const std::string log = ReadFile(log_);
    map_.stored.reset();
    EXPECT_EQ(ReadFile(file_), content);
    EXPECT_FALSE(std::filesystem::exists(log_));
    EXPECT_EQ(ReadFile(log_ + ".orphan"), log);
    auto stored = store_->Open("site");
    ASSERT_TRUE(stored.ok()) << stored.status();
    EXPECT_EQ((*stored)->opening_notes().size(), 1u);
    Snapshot expected = *foreign_;
    expected.map_name = "site";
    ExpectSame(**(*stored)->Load(), expected);
  }

  // Closes the map, whose file is back by now, and opens it again.
  void ExpectNothingIsLost() {
    const uint64_t incarnation = map_.stored->header().incarnation;
    map_.stored.reset();
    EXPECT_FALSE(std::filesystem::exists(log_));
    EXPECT_FALSE(std::filesystem::exists(log_ + ".orphan"));
    auto stored = store_->Open("site");
    ASSERT_TRUE(stored.ok()) << stored.status();
    ExpectSame(**(*stored)->Load(), *map_.snapshot);
    EXPECT_EQ((*stored)->header().incarnation, incarnation);
    EXPECT_THAT((*stored)->opening_notes(), IsEmpty());
  }

  const testing::TemporaryFolder folder_;
  const std::string data_dir_ = folder_ / "data";
  const std::string file_ = data_dir_ + "/site.gpkg";
  const std::string log_ = file_ + "-wal";
  std::unique_ptr<MapStore> store_;
  EditedMap map_;
  SnapshotPtr foreign_;
};

TEST_F(ChangedFileTest, C3RemovedFileIsNoticed) {
  std::filesystem::remove(file_);
  ExpectNothingIsAcknowledged("the file of the map was removed");
  ExpectDataLoss(map_.stored->OpenHistory().status(), "the file of the map was removed");
  map_.stored.reset();
  EXPECT_FALSE(std::filesystem::exists(file_));
  EXPECT_FALSE(std::filesystem::exists(log_));
  EXPECT_TRUE(std::filesystem::exists(log_ + ".orphan"));
}

TEST_F(ChangedFileTest, C3ReplacedFileIsNoticed) {
  const std::string content = ForeignFile();
  WriteFile(folder_ / "new", content);
  std::filesystem::rename(folder_ / "new", file_);
  ExpectNothingIsAcknowledged("the file of the map was replaced");
  ExpectDataLoss(map_.stored->OpenHistory().status(), "the file of the map was replaced");
  ExpectForeignMapIsUnharmed(content);
}

TEST_F(ChangedFileTest, C3OverwrittenFileIsNoticed) {
  const std::string content = ForeignFile();
  WriteFile(file_, content);
  ExpectNothingIsAcknowledged("the file of the map was overwritten");
  ExpectForeignMapIsUnharmed(content);
}

TEST_F(ChangedFileTest, C3FileOverwrittenByOneOfTheSameSizeIsNoticed) {
  WriteFile(file_, ReadFile(file_));
  // As `cp -p` does; also because two changes within one tick of the clock are not told apart.
  std::filesystem::last_write_time(
      file_, std::filesystem::file_time_type::clock::now() - std::chrono::hours(1));
  ExpectNothingIsAcknowledged("the file of the map was overwritten");
}

TEST_F(ChangedFileTest, C3RemovedFolderIsNoticed) {
  std::filesystem::remove_all(data_dir_);
  ExpectNothingIsAcknowledged("the file of the map was removed");
}

TEST_F(ChangedFileTest, C3IdleMapNoticesItAsWell) {
  EXPECT_TRUE(map_.stored->CheckFile().ok());
  std::filesystem::remove(file_);
  ExpectDataLoss(map_.stored->CheckFile(), "the file of the map was removed");
  // For ever, although the file is back.
  WriteFile(file_, "back");
  ExpectDataLoss(map_.stored->CheckFile(), "the file of the map was removed");
}

TEST_F(ChangedFileTest, C3RemovedLogIsNoticedAndItsCommitsAreSaved) {
  const uint64_t incarnation = map_.stored->header().incarnation;
  std::filesystem::remove(log_);
  ExpectNothingIsAcknowledged("the write-ahead log of the map was removed");
  map_.stored.reset();
  auto stored = store_->Open("site");
  ASSERT_TRUE(stored.ok()) << stored.status();
  ExpectSame(**(*stored)->Load(), *map_.snapshot);
  EXPECT_EQ((*stored)->header().incarnation, incarnation);
  EXPECT_THAT((*stored)->opening_notes(), IsEmpty());
}

TEST_F(ChangedFileTest, C3ShortenedLogIsNoticed) {
  const uint64_t incarnation = map_.stored->header().incarnation;
  std::filesystem::resize_file(log_, std::filesystem::file_size(log_) / 2);
  ExpectNothingIsAcknowledged("the write-ahead log of the map was shortened");
  map_.stored.reset();
  auto stored = store_->Open("site");
  ASSERT_TRUE(stored.ok()) << stored.status();
  EXPECT_LT((*(*stored)->Load())->revision, map_.snapshot->revision);
  EXPECT_NE((*stored)->header().incarnation, incarnation);
}

TEST_F(ChangedFileTest, C5FileThatWasAwayForAMomentLosesNothing) {
  std::filesystem::rename(file_, folder_ / "away");
  ExpectNothingIsAcknowledged("the file of the map was removed");
  std::filesystem::rename(folder_ / "away", file_);
  ExpectDataLoss(map_.stored->CheckFile(), "the file of the map was removed");
  ExpectNothingIsLost();
}

TEST_F(ChangedFileTest, C5FileThatWasReplacedForAMomentLosesNothing) {
  const std::string content = ForeignFile();
  std::filesystem::rename(file_, folder_ / "away");
  WriteFile(file_, content);
  ExpectNothingIsAcknowledged("the file of the map was replaced");
  std::filesystem::rename(folder_ / "away", file_);
  ExpectNothingIsLost();
}

TEST_F(ChangedFileTest, C5FolderThatWasAwayForAMomentLosesNothing) {
  std::filesystem::rename(data_dir_, folder_ / "away");
  ExpectNothingIsAcknowledged("the file of the map was removed");
  std::filesystem::rename(folder_ / "away", data_dir_);
  ExpectNothingIsLost();
}

TEST_F(ChangedFileTest, C5LogThatWasAwayForAMomentLosesNothing) {
  std::filesystem::rename(log_, folder_ / "away");
  ExpectNothingIsAcknowledged("the write-ahead log of the map was removed");
  std::filesystem::rename(folder_ / "away", log_);
  ExpectNothingIsLost();
}

TEST_F(ChangedFileTest, C5FileThatWasChangedWhileItWasAwayIsNotMixedWithTheLog) {
  const std::string content = ForeignFile();
  std::filesystem::rename(file_, folder_ / "away");
  ExpectNothingIsAcknowledged("the file of the map was removed");
  WriteFile(folder_ / "away", content);
  std::filesystem::rename(folder_ / "away", file_);
  ExpectForeignMapIsUnharmed(content);
}

TEST_F(ChangedFileTest, C5CopyThatIsPutInPlaceOfTheFileIsNotMixedWithTheLog) {
  std::filesystem::rename(file_, folder_ / "away");
  ExpectNothingIsAcknowledged("the file of the map was removed");
  const std::string content = ReadFile(folder_ / "away");
  WriteFile(file_, content);
  std::filesystem::last_write_time(file_, std::filesystem::last_write_time(folder_ / "away"));
  const std::string log = ReadFile(log_);
  map_.stored.reset();
  EXPECT_EQ(ReadFile(file_), content);
  EXPECT_EQ(ReadFile(log_ + ".orphan"), log);
}

TEST_F(ChangedFileTest, C3OtherMapsGoOn) {
  EditedMap other = CreateMap(*store_, "other");
  std::filesystem::remove(file_);
  ExpectNothingIsAcknowledged("the file of the map was removed");
  other.Edit({{CreateLayer{SemanticSpec("s")}}});
  EXPECT_TRUE(other.stored->CheckFile().ok());
  map_.stored.reset();
  other.Edit({{PutObject{"s", UnitSquare("chair"), ""}}});
}

TEST_F(ChangedFileTest, C3OwnCheckpointsAndReadersChangeNothing) {
  const uintmax_t size_before = std::filesystem::file_size(file_);
  constexpr int kObjects = 6000;
  for (int round = 0; round < 4; ++round) {
    EditBatch batch;
    for (int i = 0; i < kObjects; ++i) batch.edits.push_back(PutObject{"s", UnitSquare("cup"), ""});
    map_.Edit(batch);
    const auto reader = Connect(file_);
    EXPECT_TRUE(reader->QueryInt64("SELECT count(*) FROM s").ok());
    EXPECT_TRUE(map_.stored->CheckFile().ok());
    EXPECT_TRUE(map_.stored->OpenHistory().ok());
    ASSERT_TRUE(map_.stored->Compact(map_.snapshot->revision, absl::InfinitePast(), 9).ok());
  }
  // The log was moved into the file while the map was open.
  EXPECT_GT(std::filesystem::file_size(file_), size_before);
  EXPECT_TRUE(map_.stored->CheckFile().ok());
}

TEST_F(ChangedFileTest, C3LogThatSqliteShortensIsNoChange) {
  // A reader keeps the log growing; afterwards SQLite shortens it to journal_size_limit.
  const auto reader = Connect(file_);
  ASSERT_TRUE(reader->Execute("BEGIN; SELECT * FROM hypermap_metadata").ok());
  const LayerSpec spec = GridSpec("g", LayerKind::kScalar, {}, 0.05);
  map_.Edit({{CreateLayer{spec}}});
  testing::Rng rng(7);
  const CellBox box{0, 512, 0, 512};
  while (std::filesystem::file_size(log_) < (uintmax_t{70} << 20)) {
    map_.Edit({{WriteCells{"g", box, testing::RandomCells(rng, LayerKind::kScalar, box)}}});
  }
  ASSERT_TRUE(reader->Execute("COMMIT").ok());
  for (int i = 0; i < 4; ++i) AddChair();
  EXPECT_LT(std::filesystem::file_size(log_), uintmax_t{70} << 20);
  EXPECT_TRUE(map_.stored->CheckFile().ok());
}

}  // namespace
}  // namespace hypermap::storage
