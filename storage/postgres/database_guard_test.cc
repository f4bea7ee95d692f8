#include "storage/postgres/database_guard.h"

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/sync/deadline.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/libpq/testing/cluster.h"
#include "storage/postgres/postgres_store.h"
#include "storage/postgres/schema.h"
#include "storage/postgres/testing/database.h"

namespace hypermap::storage::postgres {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// What the opening of a map tells, and its incarnation.
struct Found {
  uint64_t incarnation = 0;
  std::vector<std::string> notes;
};

Found OpenMap(MapStore& store, const std::string& name) {
  const auto map = store.Open(name);
  EXPECT_TRUE(map.ok()) << map.status();
  if (!map.ok()) return {};
  return {(*map)->header().incarnation, (*map)->opening_notes()};
}

// Opens the store for a moment.
Found OpenMap(const std::string& database, const std::string& name) {
  return OpenMap(*OpenStore(database), name);
}

uint64_t MakeMap(const std::string& database, const std::string& name) {
  const auto store = OpenStore(database);
  EditedMap map = CreateMap(*store, name);
  map.Edit({{CreateLayer{SemanticSpec("semantic")}}});
  return map.stored->header().incarnation;
}

class DatabaseGuardTest : public ::testing::Test {
 protected:
  void SetUp() override {
    HYPERMAP_SKIP_WITHOUT_POSTGRES();
    database_ = NewDatabase();
  }

