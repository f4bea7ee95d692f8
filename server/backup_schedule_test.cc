#include "server/backup_schedule.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/time/time.h"
#include "server/session/site.h"
#include "storage/geopackage/geopackage_store.h"
#include "storage/sqlite/sqlite.h"
#include "tests/support/eventually.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::server {
namespace {

using ::hypermap::testing::Eventually;

class BackupScheduleTest : public ::testing::Test {
 protected:
  BackupScheduleTest() {
    auto store = storage::OpenGeoPackageStore(folder_ / "data");
    EXPECT_TRUE(store.ok()) << store.status();
    auto site = Site::Open(*std::move(store), {});
    EXPECT_TRUE(site.ok()) << site.status();
    site_ = *std::move(site);
    EXPECT_TRUE(site_->Create({"office", "map", ""}).ok());
  }

  std::unique_ptr<BackupSchedule> Start(int keep) {
    auto schedule =
        BackupSchedule::Start(site_.get(), {folder_ / "backups", /*every=*/absl::Seconds(1), keep});
    EXPECT_TRUE(schedule.ok()) << schedule.status();
    return *std::move(schedule);
  }

  // The paths of the backups, without those that are being written.
  std::vector<std::string> Backups() const {
    std::vector<std::string> paths;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_ / "backups")) {
      if (entry.path().extension() == ".gpkg") paths.push_back(entry.path().string());
    }
    return paths;
  }

  const testing::TemporaryFolder folder_;
  std::unique_ptr<Site> site_;
};

TEST_F(BackupScheduleTest, KeepsTheNewestVerifiedBackups) {
  auto schedule = Start(/*keep=*/2);
  EXPECT_TRUE(Eventually([&] { return schedule->meters().Read()["office"].verified >= 4; }));
  EXPECT_EQ(schedule->meters().Read()["office"].failed, 0);
  schedule.reset();
  EXPECT_EQ(Backups().size(), 2u);
}

TEST_F(BackupScheduleTest, DamagedMapKeepsTheBackupFromBefore) {
  {
    const auto schedule = Start(/*keep=*/1);
    EXPECT_TRUE(Eventually([&] { return schedule->meters().Read()["office"].verified >= 1; }));
  }
  const std::vector<std::string> before = Backups();
  ASSERT_EQ(before.size(), 1u);
  // A reference that leads to nothing does not keep the map from being served, nor from being
  // copied.
  const auto other = storage::Database::Open(
      folder_ / "data/office.gpkg", storage::Database::OpenMode::kExisting, absl::Seconds(5));
  ASSERT_TRUE(other.ok()) << other.status();
  ASSERT_TRUE((*other)
                  ->Execute("INSERT INTO hypermap_tile_history "
                            "(lineage, tile_column, tile_row, end_revision) VALUES (7, 0, 0, 9)")
                  .ok());
  auto schedule = Start(/*keep=*/1);
  EXPECT_TRUE(Eventually([&] { return schedule->meters().Read()["office"].failed >= 1; }));
  schedule.reset();
  EXPECT_EQ(Backups(), before);
}

}  // namespace
}  // namespace hypermap::server
