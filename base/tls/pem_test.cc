#include "base/tls/pem.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "tests/support/certificates.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::tls {
namespace {

using ::hypermap::testing::CertificateAuthority;
using ::hypermap::testing::Contents;
using ::hypermap::testing::TemporaryFolder;

class PemTest : public ::testing::Test {
 protected:
  PemTest() {
    const CertificateAuthority root(folder_, "root");
    root.Sign("a");
    root.Sign("b");
  }

  std::string Read(const std::string& name) const { return Contents(folder_ / name); }

  TemporaryFolder folder_;
};

TEST_F(PemTest, CertificatesAreKnown) {
  EXPECT_EQ(CheckCertificates(Read("a.pem")), absl::OkStatus());
  EXPECT_EQ(CheckCertificates("a comment\n" + Read("a.pem") + Read("root.pem")), absl::OkStatus());
  const std::string a = Read("a.pem");
  for (const std::string& wrong : {std::string(), std::string("text"), Read("a.key"),
                                   a.substr(0, a.size() / 2), std::string("\0\xff", 2)}) {
    EXPECT_TRUE(absl::IsInvalidArgument(CheckCertificates(wrong))) << wrong;
  }
}

TEST_F(PemTest, KeyBelongsToTheFirstCertificate) {
  EXPECT_EQ(CheckKey(Read("a.key"), Read("a.pem") + Read("b.pem")), absl::OkStatus());
  EXPECT_TRUE(absl::IsInvalidArgument(CheckKey(Read("b.key"), Read("a.pem") + Read("b.pem"))));
  EXPECT_TRUE(absl::IsInvalidArgument(CheckKey(Read("a.pem"), Read("a.pem"))));
  EXPECT_TRUE(absl::IsInvalidArgument(CheckKey("", Read("a.pem"))));
}

TEST_F(PemTest, EncryptedKeyIsRefusedAndNobodyAskedForItsPassword) {
  const std::string command = "openssl pkey -aes256 -passout pass:secret -in " + folder_ / "a.key" +
                              " -out " + folder_ / "encrypted.key";
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_TRUE(absl::IsInvalidArgument(CheckKey(Read("encrypted.key"), Read("a.pem"))));
}

}  // namespace
}  // namespace hypermap::tls
