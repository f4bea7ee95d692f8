// Tests of damage in the file of a replica, and in that of the server, which has a replica.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "client_libs/cpp/replica/durable_copy.h"
#include "map/edits/apply.h"
#include "map/edits/difference.h"
#include "storage/geopackage/geopackage_store.h"
#include "storage/geopackage/map_fetch.h"
#include "storage/sqlite/sqlite.h"
#include "tests/support/random_map.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::client {
namespace {

using ::hypermap::testing::TemporaryFolder;
using ::testing::IsEmpty;

constexpr int kNumObjects = 120;
const absl::Time kCreation = absl::FromUnixSeconds(1000);

absl::Time TimeOfCommit(Revision revision) { return kCreation + absl::Seconds(revision); }

EditBatch PutObjects(const std::string& layer) {
  EditBatch batch;
  for (int i = 0; i < kNumObjects; ++i) {
    PutObject put{layer, {}, ""};
    put.object.label = absl::StrCat("chair ", i);
    put.object.shape = Polygon::FromBox({{1.0 * i, 0}, {1.0 * i + 1, 1}});
    batch.edits.push_back(put);
  }
  return batch;
}

LayerSpec Things() {
  LayerSpec spec;
  spec.name = "things";
  spec.kind = LayerKind::kSemantic;
  spec.frame_id = "map";
  return spec;
}

// Changes a bit of a page with rows of the layer.
void Damage(const std::string& path) {
  std::string page;
  {
    const auto database =
        storage::Database::Open(path, storage::Database::OpenMode::kReadOnly, absl::ZeroDuration());
    ASSERT_TRUE(database.ok()) << database.status();
    const auto number = (*database)->QueryInt64(
        "SELECT max(pageno) FROM dbstat WHERE name = 'things' AND pagetype = 'leaf'");
    ASSERT_TRUE(number.ok() && *number) << number.status();
    page = absl::StrCat(**number);
  }
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  const std::streamoff at = (std::stoll(page) - 1) * 4096 + 3000;
  file.seekg(at);
  const char byte = static_cast<char>(file.get() ^ 4);
  file.seekp(at);
  file.put(byte);
}

// A server's map of two revisions, and the file of its replica.
class DamagedCopyTest : public ::testing::Test {
 protected:
  void SetUp() override {
    store_ = *storage::OpenGeoPackageStore(server_.path());
    auto stored = store_->Create({"site", "map", kCreation, ""});
    ASSERT_TRUE(stored.ok()) << stored.status();
    newest_ = *(*stored)->Load();
    for (const EditBatch& batch : {EditBatch{{CreateLayer{Things()}}}, PutObjects("things")}) {
      const auto applied = Apply(*newest_, batch);
      ASSERT_TRUE(applied.ok()) << applied.status();
      newest_ = applied->snapshot;
      ASSERT_TRUE((*stored)->Write({{*applied, "test", TimeOfCommit(newest_->revision)}}).ok());
    }
    const auto copy = OpenCopy();
    copy->Write({newest_, TimeOfCommit(newest_->revision), kCreation});
    ASSERT_TRUE(copy->Flush().ok());
  }

  std::unique_ptr<DurableCopy> OpenCopy() {
    auto copy = DurableCopy::Open(robot_.path(), "site", "all", absl::Hours(1));
    EXPECT_TRUE(copy.ok()) << copy.status();
    return copy.ok() ? *std::move(copy) : nullptr;
  }

  const TemporaryFolder server_;
  const TemporaryFolder robot_;
  std::unique_ptr<storage::MapStore> store_;
  SnapshotPtr newest_;
};

TEST_F(DamagedCopyTest, LayerOfTheServerIsFetchedFromAReplica) {
  Damage(server_ / "site.gpkg");
  {
    const auto damaged = store_->Open("site");
    ASSERT_TRUE(damaged.ok()) << damaged.status();
    EXPECT_TRUE((*(*damaged)->Load())->damaged.contains("things"));
  }
  const auto report =
      storage::FetchDamaged(server_ / "site.gpkg", robot_ / "site.gpkg", /*evidence=*/nullptr);
  ASSERT_TRUE(report.ok()) << report.status();
  ASSERT_EQ(report->layers.size(), 1u);
  const auto repaired = store_->Open("site");
  ASSERT_TRUE(repaired.ok()) << repaired.status();
  const SnapshotPtr loaded = *(*repaired)->Load();
  EXPECT_THAT(Difference(*loaded, *newest_), IsEmpty());
  EXPECT_THAT(Difference(*newest_, *loaded), IsEmpty());
  EXPECT_EQ(loaded->layer_versions, newest_->layer_versions);
  EXPECT_EQ(loaded->revision, newest_->revision);
}

TEST_F(DamagedCopyTest, ReplicaThatLacksALayerIsTakenAnew) {
  Damage(robot_ / "site.gpkg");
  const auto copy = OpenCopy();
  EXPECT_FALSE(copy->stored().has_value());
  EXPECT_TRUE(std::filesystem::exists(robot_ / "site.gpkg.damaged"));
}

}  // namespace
}  // namespace hypermap::client
