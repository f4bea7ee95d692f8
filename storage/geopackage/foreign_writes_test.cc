// Tests that edits of other programs are told from damage, and that damage is told with its page.
#include "storage/geopackage/foreign_writes.h"

#include <sqlite3.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/geopackage/map_check.h"
#include "storage/geopackage/map_repair.h"
#include "storage/geopackage/testing/map.h"
#include "storage/sqlite/page_checksums.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::RandomSite;
using ::hypermap::testing::Rng;
using ::hypermap::testing::TestSeed;
using ::hypermap::testing::UniformInt;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// A connection of a program that knows no checksums, but the functions that the triggers of layers
// use.
class OtherProgram {
 public:
  explicit OtherProgram(const std::string& path) {
    EXPECT_EQ(sqlite3_open_v2(path.c_str(), &handle_, SQLITE_OPEN_READWRITE, "unix"), SQLITE_OK);
    for (const char* name : {"ST_IsEmpty", "ST_MinX", "ST_MaxX", "ST_MinY", "ST_MaxY"}) {
      sqlite3_create_function(
          handle_, name, 1, SQLITE_UTF8, nullptr,
          [](sqlite3_context* context, int, sqlite3_value**) { sqlite3_result_int(context, 0); },
          nullptr, nullptr);
    }
  }
  ~OtherProgram() { sqlite3_close(handle_); }

  void Execute(const std::string& sql) {
    EXPECT_EQ(sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
        << sqlite3_errmsg(handle_);
  }

 private:
  sqlite3* handle_ = nullptr;
};

class ForeignWritesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    store_ = OpenStore(folder_.path());
    EditedMap map = CreateMap(*store_, "site");
    map.Edit({{CreateLayer{SemanticSpec("s")},
               CreateLayer{GridSpec("wifi", LayerKind::kScalar, {}, 0.25)},
               WriteCells{"wifi", {0, 1, -2, 1}, {-60.5, std::nullopt, -71.25}}}});
    for (int i = 0; i < 40; ++i) map.Edit({{PutObject{"s", UnitSquare("chair"), ""}}});
    before_ = map.snapshot;
  }

  bool IsWritten() { return WasWrittenByOthers(path_); }

  // Opens the map, which another program has written to.
  void ExpectAdopted(const std::function<void(const Snapshot&)>& expect) {
    EXPECT_TRUE(IsWritten());
    const auto report = CheckMapFile(path_, nullptr);
    ASSERT_TRUE(report.ok()) << report.status();
    for (const Finding& finding : report->findings) {
      EXPECT_THAT(finding.problem, Not(HasSubstr("checksum")));
    }
    {
      auto map = store_->Open("site");
      ASSERT_TRUE(map.ok()) << map.status();
      EXPECT_THAT((*map)->opening_notes(), ElementsAre(HasSubstr("another program has written")));
      const auto loaded = (*map)->Load();
      ASSERT_TRUE(loaded.ok()) << loaded.status();
      expect(**loaded);
    }
    EXPECT_FALSE(IsWritten());
    const auto map = store_->Open("site");
    ASSERT_TRUE(map.ok()) << map.status();
    EXPECT_THAT((*map)->opening_notes(), IsEmpty());
    expect(**(*map)->Load());
  }

  void FlipBit(int64_t byte, int bit) {
    std::string bytes = ReadFile(path_);
    bytes[byte] = static_cast<char>(bytes[byte] ^ 1 << bit);
    WriteFile(path_, bytes);
  }

  const testing::TemporaryFolder folder_;
  const std::string path_ = folder_ / "site.gpkg";
  std::unique_ptr<MapStore> store_;
  SnapshotPtr before_;
};

TEST_F(ForeignWritesTest, OwnWritesLeaveNoSign) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  {
    EditedMap map = CreateMap(*store_, "other");
    map.Edit(RandomSite(rng, 30));
    map.Edit({{DeleteLayer{"wifi"}, DeleteObject{"semantic", 2}}});
    // Enough to fill the index at once.
    EditBatch many;
    for (int i = 0; i < 600; ++i) many.edits.push_back(PutObject{"semantic", UnitSquare("x"), ""});
    map.Edit(many);
    ASSERT_TRUE(map.stored->Compact(map.snapshot->revision, absl::InfiniteFuture(), 10000).ok());
    ASSERT_TRUE(map.stored->BackupTo(folder_ / "backup.gpkg").ok());
  }
  for (const char* name : {"site.gpkg", "other.gpkg", "backup.gpkg"}) {
    SCOPED_TRACE(name);
    EXPECT_FALSE(WasWrittenByOthers(folder_ / name));
    const auto database = Connect(folder_ / name);
    ASSERT_TRUE(database->QueryInt64("SELECT count(*) FROM hypermap_metadata").ok());
    EXPECT_TRUE(KeepsChecksums(database->handle()));
  }
  for (const char* name : {"site", "other", "backup"}) {
    auto map = store_->Open(name);
    ASSERT_TRUE(map.ok()) << map.status();
    EXPECT_TRUE((*map)->Load().ok());
  }
}

