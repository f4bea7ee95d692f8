#include "storage/sqlite/page_checksums.h"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/sqlite/sqlite.h"
#include "tests/support/random_map.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::UniformInt;
using ::testing::HasSubstr;

constexpr int64_t kPageBytes = 4096;

std::unique_ptr<Database> OpenDatabase(const std::string& path,
                                       Database::OpenMode mode = Database::OpenMode::kCreate) {
  auto database = Database::Open(path, mode, absl::ZeroDuration());
  EXPECT_TRUE(database.ok()) << database.status();
  return *std::move(database);
}

// A connection of a program that knows no checksums.
class PlainConnection {
 public:
  explicit PlainConnection(const std::string& path) {
    EXPECT_EQ(
        sqlite3_open_v2(path.c_str(), &handle_, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, "unix"),
        SQLITE_OK);
  }
  ~PlainConnection() { sqlite3_close(handle_); }

  void Execute(const std::string& sql) {
    EXPECT_EQ(sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
        << sqlite3_errmsg(handle_);
  }

 private:
  sqlite3* handle_ = nullptr;
};

constexpr char kFill[] = R"sql(
CREATE TABLE t (id INTEGER PRIMARY KEY, name TEXT UNIQUE, body BLOB);
WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 300)
  INSERT INTO t SELECT i, 'name ' || i, randomblob(i * 37 % 9000) FROM n;
)sql";

constexpr char kReadAll[] = "SELECT sum(length(hex(body)) + length(name)) FROM t NOT INDEXED";

void FlipBit(const std::string& path, int64_t byte, int bit) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekg(byte);
  const int value = file.get();
  file.seekp(byte);
  file.put(static_cast<char>(value ^ 1 << bit));
}

class PageChecksumsTest : public ::testing::Test {
 protected:
  void MakeFile() { ASSERT_TRUE(OpenDatabase(path_)->Execute(kFill).ok()); }
  absl::Status ReadAll() {
    return OpenDatabase(path_, Database::OpenMode::kExisting)->QueryInt64(kReadAll).status();
  }

  const testing::TemporaryFolder folder_;
  const std::string path_ = folder_ / "x.sqlite";
};

TEST_F(PageChecksumsTest, AreThoseOfSqlitesExtension) {
  // From the definition in the documentation of cksumvfs, computed by hand for the words
  // 1, 2, 3, 4 and zeros: s1 = 1, s2 = 3, s1 = 7, s2 = 14, and then each adds the other.
  std::vector<unsigned char> page(512, 0);
  for (int i = 0; i < 4; ++i) page[4 * i] = static_cast<unsigned char>(i + 1);
  SetPageChecksum(absl::MakeSpan(page));
  uint32_t s1 = 7;
  uint32_t s2 = 14;
  for (int i = 0; i < (512 - 8 - 16) / 8; ++i) {
    s1 += s2;
    s2 += s1;
  }
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(page[504 + i], s1 >> (8 * i) & 0xff);
    EXPECT_EQ(page[508 + i], s2 >> (8 * i) & 0xff);
  }
  EXPECT_TRUE(HasValidChecksum(page));
  page[100] ^= 1;
  EXPECT_FALSE(HasValidChecksum(page));
}

TEST_F(PageChecksumsTest, EveryFlippedBitOfAReadPageIsToldWithThePage) {
  MakeFile();
  const uint64_t seed = testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  testing::Rng rng(seed);
  const auto size = static_cast<int>(std::filesystem::file_size(path_));
  int told = 0;
  for (int i = 0; i < 200; ++i) {
    // The first bytes of a file tell whether it has checksums.
    const int byte = UniformInt(rng, 100, size - 1);
    const int bit = UniformInt(rng, 0, 7);
    FlipBit(path_, byte, bit);
    const auto database = OpenDatabase(path_, Database::OpenMode::kExisting);
    // Reads the index as well.
    const auto check = database->Prepare("PRAGMA integrity_check");
    ASSERT_TRUE(check.ok() || absl::IsDataLoss(check.status())) << check.status();
    const absl::Status read = database->QueryInt64(kReadAll).status();
    const absl::Status index =
        database->QueryInt64("SELECT count(DISTINCT name) FROM t INDEXED BY sqlite_autoindex_t_1")
            .status();
    const std::string page = absl::StrCat("page ", byte / kPageBytes + 1, " of the file");
    const absl::Status& status = read.ok() ? index : read;
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << byte << ": " << status;
    if (absl::IsDataLoss(status)) ++told;
    EXPECT_THAT(std::string(status.message()), HasSubstr(page));
    FlipBit(path_, byte, bit);
  }
  EXPECT_EQ(told, 200);
  EXPECT_TRUE(ReadAll().ok());
}

