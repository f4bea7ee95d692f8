#include "server/rpc/author.h"

#include <gtest/gtest.h>

#include <string>

#include "base/limits/limits.h"
#include "server/session/map_session.h"

namespace hypermap::server {
namespace {

TEST(AuthorTest, NamesOfAnyScriptAreTaken) {
  for (const char* author : {"robot-3", "Jürgen Müller", "倉庫"}) {
    EXPECT_TRUE(ValidateAuthor(author).ok()) << author;
  }
}

TEST(AuthorTest, A3NameThatIsNoUtf8IsRefused) {
  EXPECT_EQ(ValidateAuthor("\xff\xfe").message(), "metadata x-hypermap-author is not UTF-8");
}

TEST(AuthorTest, A3LongNameIsRefusedAndNeverCut) {
  EXPECT_TRUE(ValidateAuthor(std::string(FixedLimits::kMaxAuthorLength, 'a')).ok());
  EXPECT_EQ(ValidateAuthor(std::string(FixedLimits::kMaxAuthorLength + 1, 'a')).code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(AuthorTest, A3ControlCharactersAndTheServersNamesAreRefused) {
  for (const char* author : {"a\nb", "\x7f", kExpiryAuthor}) {
    EXPECT_EQ(ValidateAuthor(author).code(), absl::StatusCode::kInvalidArgument) << author;
  }
}

}  // namespace
}  // namespace hypermap::server
