// Copies and checks of maps.
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "base/cancellation/testing/cancelled_after.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/contract.h"
#include "storage/conformance/testing/evidence_map.h"
#include "storage/conformance/testing/recorded_history.h"
#include "storage/conformance/testing/recorded_map.h"
#include "storage/conformance/testing/time_mark.h"
#include "tests/support/random_map.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::RandomSite;
using ::hypermap::testing::Rng;

class BackupContract : public StoreContract {
 protected:
  // A copy that was opened as the map "copy", and the store that it is in.
  struct Copy {
    std::unique_ptr<MapStore> store;
    std::unique_ptr<StoredMap> map;
  };
  // `map` is null if the store's copies can't be opened.
  Copy Open(const std::string& path) {
    Copy copy{world_->OpenCopy(path, "copy"), nullptr};
    if (copy.store == nullptr) return copy;
    auto opened = copy.store->Open("copy");
    EXPECT_TRUE(opened.ok()) << opened.status();
    if (opened.ok()) copy.map = *std::move(opened);
    return copy;
  }

  const testing::TemporaryFolder folder_;
};

HYPERMAP_CONFORMANCE_SUITE(BackupContract);

Snapshot Renamed(const Snapshot& snapshot) {
  Snapshot renamed = snapshot;
  renamed.map_name = "copy";
  return renamed;
}

TEST_P(BackupContract, BackupTakesNoMoreThanWasTold) {
  Rng rng(seed_);
  EditedMap map = CreateMap(*store_, "site");
  map.Edit(RandomSite(rng, 20));
  const absl::StatusOr<int64_t> most_bytes = map.stored->BackupBytes();
  ASSERT_TRUE(most_bytes.ok()) << most_bytes.status();
  ASSERT_TRUE(map.stored->BackupTo(folder_ / "backup").ok());
  EXPECT_GE(*most_bytes, static_cast<int64_t>(std::filesystem::file_size(folder_ / "backup")));
}

TEST_P(BackupContract, BackupIsWrittenToANewFileOnly) {
  EditedMap map = CreateMap(*store_, "site");
  ASSERT_TRUE(map.stored->BackupTo(folder_ / "backup").ok());
  EXPECT_EQ(map.stored->BackupTo(folder_ / "backup").code(), absl::StatusCode::kAlreadyExists);
  EXPECT_FALSE(map.stored->BackupTo(folder_ / "none/backup").ok());
}

TEST_P(BackupContract, BackupOpensAsAMap) {
  Rng rng(seed_);
  EditedMap map = CreateMap(*store_, "site");
  map.Edit(RandomSite(rng, 20), "the request");
  ASSERT_TRUE(map.stored->BackupTo(folder_ / "backup").ok());
  const Snapshot expected = Renamed(*map.snapshot);
  // Later edits are not in the backup.
  map.Edit({{DeleteLayer{"semantic"}}});
  const Copy copy = Open(folder_ / "backup");
  if (copy.store == nullptr) GTEST_SKIP();
  ASSERT_NE(copy.map, nullptr);
  ExpectSame(**copy.map->Load(), expected);
  EXPECT_TRUE(copy.map->FindReceipt("the request")->has_value());
  const Commit edit = MakeCommit(expected, {{DeleteObject{"semantic", 2}}});
  EXPECT_TRUE(copy.map->Write({edit}).ok());
}

TEST_P(BackupContract, BackupIsWrittenWhileTheWriterGoesOnAndAfterIt) {
  Rng rng(seed_);
  EditedMap map = CreateMap(*store_, "site");
  map.Edit(RandomSite(rng, 200));
  const absl::StatusOr<std::unique_ptr<MapBackup>> first = map.stored->OpenBackup();
  const absl::StatusOr<std::unique_ptr<MapBackup>> second = map.stored->OpenBackup();
  ASSERT_TRUE(first.ok() && second.ok());
  map.Edit({{DeleteObject{"semantic", 2}}});
  const Snapshot expected = Renamed(*map.snapshot);
  ASSERT_TRUE((*first)->WriteTo(folder_ / "first").ok());
  // A map that was closed or deleted meanwhile is still copied.
  map.stored.reset();
  ASSERT_TRUE(store_->Delete("site", "").ok());
  ASSERT_TRUE((*second)->WriteTo(folder_ / "second").ok());
  for (const char* name : {"first", "second"}) {
    SCOPED_TRACE(name);
    const Copy copy = Open(folder_ / name);
    if (copy.store == nullptr) GTEST_SKIP();
    ASSERT_NE(copy.map, nullptr);
    ExpectSame(**copy.map->Load(), expected);
  }
}

