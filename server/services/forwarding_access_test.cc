// Tests of who a call comes from that one server passes on to another.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/access/token.h"
#include "base/tls/channel_credentials.h"
#include "server/auth/metadata.h"
#include "server/services/testing/test_server.h"
#include "tests/support/certificates.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::server {
namespace {

using ::hypermap::testing::CertificateAuthority;
using ::hypermap::testing::TemporaryFolder;
using ::testing::HasSubstr;

grpc::StatusCode CodeOf(const grpc::Status& status) { return status.error_code(); }

// A change of the map "site".
grpc::Status Edit(const std::shared_ptr<grpc::Channel>& channel, grpc::ClientContext* context) {
  v1::SetTransformRequest request;
  request.set_map("site");
  request.mutable_transform()->set_parent_frame_id("map");
  request.mutable_transform()->set_child_frame_id("dock");
  request.mutable_transform()->mutable_parent_from_child()->set_x(1);
  v1::SetTransformResponse response;
  return v1::CatalogService::NewStub(channel)->SetTransform(context, request, &response);
}

// The author of the newest change of the map "site", of which there must be one.
std::string NewestAuthor(TestServer& server) {
  MapSession& session = **server.site().Find("site");
  const auto reader = session.OpenHistory();
  EXPECT_TRUE(reader.ok());
  const Revision newest = session.snapshot()->revision;
  const auto records = (*reader)->Revisions(newest - 1, newest + 1, false, 1);
  return records.ok() && !records->empty() ? records->front().author : "nobody";
}

// Makes the map "site" on both servers, of which the first is its owner.
void ShareMap(TestServer& owner, TestServer& other) {
  for (TestServer* server : {&owner, &other}) server->MakeMap("site", LayerOfCups("cups", 1));
  (*other.site().Find("site"))->SetOwner(owner.address());
}

class ForwardedTokenTest : public ::testing::Test {
 protected:
  // Adds an identity to the file of identities, and returns its token.
  std::string Add(const std::string& name, const std::string& role, const std::string& maps = "*") {
    const access::NewToken token = access::MakeToken().value();
    absl::StrAppend(&identities_, "  - name: ", name, "\n    role: ", role, "\n    maps: [\"", maps,
                    "\"]\n    tokens:\n      - id: ", token.id, "\n        sha256: ", token.digest,
                    "\n        created: 2026-11-27T09:00:00Z\n");
    return token.text;
  }
  TestAccess Access() const {
    folder_.Write("access.yaml", identities_);
    return {folder_ / "access.yaml"};
  }
  static grpc::Status EditBy(TestServer& server, const std::string& token) {
    grpc::ClientContext context;
    if (!token.empty()) context.AddMetadata("authorization", absl::StrCat("Bearer ", token));
    return Edit(server.channel(), &context);
  }
  static int64_t Forwarded(const TestServer& server) {
    return server.meters().Read(Rpc::kSetTransform).forwarded;
  }

