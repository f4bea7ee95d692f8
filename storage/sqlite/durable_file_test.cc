#include "storage/sqlite/durable_file.h"

#include <cerrno>
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

TEST(FindPathTest, PathThatCannotBeLookedForIsNotTakenForMissing) {
  const testing::TemporaryFolder folder;
  Write(folder / "file", "text");
  EXPECT_TRUE(FindPath(folder / "file").value());
  EXPECT_FALSE(FindPath(folder / "none").value());
  EXPECT_FALSE(FindPath(folder / "file/none").value());
  std::filesystem::create_symlink("loop", folder / "loop");
  EXPECT_TRUE(FindPath(folder / "loop").value());
  EXPECT_FALSE(FindPath(folder / "loop/file").ok());
  EXPECT_TRUE(PathExists(folder / "loop/file"));
  // Otherwise the file could take the place of one that is there.
  EXPECT_FALSE(PublishFile(folder / "file", folder / "loop/file").ok());
  EXPECT_EQ(Read(folder / "file"), "text");
}

TEST(FileErrorTest, TellsWhetherARetryMakesSense) {
  EXPECT_TRUE(absl::IsUnavailable(FileError(EIO, "x")));
  EXPECT_TRUE(absl::IsResourceExhausted(FileError(ENOSPC, "x")));
  EXPECT_TRUE(absl::IsResourceExhausted(FileError(EMFILE, "x")));
  EXPECT_TRUE(absl::IsFailedPrecondition(FileError(EROFS, "x")));
  EXPECT_TRUE(absl::IsPermissionDenied(FileError(EACCES, "x")));
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