TEST_P(BackupContract, BackupOfAnotherThreadIsOfOneRevision) {
  Rng rng(seed_);
  RecordedMap map(CreateMap(*store_, "site"));
  map.Write({RandomSite(rng, 200)});
  const absl::StatusOr<std::unique_ptr<MapBackup>> backup = map.stored().OpenBackup();
  ASSERT_TRUE(backup.ok()) << backup.status();
  absl::Status status;
  std::thread copier([&] { status = (*backup)->WriteTo(folder_ / "backup"); });
  for (int i = 0; i < 10; ++i) map.Write({RandomBatch(rng, map.now())});
  copier.join();
  ASSERT_TRUE(status.ok()) << status;
  const Copy copy = Open(folder_ / "backup");
  if (copy.store == nullptr) GTEST_SKIP();
  ASSERT_NE(copy.map, nullptr);
  const SnapshotPtr read = *copy.map->Load();
  ExpectSame(*read, Renamed(map.at(read->revision)));
}

TEST_P(BackupContract, BackupKeepsTheHistory) {
  Rng rng(seed_);
  RecordedMap map(CreateMap(*store_, "site"));
  map.Write({RandomSite(rng, 10)});
  for (int i = 0; i < 5; ++i) map.Write({RandomBatch(rng, map.now())});
  ASSERT_TRUE(map.stored().BackupTo(folder_ / "backup").ok());
  const std::unique_ptr<MapStore> store = world_->OpenCopy(folder_ / "backup", "site");
  if (store == nullptr) GTEST_SKIP();
  auto copy = store->Open("site");
  ASSERT_TRUE(copy.ok()) << copy.status();
  auto reader = (*copy)->OpenHistory();
  ASSERT_TRUE(reader.ok()) << reader.status();
  ExpectAllAsRecorded(rng, **reader, map, 0);
}

TEST_P(BackupContract, CancelledBackupLeavesNoCopy) {
  if (GetParam().exceptions.metering) GTEST_SKIP();
  Rng rng(seed_);
  EditedMap map = CreateMap(*store_, "site");
  map.Edit(RandomSite(rng, 200));
  {
    const CancelledAfter cancelled(2);
    EXPECT_TRUE(absl::IsCancelled(map.stored->BackupTo(folder_ / "backup")));
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "backup"));
  // The last attempt is not cancelled.
  EXPECT_GT(TimesCancelled([&] { return map.stored->BackupTo(folder_ / "backup"); }), 1);
  map.Edit({{DeleteLayer{"semantic"}}});
}

TEST_P(BackupContract, BackupKeepsTheEvidenceAndTheMarks) {
  EvidenceMap map(CreateMap(*store_, "site"));
  map.Write({.layer = "things",
             .settings = FusionSettings{"evidence", "{}", ""},
             .observations = {Logged(Key(1, "a", 1), "1"), Logged(Key(2, "a", 2), "2")},
             .tracks = {{"t", 1}}});
  ASSERT_TRUE(map.stored().AddTimeMark(MarkAt(10), absl::ZeroDuration()).ok());
  ASSERT_TRUE(map.stored().BackupTo(folder_ / "backup").ok());
  const Copy copy = Open(folder_ / "backup");
  if (copy.store == nullptr) GTEST_SKIP();
  ASSERT_NE(copy.map, nullptr);
  EXPECT_THAT(*copy.map->TimeMarks(), ::testing::ElementsAre(MarkAt(10)));
  FusionLog& log = copy.map->fusion_log();
  EXPECT_EQ(log.FusedLayers()->size(), 1u);
  EXPECT_EQ(log.Read("things", BeforeAll(), 9)->size(), 2u);
  EXPECT_THAT(*log.Tracks("things"), ::testing::ElementsAre(TrackId("t", 1)));
}

