// Tests of TLS and tokens: which servers a client trusts, and which credentials it sends.
#include "client_libs/cpp/security.h"

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "base/sync/mutex.h"
#include "client_libs/cpp/client.h"
#include "hypermap/v1/catalog_service.grpc.pb.h"
#include "tests/support/certificates.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::client {
namespace {

using ::hypermap::testing::CertificateAuthority;
using ::hypermap::testing::Contents;
using ::hypermap::testing::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Records the authorization header of each call.
class Doorkeeper : public v1::CatalogService::Service {
 public:
  explicit Doorkeeper(const std::shared_ptr<grpc::ServerCredentials>& credentials) {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", credentials, &port_);
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
  }
  ~Doorkeeper() override { server_->Shutdown(); }

  grpc::Status ListMaps(grpc::ServerContext* context, const v1::ListMapsRequest*,
                        v1::ListMapsResponse*) override {
    return Note(*context);
  }
  grpc::Status BackupMap(grpc::ServerContext* context, const v1::BackupMapRequest*,
                         grpc::ServerWriter<v1::BackupMapResponse>*) override {
    return Note(*context);
  }

  std::string address() const { return absl::StrCat("127.0.0.1:", port_); }
  std::vector<std::string> shown() {
    const MutexLock lock(&mutex_);
    return shown_;
  }

 private:
  grpc::Status Note(const grpc::ServerContext& context) {
    const MutexLock lock(&mutex_);
    const auto& metadata = context.client_metadata();
    const auto it = metadata.find("authorization");
    shown_.push_back(it == metadata.end() ? "" : std::string(it->second.data(), it->second.size()));
    return grpc::Status::OK;
  }

  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
  Mutex mutex_;
  std::vector<std::string> shown_ ABSL_GUARDED_BY(mutex_);
};

// Starts servers with a certificate signed by "root", optionally requiring client certificates.
class TlsTest : public ::testing::Test {
 protected:
  TlsTest() {
    const CertificateAuthority root(folder_, "root");
    root.Sign("server");
    root.Sign("robot");
    const CertificateAuthority other(folder_, "other");
    other.Sign("stranger");
  }

  std::unique_ptr<Doorkeeper> Serve(bool asks_clients) const {
    grpc::SslServerCredentialsOptions options(
        asks_clients ? GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY
                     : GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE);
    options.pem_root_certs = Contents(folder_ / "root.pem");
    options.pem_key_cert_pairs.push_back(
        {Contents(folder_ / "server.key"), Contents(folder_ / "server.pem")});
    return std::make_unique<Doorkeeper>(grpc::SslServerCredentials(options));
  }

  // The status of one call without retries.
  static absl::Status Call(const Doorkeeper& server, TlsOptions tls, TokenSource token = nullptr) {
    ClientOptions options;
    options.retry_for = absl::ZeroDuration();
    options.tls = std::move(tls);
    options.token = std::move(token);
    return Client(server.address(), options).ListMaps().status();
  }