  TemporaryFolder folder_;
  std::string identities_ = "identities:\n";
};

TEST_F(ForwardedTokenTest, TheAuthorIsTheIdentityOfTheCaller) {
  const std::string anna = Add("anna", "editor");
  TestServer owner({}, 1 << 20, {}, Access());
  TestServer other({}, 1 << 20, {}, Access());
  ShareMap(owner, other);
  const grpc::Status status = EditBy(other, anna);
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(NewestAuthor(owner), "anna");
}

TEST_F(ForwardedTokenTest, WhatACallerMayNotDoIsRefusedByTheFirstServer) {
  const std::string rita = Add("rita", "reader");
  const std::string hans = Add("hans", "editor", "hall-*");
  TestServer owner({}, 1 << 20, {}, Access());
  TestServer other({}, 1 << 20, {}, Access());
  ShareMap(owner, other);
  EXPECT_EQ(CodeOf(EditBy(other, rita)), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(CodeOf(EditBy(other, hans)), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(CodeOf(EditBy(other, "")), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(Forwarded(other), 0);
}

TEST_F(ForwardedTokenTest, TheOwnerChecksTheCallerToo) {
  const std::string anna = Add("anna", "reader");
  TestServer owner({}, 1 << 20, {}, Access());
  const std::string bert = Add("bert", "editor");
  TestServer other({}, 1 << 20, {}, Access());
  ShareMap(owner, other);
  EXPECT_EQ(CodeOf(EditBy(other, bert)), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(Forwarded(other), 1);
}

// Servers whose clients show certificates, of which one may pass calls on to the other.
class ForwardedCertificateTest : public ::testing::Test {
 protected:
  ForwardedCertificateTest() {
    const CertificateAuthority root(folder_, "root");
    root.Sign("owner", "IP:127.0.0.1,DNS:owner.example");
    root.Sign("other", "IP:127.0.0.1,DNS:other.example");
    root.Sign("anna", "DNS:anna.example");
    root.Sign("eve", "DNS:eve.example");
    folder_.Write("access.yaml",
                  "identities:\n"
                  "  - {name: anna, role: editor, certificates: [anna.example]}\n"
                  "  - {name: eve, role: reader, certificates: [eve.example]}\n"
                  "  - {name: other, role: admin, certificates: [other.example]}\n");
  }

  std::shared_ptr<grpc::ChannelCredentials> CredentialsOf(const std::string& name) const {
    return tls::MakeChannelCredentials(
        {folder_ / "root.pem", folder_ / (name + ".pem"), folder_ / (name + ".key")});
  }
  TestAccess AccessOf(const std::string& name, std::vector<std::string> peers) const {
    return {folder_ / "access.yaml",
            {folder_ / (name + ".pem"), folder_ / (name + ".key"), folder_ / "root.pem"},
            std::move(peers),
            CredentialsOf(name)};
  }
  std::shared_ptr<grpc::Channel> ChannelOf(const TestServer& server,
                                           const std::string& name) const {
    return grpc::CreateChannel(server.address(), CredentialsOf(name));
  }
  grpc::Status EditBy(TestServer& server, const std::string& name) const {
    grpc::ClientContext context;
    return Edit(ChannelOf(server, name), &context);
  }
  // As a server would call that passes on the call of whoever has this certificate.
  grpc::Status EditFor(TestServer& server, const std::string& name,
                       const std::string& certificate) const {
    grpc::ClientContext context;
    context.AddMetadata(kForwardedKey, "1");
    if (!certificate.empty()) context.AddMetadata(kCallerCertificateKey, certificate);
    return Edit(ChannelOf(server, name), &context);
  }

  TemporaryFolder folder_;
};

TEST_F(ForwardedCertificateTest, ATrustedServerTellsTheCertificateOfTheCaller) {
  TestServer owner({}, 1 << 20, {}, AccessOf("owner", {"other.example"}));
  TestServer other({}, 1 << 20, {}, AccessOf("other", {}));
  ShareMap(owner, other);
  const grpc::Status status = EditBy(other, "anna");
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(NewestAuthor(owner), "anna");
  EXPECT_EQ(CodeOf(EditBy(other, "eve")), grpc::StatusCode::PERMISSION_DENIED);
}

TEST_F(ForwardedCertificateTest, AServerThatIsNotTrustedCanTellNothing) {
  TestServer owner({}, 1 << 20, {}, AccessOf("owner", {}));
  TestServer other({}, 1 << 20, {}, AccessOf("other", {}));
  ShareMap(owner, other);
  const grpc::Status status = EditBy(other, "anna");
  EXPECT_EQ(CodeOf(status), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_THAT(status.error_message(), HasSubstr("--peer_certificates"));
}

TEST_F(ForwardedCertificateTest, AClientCannotNameTheCertificateOfAnother) {
  TestServer owner({}, 1 << 20, {}, AccessOf("owner", {"other.example"}));
  owner.MakeMap("site", LayerOfCups("cups", 1));
  EXPECT_EQ(CodeOf(EditFor(owner, "eve", "anna.example")), grpc::StatusCode::UNAUTHENTICATED);
  // Without the mark of a call that is passed on, the name says nothing.
  grpc::ClientContext context;
  context.AddMetadata(kCallerCertificateKey, "anna.example");
  EXPECT_EQ(CodeOf(Edit(ChannelOf(owner, "eve"), &context)), grpc::StatusCode::PERMISSION_DENIED);
}

TEST_F(ForwardedCertificateTest, TheCertificateOfAServerIsNotTakenForTheCallers) {
  TestServer owner({}, 1 << 20, {}, AccessOf("owner", {"other.example"}));
  owner.MakeMap("site", LayerOfCups("cups", 1));
  EXPECT_TRUE(EditBy(owner, "other").ok());
  EXPECT_EQ(CodeOf(EditFor(owner, "other", "")), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_TRUE(EditFor(owner, "other", "anna.example").ok());
}

}  // namespace
}  // namespace hypermap::server