TEST_F(ForeignWritesTest, EditedObjectIsRead) {
  OtherProgram(path_).Execute("UPDATE s SET label = 'sofa' WHERE id = 3");
  ExpectAdopted([](const Snapshot& map) { EXPECT_EQ(map.FindLayer("s")->Size(), 40u); });
}

TEST_F(ForeignWritesTest, RemovedObjectIsRead) {
  OtherProgram(path_).Execute("DELETE FROM s WHERE id > 20");
  ExpectAdopted([](const Snapshot& map) { EXPECT_EQ(map.FindLayer("s")->Size(), 20u); });
}

TEST_F(ForeignWritesTest, RemovedTileIsRead) {
  OtherProgram(path_).Execute("DELETE FROM wifi");
  ExpectAdopted([](const Snapshot&) {});
}

TEST_F(ForeignWritesTest, NewTableIsKept) {
  OtherProgram(path_).Execute(
      "CREATE TABLE layer_styles (id INTEGER PRIMARY KEY, style TEXT); "
      "INSERT INTO layer_styles VALUES (1, 'red')");
  ExpectAdopted([&](const Snapshot& map) { ExpectSame(map, *before_); });
  EXPECT_EQ(**Connect(path_)->QueryInt64("SELECT count(*) FROM layer_styles"), 1);
}

TEST_F(ForeignWritesTest, EndOfWriteAheadLoggingIsUndone) {
  OtherProgram(path_).Execute("PRAGMA journal_mode = DELETE");
  ExpectAdopted([&](const Snapshot& map) { ExpectSame(map, *before_); });
}

TEST_F(ForeignWritesTest, VacuumIsAdopted) {
  OtherProgram(path_).Execute("VACUUM");
  ExpectAdopted([&](const Snapshot& map) { ExpectSame(map, *before_); });
}

// As `sqlite3 site.gpkg` does after a crash of the server, only by looking into the file.
TEST_F(ForeignWritesTest, LogThatAnotherProgramMovedIntoTheFileIsAdopted) {
  const testing::TemporaryFolder crashed;
  {
    auto map = store_->Open("site");
    ASSERT_TRUE(map.ok()) << map.status();
    const Commit commit = MakeCommit(*before_, {{PutObject{"s", UnitSquare("table"), ""}}});
    ASSERT_TRUE((*map)->Write({commit}).ok());
    before_ = commit.applied.snapshot;
    for (const char* suffix : {"", "-wal"}) {
      WriteFile(crashed / "site.gpkg" + suffix, ReadFile(path_ + suffix));
    }
  }
  for (const char* suffix : {"", "-wal"}) {
    WriteFile(path_ + suffix, ReadFile(crashed / "site.gpkg" + suffix));
  }
  OtherProgram(path_).Execute("SELECT count(*) FROM s");
  EXPECT_FALSE(std::filesystem::exists(path_ + "-wal"));
  ExpectAdopted([&](const Snapshot& map) { ExpectSame(map, *before_); });
}

TEST_F(ForeignWritesTest, IndexOfAFileThatWasWrittenIsRepaired) {
  OtherProgram(path_).Execute("UPDATE s SET label = 'sofa'; DELETE FROM rtree_s_geom WHERE id < 9");
  const auto repaired = RepairMapFile(path_, nullptr);
  ASSERT_TRUE(repaired.ok()) << repaired.status();
  EXPECT_FALSE(repaired->before.findings.empty());
  EXPECT_THAT(repaired->after.findings, IsEmpty());
  ExpectAdopted([](const Snapshot& map) { EXPECT_EQ(map.FindLayer("s")->Size(), 40u); });
}

TEST_F(ForeignWritesTest, ChangeOfOurOwnTablesIsDamage) {
  OtherProgram(path_).Execute("UPDATE hypermap_revisions SET author = 'nobody'");
  const auto map = store_->Open("site");
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_EQ((*map)->damage().code(), absl::StatusCode::kDataLoss) << (*map)->damage();
  EXPECT_THAT(std::string((*map)->damage().message()), HasSubstr("(in hypermap_revisions)"));
}

