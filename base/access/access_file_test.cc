#include "base/access/access_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::access {
namespace {

using ::testing::HasSubstr;

class AccessFileTest : public ::testing::Test {
 protected:
  absl::Status AddIdentity(const std::string& name) {
    return ChangeAccessFile(path_, [&](AccessTable& table) {
      IdentityRecord record;
      record.identity.name = name;
      return table.Add(record);
    });
  }

  hypermap::testing::TemporaryFolder folder_;
  const std::string path_ = folder_ / "access.yaml";
};

TEST_F(AccessFileTest, IsMadeByTheFirstChange) {
  EXPECT_TRUE(absl::IsNotFound(ReadAccessFile(path_).status()));
  ASSERT_TRUE(AddIdentity("anna").ok());
  ASSERT_TRUE(AddIdentity("bert").ok());
  EXPECT_EQ(ReadAccessFile(path_).value().records().size(), 2);
  struct stat status;
  ASSERT_EQ(stat(path_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0007, 0);
}

TEST_F(AccessFileTest, IsAsItWasAfterAnError) {
  ASSERT_TRUE(AddIdentity("anna").ok());
  EXPECT_TRUE(absl::IsAlreadyExists(AddIdentity("anna")));
  EXPECT_EQ(ReadAccessFile(path_).value().records().size(), 1);
}

TEST_F(AccessFileTest, ErrorsNameTheFile) {
  std::ofstream(path_) << "identities: 3";
  const absl::Status status = ReadAccessFile(path_).status();
  EXPECT_TRUE(absl::IsInvalidArgument(status));
  EXPECT_THAT(status.message(), HasSubstr(absl::StrCat(path_, ": line 1")));
  EXPECT_TRUE(absl::IsInvalidArgument(AddIdentity("anna")));
}

TEST_F(AccessFileTest, MustNotBeWrittenByAll) {
  ASSERT_TRUE(AddIdentity("anna").ok());
  ASSERT_EQ(chmod(path_.c_str(), 0666), 0);
  EXPECT_THAT(ReadAccessFile(path_).status().message(), HasSubstr("may be written by all users"));
}

TEST_F(AccessFileTest, ManyChangeItAtOnce) {
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&, i] {
      for (int j = 0; j < 10; ++j) EXPECT_TRUE(AddIdentity(absl::StrCat(i, "-", j)).ok());
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(ReadAccessFile(path_).value().records().size(), 80);
}

}  // namespace
}  // namespace hypermap::access