  std::string database_;
};

TEST_F(DatabaseGuardTest, MapsKeepTheirIncarnationsInADatabaseThatIsOnlyRestarted) {
  const uint64_t made = MakeMap(database_, "site");
  Cluster::Shared().Stop();
  ASSERT_TRUE(Cluster::Shared().Start().ok());
  const Found found = OpenMap(database_, "site");
  EXPECT_EQ(found.incarnation, made);
  EXPECT_THAT(found.notes, IsEmpty());
}

TEST_F(DatabaseGuardTest, MapsOfACopiedDatabaseAreOtherIncarnations) {
  const uint64_t one = MakeMap(database_, "one");
  const uint64_t two = MakeMap(database_, "two");
  const std::string copy = *Cluster::Shared().CreateDatabase(database_);
  const auto store = OpenStore(copy);
  const Found copied = OpenMap(*store, "one");
  EXPECT_NE(copied.incarnation, one);
  EXPECT_THAT(copied.notes, ElementsAre(HasSubstr("restored from a copy")));
  const Found other = OpenMap(*store, "two");
  EXPECT_NE(other.incarnation, two);
  EXPECT_NE(other.incarnation, copied.incarnation);
  // It is told once, and the copy is a database of its own from now on.
  EXPECT_THAT(OpenMap(*store, "one").notes, IsEmpty());
  EXPECT_EQ(OpenMap(copy, "one").incarnation, copied.incarnation);
  EXPECT_EQ(OpenMap(database_, "one").incarnation, one);
}

TEST_F(DatabaseGuardTest, MapsOfARestoredDumpAreOtherIncarnations) {
  const uint64_t made = MakeMap(database_, "site");
  const std::string restored = *Cluster::Shared().CreateDatabase();
  const std::string programs = "/usr/lib/postgresql/15/bin/";
  const std::string command = absl::StrCat("\"", programs, "pg_dump\" -d '", database_, "' | \"",
                                           programs, "psql\" -q -d '", restored, "'");
  ASSERT_EQ(std::system(absl::StrCat(command, " > /dev/null").c_str()), 0);
  EXPECT_NE(OpenMap(restored, "site").incarnation, made);
  EXPECT_EQ(OpenMap(database_, "site").incarnation, made);
}

TEST_F(DatabaseGuardTest, ADumpThatIsRestoredInPlaceUnderAServerIsNoticed) {
  const uint64_t made = MakeMap(database_, "site");
  const auto store = OpenStore(database_);
  const auto map = store->Open("site");
  ASSERT_TRUE(map.ok()) << map.status();
  Execute(database_, "UPDATE hypermap.place SET tables = 'those of the dump'");
  // The lease is renewed, and each renewal looks.
  const Deadline deadline(absl::Seconds(30));
  while (QueryNumber(database_, "SELECT incarnation FROM hypermap.maps") ==
             static_cast<int64_t>(made) &&
         !deadline.has_passed()) {
    absl::SleepFor(absl::Milliseconds(10));
  }
  EXPECT_TRUE(absl::IsDataLoss((*map)->TryWrite()));
}

TEST_F(DatabaseGuardTest, UnfinishedMapsStayAsTheyAre) {
  const auto store = OpenStore(database_);
  MapHeader header = HeaderOf("copy");
  header.unfinished_copy = true;
  ASSERT_TRUE(store->Create(header).ok());
  const auto incarnation = [&] {
    return QueryNumber(database_, "SELECT incarnation FROM hypermap.maps");
  };
  const int64_t before = incarnation();
  ASSERT_NE(before, 0);
  Execute(database_, "UPDATE hypermap.place SET tables = ''");
  OpenStore(database_);
  EXPECT_EQ(incarnation(), before);
}

TEST_F(DatabaseGuardTest, ASchemaOfVersionOneIsMigratedAndItsMapsStay) {
  const uint64_t made = MakeMap(database_, "site");
  Execute(database_,
          "DROP TABLE hypermap.place; ALTER TABLE hypermap.servers DROP COLUMN draining; "
          "UPDATE hypermap.schema_version SET version = 1");
  EXPECT_EQ(OpenMap(database_, "site").incarnation, made);
  EXPECT_EQ(QueryNumber(database_, "SELECT version FROM hypermap.schema_version"), kSchemaVersion);
  EXPECT_EQ(QueryNumber(database_, "SELECT count(draining) FROM hypermap.servers"), 0);
  EXPECT_EQ(OpenMap(database_, "site").incarnation, made);
}

TEST_F(DatabaseGuardTest, AServerThatBeginsLeavesTheChangeToThoseThatMayLive) {
  const uint64_t made = MakeMap(database_, "site");
  Execute(database_,
          "UPDATE hypermap.place SET timeline = 7; "
          "INSERT INTO hypermap.servers (id, address, session, lease_until) VALUES "
          "('other', '', 1, clock_timestamp() - interval '10 seconds')");
  std::thread other([&] {
    absl::SleepFor(absl::Milliseconds(300));
    Execute(database_, "UPDATE hypermap.place SET timeline = 1");
  });
  EXPECT_EQ(OpenMap(database_, "site").incarnation, made);
  other.join();
}

// Begins another epoch and another incarnation, unless the revision is there.
TEST_F(DatabaseGuardTest, AMapIsRenewedOnlyIfItLacksARevisionOfItsIncarnation) {
  const uint64_t made = MakeMap(database_, "site");
  const auto store = OpenStore(database_);
  const auto map = store->Open("site");
  ASSERT_TRUE(map.ok()) << map.status();
  const auto incarnation = [&] {
    return static_cast<uint64_t>(QueryNumber(database_, "SELECT incarnation FROM hypermap.maps"));
  };
  ASSERT_TRUE(store->RenewIncarnation("site", made, 1).ok());
  ASSERT_TRUE(store->RenewIncarnation("site", made + 1, 2).ok());
  ASSERT_TRUE(store->RenewIncarnation("other", made, 2).ok());
  EXPECT_EQ(incarnation(), made);
  EXPECT_TRUE((*map)->TryWrite().ok());
  ASSERT_TRUE(store->RenewIncarnation("site", made, 2).ok());
  const uint64_t renewed = incarnation();
  EXPECT_NE(renewed, made);
  EXPECT_TRUE(absl::IsDataLoss((*map)->TryWrite()));
  // Another server that has noticed the same comes too late.
  ASSERT_TRUE(store->RenewIncarnation("site", made, 2).ok());
  EXPECT_EQ(incarnation(), renewed);
}

// A cluster of the test's own, whose database goes on from a copy of its files.
class RecoveredDatabaseTest : public ::testing::Test {
 protected:
  void SetUp() override {
    HYPERMAP_SKIP_WITHOUT_POSTGRES();
    auto cluster = Cluster::Create();
    ASSERT_TRUE(cluster.ok()) << cluster.status();
    cluster_ = *std::move(cluster);
    database_ = *cluster_->CreateDatabase();
  }
  void Save() {
    cluster_->Stop(Cluster::StopMode::kFast);
    ASSERT_TRUE(cluster_->SaveFiles().ok());
    ASSERT_TRUE(cluster_->Start().ok());
  }
  void RecoverSaved() {
    cluster_->Stop(Cluster::StopMode::kFast);
    ASSERT_TRUE(cluster_->RestoreFiles().ok());
    Recover();
  }
  void Recover() {
    cluster_->Stop(Cluster::StopMode::kFast);
    ASSERT_TRUE(cluster_->RecoverAtStart().ok());
    const absl::Status started = cluster_->Start();
    ASSERT_TRUE(started.ok()) << started;
  }

  std::unique_ptr<Cluster> cluster_;
  std::string database_;
};

TEST_F(RecoveredDatabaseTest, MapsThatNobodyVouchesForAreOtherIncarnations) {
  const uint64_t made = MakeMap(database_, "site");
  Save();
  MakeMap(database_, "later");
  RecoverSaved();
  const auto store = OpenStore(database_);
  EXPECT_THAT(*store->List(), ElementsAre("site"));
  const Found found = OpenMap(*store, "site");
  EXPECT_NE(found.incarnation, made);
  EXPECT_THAT(found.notes, ElementsAre(HasSubstr("from timeline 1 to 2")));
  EXPECT_EQ(OpenMap(*store, "site").incarnation, found.incarnation);
}

TEST_F(RecoveredDatabaseTest, AServerDoesNotVouchForCommitsThatNoStandbyConfirmed) {
  const uint64_t made = MakeMap(database_, "site");
  const auto store = OpenStore(database_);
  Recover();
  EXPECT_NE(OpenMap(*store, "site").incarnation, made);
}

}  // namespace
}  // namespace hypermap::storage::postgres
