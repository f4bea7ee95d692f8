#include "server/rpc/scratch_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
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