TEST_P(BackupContract, CheckFindsNothingInAWholeMap) {
  Rng rng(seed_);
  RecordedMap map(CreateMap(*store_, "site"));
  map.Write({RandomSite(rng, 20)});
  for (int i = 0; i < 5; ++i) map.Write({RandomBatch(rng, map.now())});
  map.Compact(3, 100);
  absl::StatusOr<std::unique_ptr<MapCheck>> check = map.stored().OpenCheck();
  if (absl::IsUnimplemented(check.status())) GTEST_SKIP();
  ASSERT_TRUE(check.ok()) << check.status();
  auto late = map.stored().OpenCheck();
  ASSERT_TRUE(late.ok()) << late.status();
  map.Write({RandomBatch(rng, map.now())});
  // Any thread may run it while the writer goes on, or after the map was closed.
  absl::StatusOr<CheckReport> report = absl::UnknownError("");
  std::thread([&] { report = (*check)->Run(nullptr); }).join();
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_TRUE(report->is_clean()) << Describe(report->findings.front());
  EXPECT_GE(report->revision, 6);
  map.Close();
  report = (*late)->Run(nullptr);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_TRUE(report->is_clean()) << Describe(report->findings.front());
}

TEST_P(BackupContract, CheckShowsTheEvidenceAndTellsWhatCannotBeDecoded) {
  EvidenceMap map(CreateMap(*store_, "site"));
  map.Write({.layer = "things",
             .settings = FusionSettings{"evidence", "{}", ""},
             .observations = {Logged(Key(1, "a", 1), "good"), Logged(Key(2, "a", 2), "bad")}});
  absl::StatusOr<std::unique_ptr<MapCheck>> check = map.stored().OpenCheck();
  if (absl::IsUnimplemented(check.status())) GTEST_SKIP();
  ASSERT_TRUE(check.ok()) << check.status();
  const auto report = (*check)->Run([](const LogEntry& entry) {
    return entry.body == "good" ? absl::OkStatus() : absl::DataLossError("no observation");
  });
  ASSERT_TRUE(report.ok()) << report.status();
  ASSERT_EQ(report->findings.size(), 1u);
  EXPECT_THAT(report->findings.front().problem, ::testing::HasSubstr("no observation"));
}

TEST_P(BackupContract, CopyIsRestoredAsAnotherIncarnation) {
  Rng rng(seed_);
  EditedMap map = CreateMap(*store_, "site");
  map.Edit(RandomSite(rng, 20));
  const uint64_t incarnation = map.stored->header().incarnation;
  ASSERT_TRUE(map.stored->BackupTo(folder_ / "copy").ok());
  const auto report = store_->CheckFile(folder_ / "copy", nullptr);
  if (absl::IsUnimplemented(report.status())) GTEST_SKIP();
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_TRUE(report->is_clean()) << Describe(report->findings.front());
  const Snapshot expected = *map.snapshot;
  map.Edit({{DeleteLayer{"semantic"}}});
  EXPECT_TRUE(absl::IsFailedPrecondition(store_->Restore(folder_ / "copy", "site", "restore")));
  map.stored.reset();
  ASSERT_TRUE(store_->Restore(folder_ / "copy", "site", "restore").ok());
  const auto restored = store_->Open("site");
  ASSERT_TRUE(restored.ok()) << restored.status();
  ExpectSame(**(*restored)->Load(), expected);
  EXPECT_EQ((*restored)->header().request_id, "restore");
  EXPECT_NE((*restored)->header().incarnation, incarnation);
}

TEST_P(BackupContract, CopyIsRestoredUnderAnotherName) {
  EditedMap map = CreateMap(*store_, "site");
  map.Edit({{CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("chair"), ""}}});
  ASSERT_TRUE(map.stored->BackupTo(folder_ / "copy").ok());
  const auto report = store_->CheckFile(folder_ / "copy", nullptr);
  if (absl::IsUnimplemented(report.status())) GTEST_SKIP();
  ASSERT_TRUE(store_->Restore(folder_ / "copy", "copy", "restore").ok());
  const auto restored = store_->Open("copy");
  ASSERT_TRUE(restored.ok()) << restored.status();
  ExpectSame(**(*restored)->Load(), Renamed(*map.snapshot));
  EXPECT_NE((*restored)->header().incarnation, map.stored->header().incarnation);
  EXPECT_THAT(*store_->List(), ::testing::ElementsAre("copy", "site"));
}

TEST_P(BackupContract, FileThatIsNoMapIsRefused) {
  folder_.Write("text", "no map");
  const absl::Status status = store_->CheckFile(folder_ / "text", nullptr).status();
  if (absl::IsUnimplemented(status)) GTEST_SKIP();
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
}

}  // namespace
}  // namespace hypermap::storage