TEST_F(PageChecksumsTest, StayValidWithAnyJournal) {
  MakeFile();
  for (const char* mode : {"DELETE", "WAL", "MEMORY", "WAL", "TRUNCATE"}) {
    SCOPED_TRACE(mode);
    {
      const auto database = OpenDatabase(path_);
      ASSERT_TRUE(database->Execute(absl::StrCat("PRAGMA journal_mode = ", mode)).ok());
      ASSERT_TRUE(database
                      ->Execute("UPDATE t SET body = randomblob(3000) WHERE id % 7 = 0; "
                                "DELETE FROM t WHERE id % 31 = 0; CREATE INDEX i ON t (body); "
                                "BEGIN; UPDATE t SET name = name || 'x'; ROLLBACK; DROP INDEX i")
                      .ok());
      EXPECT_TRUE(database->QueryInt64(kReadAll).ok());
    }
    EXPECT_TRUE(ReadAll().ok());
    const auto database = OpenDatabase(path_, Database::OpenMode::kExisting);
    auto check = database->Prepare("PRAGMA integrity_check");
    ASSERT_TRUE(check.ok() && *check->Step());
    EXPECT_EQ(check->Text(0), "ok");
  }
}

TEST_F(PageChecksumsTest, CopiesHaveThemToo) {
  PlainConnection(path_).Execute(kFill);
  const std::string copy = folder_ / "copy.sqlite";
  {
    const auto database = OpenDatabase(path_, Database::OpenMode::kReadOnly);
    ASSERT_TRUE(database->QueryInt64(kReadAll).ok());
    EXPECT_FALSE(KeepsChecksums(database->handle()));
    ASSERT_TRUE(database->Run("VACUUM INTO ?", copy).ok());
  }
  const auto database = OpenDatabase(copy, Database::OpenMode::kReadOnly);
  EXPECT_TRUE(database->QueryInt64(kReadAll).ok());
  EXPECT_TRUE(KeepsChecksums(database->handle()));
}

// Then pages are written, and read again, before the header.
TEST_F(PageChecksumsTest, NewFilesThatAreLargerThanTheCacheHaveThem) {
  const std::string copy = folder_ / "copy.sqlite";
  {
    const auto database = OpenDatabase(path_);
    ASSERT_TRUE(database->Execute("PRAGMA cache_size = 10").ok());
    ASSERT_TRUE(database->Execute(absl::StrCat("BEGIN;", kFill, "COMMIT")).ok());
    ASSERT_TRUE(database->QueryInt64(kReadAll).ok());
    ASSERT_TRUE(database->Run("VACUUM INTO ?", copy).ok());
  }
  EXPECT_TRUE(ReadAll().ok());
  const auto database = OpenDatabase(copy, Database::OpenMode::kReadOnly);
  const auto sum = database->QueryInt64(kReadAll);
  EXPECT_TRUE(sum.ok()) << sum.status();
}

TEST_F(PageChecksumsTest, OtherProgramsReadTheFile) {
  MakeFile();
  PlainConnection(path_).Execute("SELECT sum(length(body)) FROM t");
  EXPECT_TRUE(ReadAll().ok());
}

TEST_F(PageChecksumsTest, WhatOtherProgramsWroteIsAdopted) {
  MakeFile();
  PlainConnection(path_).Execute("UPDATE t SET body = randomblob(2000) WHERE id % 50 = 0");
  EXPECT_EQ(ReadAll().code(), absl::StatusCode::kDataLoss);
  {
    const auto database = OpenDatabase(path_, Database::OpenMode::kExisting);
    const UnverifiedReads here(database->handle());
    const auto sum = database->QueryInt64(kReadAll);
    ASSERT_TRUE(sum.ok()) << sum.status();
    const auto adopted = AdoptPages(database->handle());
    ASSERT_TRUE(adopted.ok()) << adopted.status();
    EXPECT_GT(*adopted, 0);
    EXPECT_EQ(*AdoptPages(database->handle()), 0);
  }
  EXPECT_TRUE(ReadAll().ok());
}

TEST_F(PageChecksumsTest, FilesWithoutThemAreReadAsBefore) {
  PlainConnection(path_).Execute(kFill);
  EXPECT_TRUE(ReadAll().ok());
  ASSERT_TRUE(OpenDatabase(path_)->Execute("UPDATE t SET body = x'00'").ok());
  PlainConnection(path_).Execute("UPDATE t SET body = randomblob(100)");
  EXPECT_TRUE(ReadAll().ok());
}

}  // namespace
}  // namespace hypermap::storage