TEST_F(ForeignWritesTest, DamageOfAFileThatWasWrittenIsFoundAsFarAsPossible) {
  OtherProgram(path_).Execute("UPDATE s SET label = 'sofa' WHERE id = 3");
  // The type of a page, at its beginning.
  const int64_t root =
      **Connect(path_)->QueryInt64("SELECT rootpage FROM sqlite_master WHERE name = 's'");
  FlipBit((root - 1) * 4096, 6);
  const auto map = store_->Open("site");
  EXPECT_EQ(map.status().code(), absl::StatusCode::kDataLoss) << map.status();
  EXPECT_TRUE(IsWritten());
}

// As by a dump of the database and its restoration.
TEST_F(ForeignWritesTest, FileWithoutChecksumsGetsThem) {
  const std::string plain = folder_ / "plain.gpkg";
  {
    sqlite3* handle = nullptr;
    ASSERT_EQ(
        sqlite3_open_v2(plain.c_str(), &handle, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, "unix"),
        SQLITE_OK);
    const std::string golden = ReadFile(GEOPACKAGE_TESTDATA "/map_v8.sql");
    ASSERT_EQ(sqlite3_exec(handle, golden.c_str(), nullptr, nullptr, nullptr), SQLITE_OK);
    sqlite3_close(handle);
  }
  {
    auto map = store_->Open("plain");
    ASSERT_TRUE(map.ok()) << map.status();
    EXPECT_TRUE((*map)->Load().ok());
  }
  const auto database = Connect(plain);
  ASSERT_TRUE(database->QueryInt64("SELECT count(*) FROM hypermap_metadata").ok());
  EXPECT_TRUE(KeepsChecksums(database->handle()));
  EXPECT_FALSE(std::filesystem::exists(plain + ".schema-8"));
  EXPECT_FALSE(std::filesystem::exists(plain + ".new"));
}

TEST_F(ForeignWritesTest, CheckNamesDamagedPagesAndTheirTables) {
  std::vector<::testing::Matcher<std::string>> expected;
  for (const char* table : {"s", "hypermap_object_history", "rtree_s_geom_node"}) {
    const int64_t root =
        **Connect(path_)->QueryInt64("SELECT rootpage FROM sqlite_master WHERE name = ?", table);
    FlipBit((root - 1) * 4096 + 4000, 2);
    expected.push_back(::testing::AllOf(HasSubstr(absl::StrCat("page ", root, " of the file")),
                                        HasSubstr(absl::StrCat("(in ", table, ")"))));
  }
  const auto report = CheckMapFile(path_, nullptr);
  ASSERT_TRUE(report.ok()) << report.status();
  std::vector<std::string> pages;
  for (const Finding& finding : report->findings) {
    if (finding.table.empty()) pages.push_back(finding.problem);
  }
  EXPECT_THAT(pages, ::testing::IsSupersetOf(expected));
  EXPECT_EQ(RepairMapFile(path_, nullptr).status().code(), absl::StatusCode::kFailedPrecondition);
}

// Opening checks every page, so that no flipped bit is served.
TEST_F(ForeignWritesTest, EveryFlippedBitIsFoundOrHarmless) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  const std::string intact = ReadFile(path_);
  int found = 0;
  for (int i = 0; i < 80; ++i) {
    const int64_t byte = UniformInt(rng, 0, static_cast<int>(intact.size()) - 1);
    FlipBit(byte, UniformInt(rng, 0, 7));
    SCOPED_TRACE(::testing::Message() << "byte " << byte);
    auto map = store_->Open("site");
    const auto loaded = map.ok() ? (*map)->Load() : map.status();
    bool is_found = !loaded.ok();
    if (loaded.ok()) {
      Snapshot intact_part = *before_;
      for (const auto& [name, layer] : (*loaded)->damaged) intact_part.layers.erase(name);
      ExpectSame(**loaded, intact_part);
      is_found = absl::IsDataLoss((*map)->damage());
      EXPECT_TRUE(is_found || (*loaded)->damaged.empty());
    } else {
      EXPECT_THAT(loaded.status().code(), ::testing::AnyOf(absl::StatusCode::kDataLoss,
                                                           absl::StatusCode::kFailedPrecondition));
    }
    const auto report = CheckMapFile(path_, nullptr);
    if (map.ok()) *map = nullptr;
    if (is_found) ++found;
    if (is_found && report.ok()) {
      ASSERT_FALSE(report->findings.empty());
    }
    WriteFile(path_, intact);
  }
  EXPECT_GT(found, 60);
}

}  // namespace
}  // namespace hypermap::storage
