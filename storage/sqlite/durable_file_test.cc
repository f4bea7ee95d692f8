#include "storage/sqlite/durable_file.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "gtest/gtest.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::storage {
namespace {

void Write(const std::string& path, const std::string& text) { std::ofstream(path) << text; }

std::string Read(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(ReplaceFileTest, TakesThePlaceOfTheOther) {
  const testing::TemporaryFolder folder;
  Write(folder / "new", "new");
  Write(folder / "file", "old");
  ASSERT_TRUE(ReplaceFile(folder / "new", folder / "file").ok());
  EXPECT_EQ(Read(folder / "file"), "new");
  EXPECT_FALSE(PathExists(folder / "new"));
  EXPECT_TRUE(absl::IsNotFound(ReplaceFile(folder / "none", folder / "file")));
  EXPECT_EQ(Read(folder / "file"), "new");
}

TEST(LinkOrCopyFileTest, BothNamesHaveTheContent) {
  const testing::TemporaryFolder folder;
  Write(folder / "file", "text");
  ASSERT_TRUE(LinkOrCopyFile(folder / "file", folder / "kept").ok());
  Write(folder / "new", "new");
  ASSERT_TRUE(ReplaceFile(folder / "new", folder / "file").ok());
  EXPECT_EQ(Read(folder / "kept"), "text");
  EXPECT_EQ(Read(folder / "file"), "new");
}

TEST(LinkOrCopyFileTest, NothingIsOverwritten) {
  const testing::TemporaryFolder folder;
  Write(folder / "file", "text");
  Write(folder / "kept", "other");
  EXPECT_FALSE(LinkOrCopyFile(folder / "file", folder / "kept").ok());
  EXPECT_EQ(Read(folder / "kept"), "other");
  EXPECT_FALSE(LinkOrCopyFile(folder / "none", folder / "new").ok());
  EXPECT_FALSE(PathExists(folder / "new"));
}

}  // namespace
}  // namespace hypermap::storage
