// Tests of the files that hypermapd gets for TLS.
#include "base/tls/server_credentials.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/support/certificates.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::tls {
namespace {

using ::hypermap::testing::CertificateAuthority;
using ::hypermap::testing::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

class ServerFilesTest : public ::testing::Test {
 protected:
  ServerFilesTest() {
    const CertificateAuthority root(folder_, "root");
    root.Sign("server");
    root.Sign("other");
    folder_.Write("text.pem", "no certificate\n");
  }

  ServerFiles Files(const std::string& certificate, const std::string& key,
                    const std::string& client_ca = "") const {
    const auto path = [this](const std::string& name) {
      return name.empty() ? name : folder_ / name;
    };
    return {path(certificate), path(key), path(client_ca)};
  }

  // Expects an error whose message contains both the flag and the word.
  void ExpectRefused(const ServerFiles& files, const std::string& flag, const std::string& word) {
    const absl::Status status = CheckServerFiles(files);
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << status;
    EXPECT_THAT(std::string(status.message()), AllOf(HasSubstr(flag), HasSubstr(word)));
  }

  TemporaryFolder folder_;
};

TEST_F(ServerFilesTest, FitTogether) {
  EXPECT_EQ(CheckServerFiles({}), absl::OkStatus());
  EXPECT_EQ(CheckServerFiles(Files("server.pem", "server.key")), absl::OkStatus());
  EXPECT_EQ(CheckServerFiles(Files("server.pem", "server.key", "root.pem")), absl::OkStatus());
}

TEST_F(ServerFilesTest, OneWithoutTheOtherIsRefused) {
  ExpectRefused(Files("server.pem", ""), "--tls_key", "missing");
  ExpectRefused(Files("", "server.key"), "--tls_cert", "missing");
  ExpectRefused(Files("", "", "root.pem"), "--tls_client_ca", "needs --tls_cert");
}

TEST_F(ServerFilesTest, AuthoritiesAreFilesOfCertificates) {
  EXPECT_EQ(CheckAuthorities("--peer_ca", ""), absl::OkStatus());
  EXPECT_EQ(CheckAuthorities("--peer_ca", folder_ / "root.pem"), absl::OkStatus());
  const absl::Status status = CheckAuthorities("--peer_ca", folder_ / "text.pem");
  EXPECT_TRUE(absl::IsInvalidArgument(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("--peer_ca"));
}

TEST_F(ServerFilesTest, MissingFilesAreNamed) {
  ExpectRefused(Files("gone.pem", "server.key"), "--tls_cert", "gone.pem: No such file");
  ExpectRefused(Files("server.pem", "gone.key"), "--tls_key", "gone.key: No such file");
  ExpectRefused(Files("server.pem", "server.key", "gone.pem"), "--tls_client_ca", "gone.pem");
}

TEST_F(ServerFilesTest, WhatIsNoCertificateOrKeyIsNamed) {
  ExpectRefused(Files("text.pem", "server.key"), "--tls_cert", "no certificate");
  ExpectRefused(Files("server.key", "server.key"), "--tls_cert", "no certificate");
  ExpectRefused(Files("server.pem", "text.pem"), "--tls_key", "no private key");
  ExpectRefused(Files("server.pem", "server.key", "text.pem"), "--tls_client_ca", "no certificate");
}

TEST_F(ServerFilesTest, KeyOfAnotherCertificateIsRefused) {
  ExpectRefused(Files("server.pem", "other.key"), "--tls_key", "is not the key of the certificate");
}

}  // namespace
}  // namespace hypermap::tls