  TemporaryFolder folder_;
};

TEST_F(TlsTest, ServerIsKnownByItsRoot) {
  const auto server = Serve(false);
  EXPECT_EQ(Call(*server, {folder_ / "root.pem"}), absl::OkStatus());
  const absl::Status other = Call(*server, {folder_ / "other.pem"});
  EXPECT_TRUE(absl::IsUnavailable(other)) << other;
  EXPECT_THAT(std::string(other.message()), HasSubstr("certificate verify failed"));
  EXPECT_FALSE(Call(*server, {}).ok()) << "the system must not trust the root of a test";
  EXPECT_THAT(server->shown(), ElementsAre(""));
}

TEST_F(TlsTest, ServerMustHaveTheNameThatIsAskedFor) {
  const auto server = Serve(false);
  TlsOptions tls{.root_certificates = folder_ / "root.pem", .server_name = "localhost"};
  EXPECT_EQ(Call(*server, tls), absl::OkStatus());
  tls.server_name = "elsewhere.example";
  EXPECT_FALSE(Call(*server, tls).ok());
}

TEST_F(TlsTest, ClientShowsItsCertificateToAServerThatAsks) {
  const auto server = Serve(true);
  const std::string root = folder_ / "root.pem";
  EXPECT_EQ(Call(*server, {root, folder_ / "robot.pem", folder_ / "robot.key"}), absl::OkStatus());
  EXPECT_FALSE(Call(*server, {root, folder_ / "stranger.pem", folder_ / "stranger.key"}).ok());
  EXPECT_FALSE(Call(*server, {root}).ok());
  EXPECT_THAT(server->shown(), ElementsAre(""));
}

TEST_F(TlsTest, WhatIsNoCertificateIsSaid) {
  const auto server = Serve(false);
  folder_.Write("text.pem", "no certificate\n");
  const std::string root = folder_ / "root.pem", text = folder_ / "text.pem";
  const std::string robot = folder_ / "robot.pem", key = folder_ / "robot.key";
  const auto refused_as = [](const char* message) { return absl::UnauthenticatedError(message); };
  EXPECT_EQ(Call(*server, {text}), refused_as("the roots to trust: holds no certificate in PEM"));
  EXPECT_EQ(Call(*server, {root, text, key}),
            refused_as("the client's certificate: holds no certificate in PEM"));
  EXPECT_EQ(Call(*server, {root, robot, text}),
            refused_as("the client's key: holds no private key in PEM that is not encrypted"));
  EXPECT_EQ(Call(*server, {root, robot, folder_ / "server.key"}),
            refused_as("the client's key: is not the key of the certificate"));
}

TEST_F(TlsTest, CertificateWithoutItsKeyIsSaid) {
  const auto server = Serve(true);
  const absl::Status status = Call(*server, {folder_ / "root.pem", folder_ / "robot.pem"});
  EXPECT_TRUE(absl::IsUnauthenticated(status)) << status;
}

TEST_F(TlsTest, FileThatIsNotThereIsNamed) {
  const absl::Status status = CheckTls({folder_ / "nothing.pem"});
  EXPECT_TRUE(absl::IsNotFound(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("nothing.pem"));
  EXPECT_FALSE(CheckTls({folder_.path()}).ok());
}

TEST_F(TlsTest, RenewedFilesAreTakenUp) {
  const auto server = Serve(true);
  const auto hold = [this](const std::string& name) {
    folder_.Write("own.pem", Contents(folder_ / (name + ".pem")));
    folder_.Write("own.key", Contents(folder_ / (name + ".key")));
  };
  hold("stranger");
  ClientOptions options;
  options.tls = TlsOptions{folder_ / "root.pem", folder_ / "own.pem", folder_ / "own.key"};
  Client client(server->address(), options);
  EXPECT_FALSE(client.ListMaps({.retry_for = absl::ZeroDuration()}).ok());
  hold("robot");
  EXPECT_EQ(client.ListMaps({.retry_for = absl::Seconds(30)}).status(), absl::OkStatus());
}

TEST_F(TlsTest, TokenGoesWithEachCall) {
  const auto server = Serve(false);
  EXPECT_EQ(Call(*server, {folder_ / "root.pem"}, [] { return "abc"; }), absl::OkStatus());
  EXPECT_THAT(server->shown(), ElementsAre("Bearer abc"));
}

TEST(TokenTest, IsAskedForAnewForEachCall) {
  Doorkeeper server(grpc::InsecureServerCredentials());
  const TemporaryFolder folder;
  folder.Write("token", "first\n");
  Client client(server.address(), {.token = TokenFromFile(folder / "token")});
  EXPECT_TRUE(client.ListMaps().ok());
  folder.Write("token", "second\n");
  ByteReader bytes = client.BackupMap("office");
  EXPECT_EQ(bytes.Next(), std::nullopt);
  EXPECT_TRUE(bytes.status().ok()) << bytes.status();
  EXPECT_THAT(server.shown(), ElementsAre("Bearer first", "Bearer second"));
}

// The statuses of one call of each kind.
std::vector<absl::Status> CallEachWay(Client& client) {
  std::vector<absl::Status> statuses = {client.ListMaps().status()};
  statuses.push_back(client.ImportMap("office", FileFormat::kHmap, {{"a.hmap", "zip"}}).status());
  ByteReader bytes = client.BackupMap("office");
  EXPECT_EQ(bytes.Next(), std::nullopt);
  statuses.push_back(bytes.status());
  statuses.push_back(client.Observe("office", "things").status());
  const std::unique_ptr<PointsStream> points = client.QueryPoints("office");
  statuses.push_back(points->Ask({{{1.0, 2.0}}}).status());
  Watcher watcher = client.Watch("office");
  EXPECT_EQ(watcher.Next(), std::nullopt);
  statuses.push_back(watcher.status());
  return statuses;
}

TEST(TokenTest, WithoutOneNothingIsSent) {
  Doorkeeper server(grpc::InsecureServerCredentials());
  const absl::Status gone = absl::NotFoundError("the login has run out");
  Client client(server.address(), {.token = [gone] { return gone; }});
  EXPECT_THAT(CallEachWay(client), ::testing::Each(absl::UnauthenticatedError(gone.message())));
  EXPECT_THAT(server.shown(), IsEmpty());
}

TEST(TokenTest, WhatAHeaderCantCarryIsRefused) {
  Doorkeeper server(grpc::InsecureServerCredentials());
  for (const char* token : {"", "two words", "line\nbreak", "caf\xc3\xa9"}) {
    Client client(server.address(), {.token = [token] { return token; }});
    EXPECT_TRUE(absl::IsUnauthenticated(client.ListMaps().status())) << token;
  }
  EXPECT_THAT(server.shown(), IsEmpty());
}

// Addresses and names reserved for documentation (RFC 5737, RFC 2606), so nothing is sent anywhere.
TEST(TokenTest, LeavesTheMachineByTlsOnly) {
  for (const char* target : {"192.0.2.1:1", "map.example:1", "127.0.0.1.map.example:1",
                             "localhost.map.example:1", "[2001:db8::1]:1"}) {
    Client client(target, {.token = [] { return "abc"; }});
    for (const absl::Status& status : CallEachWay(client)) {
      EXPECT_TRUE(absl::IsUnauthenticated(status)) << target << ": " << status;
      EXPECT_THAT(std::string(status.message()), HasSubstr("without TLS"));
    }
  }
}

TEST(TokenTest, MayBeSentInClear) {
  ClientOptions options;
  options.timeout = absl::Milliseconds(1);
  options.retry_for = absl::ZeroDuration();
  options.token = [] { return "abc"; };
  options.token_in_clear = true;
  const absl::Status status = Client("map.example:1", options).ListMaps().status();
  EXPECT_FALSE(status.ok());
  EXPECT_FALSE(absl::IsUnauthenticated(status)) << status;
}

TEST(TokenTest, OwnMachineHasSeveralNames) {
  Doorkeeper server(grpc::InsecureServerCredentials());
  const std::string port = server.address().substr(server.address().rfind(':'));
  for (const char* host : {"127.0.0.1", "localhost", "ipv4:127.0.0.1", "dns:///localhost"}) {
    Client client(host + port, {.token = [] { return "abc"; }});
    EXPECT_EQ(client.ListMaps().status(), absl::OkStatus()) << host;
  }
}

}  // namespace
}  // namespace hypermap::client
