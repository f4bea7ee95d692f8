#include "storage/interchange/zip_archive.h"

#include <zip.h>

#include "base/limits/limits.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/interchange/testing/archive.h"

namespace hypermap::storage {
namespace {

using ::testing::HasSubstr;
using testing::Zip;

TEST(ZipArchiveTest, ReadsWhatWasWritten) {
  const std::string large(300000, 'x');
  const std::string zip = Zip({{"a", "alpha"}, {"b.png", large}, {"empty", ""}});
  absl::StatusOr<ZipArchive> archive = ZipArchive::Open(zip, Limits());
  ASSERT_TRUE(archive.ok()) << archive.status();
  EXPECT_EQ(*archive->Read("b.png"), large);
  EXPECT_EQ(*archive->Read("a"), "alpha");
  EXPECT_EQ(*archive->Read("empty"), "");
  EXPECT_EQ(archive->Read("c").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(archive->Read("c").status().message()), HasSubstr("\"c\": missing"));
}

TEST(ZipArchiveTest, SameMembersGiveTheSameBytes) {
  EXPECT_EQ(Zip({{"a", "alpha"}}), Zip({{"a", "alpha"}}));
}

TEST(ZipArchiveTest, BoundsWhatAllReadsInflate) {
  const std::string zip = Zip({{"zeros", std::string(1 << 20, '\0')}});
  ASSERT_LT(zip.size(), 2000u);
  Limits limits;
  limits.max_unpacked_bytes = 3 << 20;
  absl::StatusOr<ZipArchive> archive = ZipArchive::Open(zip, limits);
  ASSERT_TRUE(archive.ok());
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(archive->Read("zeros").ok());
  const absl::Status status = archive->Read("zeros").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), HasSubstr("--max_unpacked_bytes"));
}

// The size in the headers is what a reader would allocate that trusts them.
TEST(ZipArchiveTest, DoesNotTrustTheSizeInTheHeaders) {
  std::string zip = Zip({{"zeros", std::string(1 << 20, '\0')}});
  const std::string size("\x00\x00\x10\x00", 4);
  for (size_t at = zip.find(size); at != std::string::npos; at = zip.find(size, at + 4)) {
    zip.replace(at, 4, std::string("\x10\x00\x00\x00", 4));
  }
  Limits limits;
  limits.max_unpacked_bytes = 1 << 16;
  absl::StatusOr<ZipArchive> archive = ZipArchive::Open(zip, limits);
  EXPECT_FALSE(archive.ok() && archive->Read("zeros").ok());
}

TEST(ZipArchiveTest, LimitsMembers) {
  Limits limits;
  limits.max_archive_members = 2;
  EXPECT_TRUE(ZipArchive::Open(Zip({{"a", ""}, {"b", ""}}), limits).ok());
  const std::string three = Zip({{"a", ""}, {"b", ""}, {"c", ""}});
  const absl::Status status = ZipArchive::Open(three, limits).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), HasSubstr("--max_archive_members"));
}

TEST(ZipArchiveTest, RefusesNamesThatLeadOut) {
  for (const char* name : {"../a", "a/../../b", "/etc/passwd", "..", "a\\..\\b"}) {
    const std::string zip = Zip({{name, "x"}});
    const absl::Status status = ZipArchive::Open(zip, Limits()).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << name;
  }
  const std::string zip = Zip({{"a..b", "x"}});
  EXPECT_TRUE(ZipArchive::Open(zip, Limits()).ok());
}

TEST(ZipArchiveTest, RefusesWhatIsNoZip) {
  for (const std::string& data : {std::string(), std::string("PK\x03\x04"), std::string(1000, 'P'),
                                  std::string("layers: []\n")}) {
    EXPECT_EQ(ZipArchive::Open(data, Limits()).status().code(), absl::StatusCode::kInvalidArgument);
  }
}

std::string EncryptedZip() {
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* bytes = zip_source_buffer_create(nullptr, 0, 0, &error);
  zip_t* archive = zip_open_from_source(bytes, ZIP_CREATE | ZIP_TRUNCATE, &error);
  zip_source_keep(bytes);
  zip_source_t* content = zip_source_buffer(archive, "secret", 6, 0);
  const zip_int64_t index = zip_file_add(archive, "a", content, 0);
  zip_file_set_encryption(archive, index, ZIP_EM_AES_256, "word");
  EXPECT_EQ(zip_close(archive), 0);
  zip_stat_t stat;
  zip_source_stat(bytes, &stat);
  std::string zip(stat.size, '\0');
  zip_source_open(bytes);
  zip_source_read(bytes, zip.data(), zip.size());
  zip_source_close(bytes);
  zip_source_free(bytes);
  return zip;
}

TEST(ZipArchiveTest, NamesAnEncryptedMember) {
  const std::string zip = EncryptedZip();
  absl::StatusOr<ZipArchive> archive = ZipArchive::Open(zip, Limits());
  ASSERT_TRUE(archive.ok()) << archive.status();
  const absl::Status status = archive->Read("a").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("member \"a\""));
}

TEST(ZipArchiveTest, FindsDamagedBytes) {
  const std::string content = "0123456789abcdefghijklmnopqrstuvwxyz";
  const std::string zip = Zip({{"a", content}});
  int num_refused = 0;
  for (size_t i = 0; i < zip.size(); ++i) {
    std::string damaged = zip;
    damaged[i] ^= 0x55;
    absl::StatusOr<ZipArchive> archive = ZipArchive::Open(damaged, Limits());
    const absl::StatusOr<std::string> read =
        archive.ok() ? archive->Read("a") : absl::StatusOr<std::string>(archive.status());
    if (read.ok()) {
      EXPECT_EQ(*read, content) << "byte " << i;
    } else {
      ++num_refused;
    }
  }
  EXPECT_GT(num_refused, 30);
}

}  // namespace
}  // namespace hypermap::storage
