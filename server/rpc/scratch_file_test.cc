#include "server/rpc/scratch_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "tests/support/temporary_folder.h"

namespace hypermap::server {
namespace {

class ScratchFileTest : public ::testing::Test {
 protected:
  const testing::TemporaryFolder directory_;
  const std::string& folder_ = directory_.path();
};

TEST_F(ScratchFileTest, IsRemovedAtTheEnd) {
  {
    const ScratchFile file(folder_);
    EXPECT_FALSE(std::filesystem::exists(file.path()));
    std::ofstream(file.path()) << "content";
    EXPECT_FALSE(std::filesystem::is_empty(folder_));
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(ScratchFileTest, HoldsWhatIsAppended) {
  std::string expected;
  ScratchFile file(folder_);
  for (const size_t size : {0, 1, 65'536, 65'537, 5, 1'000'000}) {
    const std::string bytes(size, static_cast<char>('a' + size % 26));
    ASSERT_TRUE(file.Append(bytes));
    expected += bytes;
    EXPECT_EQ(std::filesystem::file_size(file.path()), expected.size());
    if (size == 1) file.Close();
  }
  std::ifstream stream(file.path(), std::ios::binary);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(stream), {}), expected);
}

TEST_F(ScratchFileTest, IsMadeByTheFirstAppend) {
  ScratchFile file(folder_);
  ASSERT_TRUE(file.Append(""));
  EXPECT_TRUE(std::filesystem::exists(file.path()));
}

TEST_F(ScratchFileTest, TellsThatBytesWereNotWritten) {
  ScratchFile nowhere(folder_ + "/missing");
  EXPECT_FALSE(nowhere.Append("bytes"));
  EXPECT_FALSE(nowhere.Append(""));
}

TEST_F(ScratchFileTest, TwoHaveDifferentNames) {
  EXPECT_NE(ScratchFile(folder_).path(), ScratchFile(folder_).path());
}

TEST_F(ScratchFileTest, LeftOverOnesAreRemovedAndNothingElse) {
  const std::string left_over = ScratchFile(folder_).path();
  std::ofstream(left_over) << "half a copy";
  std::ofstream(folder_ + "/office.gpkg") << "a map";
  ScratchFile::RemoveLeftOver(folder_);
  EXPECT_FALSE(std::filesystem::exists(left_over));
  EXPECT_TRUE(std::filesystem::exists(folder_ + "/office.gpkg"));
}

}  // namespace
}  // namespace hypermap::server
