#include "server/services/uploaded_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "tests/support/temporary_folder.h"

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

class UploadedFilesTest : public ::testing::Test {
 protected:
  UploadedFilesTest()
      : facilities_{nullptr,           {}, nullptr, folder_.path(), &budgets_, /*access=*/nullptr,
                    /*meters=*/nullptr} {
    facilities_.limits.max_import_bytes = 60;
  }

  hypermap::testing::TemporaryFolder folder_;
  Budgets budgets_{[] {
    Limits limits;
    limits.max_scratch_bytes = 200;
    return limits;
  }()};
  Facilities facilities_;
};

TEST_F(UploadedFilesTest, PiecesAreReadBackAsFilesAndRemovedAtTheEnd) {
  std::optional<UploadedFiles> files(std::in_place, facilities_, "10.0.0.1");
  const std::string binary("\0\n\xff", 3);
  ASSERT_TRUE(files->Append("map.yaml", "image: ").ok());
  ASSERT_TRUE(files->Append("map.yaml", "map.png").ok());
  ASSERT_TRUE(files->Append("map.png", binary).ok());
  ASSERT_TRUE(files->Append("empty", "").ok());
  const auto read = files->Read();
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->size(), 3u);
  EXPECT_EQ((*read)[0].name, "map.yaml");
  EXPECT_EQ((*read)[0].data, "image: map.png");
  EXPECT_EQ((*read)[1].data, binary);
  EXPECT_EQ((*read)[2].data, "");
  EXPECT_EQ(budgets_.scratch_bytes.used(), 17);
  files.reset();
  EXPECT_THAT(folder_.Names(), IsEmpty());
  EXPECT_EQ(budgets_.scratch_bytes.used(), 0);
}

TEST_F(UploadedFilesTest, RemovedFilesTakeNoRoom) {
  UploadedFiles files(facilities_, "10.0.0.1");
  ASSERT_TRUE(files.Append("map.yaml", "image: ").ok());
  ASSERT_TRUE(files.Append("map.png", "x").ok());
  files.Remove();
  EXPECT_THAT(folder_.Names(), IsEmpty());
  EXPECT_EQ(budgets_.scratch_bytes.used(), 0);
}

TEST_F(UploadedFilesTest, B6UploadsTogetherStayBelowTheBudgetForScratchFiles) {
  UploadedFiles first(facilities_, "10.0.0.1");
  UploadedFiles second(facilities_, "10.0.0.1");
  EXPECT_TRUE(first.Append("a", std::string(60, 'x')).ok());
  EXPECT_TRUE(second.Append("a", std::string(40, 'x')).ok());
  const absl::Status status = second.Append("a", "x");
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), HasSubstr("--max_scratch_bytes"));
  UploadedFiles other(facilities_, "10.0.0.2");
  EXPECT_TRUE(other.Append("a", std::string(60, 'x')).ok());
}

TEST_F(UploadedFilesTest, OneImportIsLimitedToo) {
  UploadedFiles files(facilities_, "10.0.0.1");
  const absl::Status status = files.Append("a", std::string(61, 'x'));
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), HasSubstr("--max_import_bytes, 60"));
}

TEST_F(UploadedFilesTest, NamesOfFilesAreChecked) {
  UploadedFiles files(facilities_, "10.0.0.1");
  ASSERT_TRUE(files.Append("a", "1").ok());
  ASSERT_TRUE(files.Append("b", "1").ok());
  for (const char* name : {"", "x/y", "..\\y", "a"}) {
    EXPECT_EQ(files.Append(name, "1").code(), absl::StatusCode::kInvalidArgument) << name;
  }
  EXPECT_TRUE(files.Append(std::string(255, 'x'), "1").ok());
  EXPECT_EQ(files.Append(std::string(256, 'y'), "1").code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace hypermap::server
