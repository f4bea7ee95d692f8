#include "storage/sqlite/paced_writes.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <string>

namespace hypermap::storage {
namespace {

constexpr int64_t kPiece = PacedWrites::kPieceBytes;

TEST(PacedWritesTest, WhatIsWrittenStaysAsItIs) {
  std::string name = ::testing::TempDir() + "/paced_writes_XXXXXX";
  const int fd = mkstemp(name.data());
  ASSERT_GE(fd, 0);
  unlink(name.c_str());
  const std::string part(100'000, 'x');
  PacedWrites paced;
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(write(fd, part.data(), part.size()), static_cast<ssize_t>(part.size()));
    EXPECT_EQ(paced.Wrote(fd, static_cast<int64_t>(part.size())), 0);
  }
  EXPECT_EQ(lseek(fd, 0, SEEK_END), 2'000'000);
  close(fd);
}

TEST(PacedWritesTest, FilesThatAreOnNoDiskNeedNoPace) {
  int pipe_ends[2];
  ASSERT_EQ(pipe(pipe_ends), 0);
  const int memory = memfd_create("paced_writes_test", 0);
  PacedWrites paced;
  EXPECT_EQ(paced.Wrote(pipe_ends[1], kPiece), 0);
  EXPECT_EQ(paced.Wrote(memory, kPiece), 0);
  for (const int fd : {pipe_ends[0], pipe_ends[1], memory}) close(fd);
}

TEST(PacedWritesTest, ErrorsAreToldOncePerFullPiece) {
  PacedWrites paced;
  EXPECT_EQ(paced.Wrote(-1, kPiece - 1), 0);
  EXPECT_EQ(paced.Wrote(-1, 1), EBADF);
  EXPECT_EQ(paced.Wrote(-1, kPiece - 1), 0);
  // Another file begins anew.
  EXPECT_EQ(paced.Wrote(-2, 1), 0);
  EXPECT_EQ(paced.Wrote(-1, 1), 0);
}

TEST(PacedWritesTest, WritesThatAreSyncedDoNotAddUpToAPiece) {
  PacedWrites paced;
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(paced.Wrote(-1, kPiece - 1), 0);
    paced.Synced();
  }
  EXPECT_EQ(paced.Wrote(-1, kPiece), EBADF);
}

}  // namespace
}  // namespace hypermap::storage
