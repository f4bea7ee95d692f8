// How connections are opened, and what is told if they can't be.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <memory>
#include <string>
#include <thread>

#include "absl/strings/str_cat.h"
#include "base/cancellation/testing/cancelled_after.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/libpq/connection.h"
#include "storage/libpq/testing/database_test.h"
#include "tests/support/certificates.h"
#include "tests/support/eventually.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::storage::postgres {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;

class OpenTest : public DatabaseTest {
 protected:
  // The error of a connection string.
  absl::Status Error(const std::string& target) {
    options_.target = target;
    return Connection::Open(options_).status();
  }
};

TEST_F(OpenTest, MissingDatabasesAndRolesAreToldApart) {
  const absl::Status database = Error(absl::StrCat(options_.target, " dbname=none"));
  EXPECT_EQ(database.code(), absl::StatusCode::kFailedPrecondition) << database;
  EXPECT_EQ(SqlStateOf(database), "3D000");
  EXPECT_THAT(std::string(database.message()), HasSubstr("database \"none\" does not exist"));
  EXPECT_THAT(std::string(database.message()), Not(HasSubstr("\n")));
  EXPECT_THAT(std::string(database.message()), Not(HasSubstr("LOCATION")));
  const absl::Status role = Error(absl::StrCat(options_.target, " user=none"));
  EXPECT_EQ(role.code(), absl::StatusCode::kFailedPrecondition) << role;
  EXPECT_EQ(SqlStateOf(role), "28000");
}

TEST_F(OpenTest, FullDatabaseIsUnavailable) {
  ASSERT_EQ(connection_->Execute("CREATE ROLE nobody LOGIN CONNECTION LIMIT 0"), absl::OkStatus());
  const absl::Status full = Error(absl::StrCat(options_.target, " user=nobody"));
  EXPECT_EQ(full.code(), absl::StatusCode::kUnavailable) << full;
  EXPECT_EQ(SqlStateOf(full), "53300");
  ASSERT_EQ(connection_->Execute("DROP ROLE nobody"), absl::OkStatus());
}

TEST_F(OpenTest, NoServerIsUnavailable) {
  const absl::Status refused = Error("host=127.0.0.1 port=1 user=postgres dbname=postgres");
  EXPECT_EQ(refused.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("Connection refused"));
  EXPECT_EQ(SqlStateOf(refused), "");
}

TEST_F(OpenTest, TheHostThatAnswersIsFound) {
  const int port = Cluster::Shared().port();
  options_.target =
      absl::StrCat("host=127.0.0.1,127.0.0.1 port=1,", port, " user=postgres dbname=postgres");
  EXPECT_TRUE(Connection::Open(options_).ok());
  options_.target = absl::StrCat("postgresql://postgres@127.0.0.1:", port, "/postgres");
  EXPECT_TRUE(Connection::Open(options_).ok());
}

TEST_F(OpenTest, MessagesDoNotTellThePassword) {
  for (const char* target :
       {"host=127.0.0.1 port=1 user=postgres password=secret", "host=127.0.0.1 password=x secret",
        "postgresql://postgres:secret@127.0.0.1:1/postgres", "postgresql://a:secret@b:c:d:/e",
        "postgresql://postgres:secret@127.0.0.1:port/postgres", "password='secret"}) {
    const absl::Status status = Error(target);
    EXPECT_THAT(status.code(),
                AnyOf(absl::StatusCode::kUnavailable, absl::StatusCode::kFailedPrecondition))
        << target;
    EXPECT_THAT(status.ToString(), Not(HasSubstr("secret")));
  }
}

// Like the tests of transactions and pipelines, but what arrives leaves the socket in other pieces.
TEST_F(OpenTest, TlsIsSpoken) {
  const testing::TemporaryFolder folder;
  const testing::CertificateAuthority authority(folder, "root");
  authority.Sign("server");
  const ProcessFolder& files = Cluster::Shared().folder();
  for (const std::string name : {"server.pem", "server.key"}) {
    ASSERT_EQ(files.Write(name, testing::Contents(folder / name)), absl::OkStatus());
  }
  const auto set = [&](const std::string& ssl) {
    for (const std::string& setting :
         {absl::StrCat("ssl_cert_file = '", files.path(), "/server.pem'"),
          absl::StrCat("ssl_key_file = '", files.path(), "/server.key'"), "ssl = " + ssl}) {
      EXPECT_EQ(connection_->Execute("ALTER SYSTEM SET " + setting), absl::OkStatus());
    }
    EXPECT_EQ(connection_->Execute("SELECT pg_reload_conf()"), absl::OkStatus());
  };
  set("on");
  options_.target += absl::StrCat(" sslmode=verify-full sslrootcert=", folder / "root.pem");
  absl::StatusOr<std::unique_ptr<Connection>> tls;
  ASSERT_TRUE(testing::Eventually([&] { return (tls = Connection::Open(options_)).ok(); }));
  auto rows = (*tls)->Query("SELECT ssl FROM pg_stat_ssl WHERE pid = pg_backend_pid()");
  ASSERT_TRUE(rows.ok() && rows->Next());
  EXPECT_TRUE(rows->Bool(0));
  rows = (*tls)->Query("SELECT $1 || generate_series(1, 20000)", std::string(1000, 'x'));
  ASSERT_TRUE(rows.ok()) << rows.status();
  EXPECT_EQ(rows->size(), 20000);
  Pipeline pipeline(tls->get());
  for (int i = 0; i < 20000; ++i) pipeline.Add("SELECT $1", std::string(1000, 'x'));
  EXPECT_EQ(pipeline.Finish(), absl::OkStatus());
  {
    CancelledAfter cancelled(5);
    EXPECT_TRUE(absl::IsCancelled((*tls)->Query("SELECT pg_sleep(60)").status()));
  }
  EXPECT_EQ(**(*tls)->QueryInt64("SELECT 7::bigint"), 7);
  set("off");
}

// A socket on which a server listens that never answers.
class SilentServer {
 public:
  SilentServer() : handle_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    auto* const generic = reinterpret_cast<sockaddr*>(&address);
    EXPECT_EQ(bind(handle_, generic, size), 0);
    EXPECT_EQ(listen(handle_, 10), 0);
    EXPECT_EQ(getsockname(handle_, generic, &size), 0);
    port_ = ntohs(address.sin_port);
  }
  ~SilentServer() { close(handle_); }
  std::string target() const {
    return absl::StrCat("host=127.0.0.1 port=", port_, " user=postgres dbname=postgres");
  }
  int handle() const { return handle_; }
  int port() const { return port_; }

 private:
  const int handle_;
  int port_ = 0;
};

TEST_F(OpenTest, ServerThatDoesNotAnswerIsUnavailable) {
  const SilentServer server;
  options_.connect_timeout = absl::Milliseconds(200);
  EXPECT_EQ(Error(server.target()),
            absl::UnavailableError("the database did not answer within 200ms"));
}

// Takes connections, and ends each at once: a proxy whose database has died.
class RefusingProxy {
 public:
  RefusingProxy()
      : thread_([this] {
          for (int taken = 0; (taken = accept(server_.handle(), nullptr, nullptr)) >= 0;) {
            close(taken);
          }
        }) {}
  ~RefusingProxy() {
    shutdown(server_.handle(), SHUT_RDWR);
    thread_.join();
  }
  int port() const { return server_.port(); }

 private:
  const SilentServer server_;
  std::thread thread_;
};

TEST_F(OpenTest, NextHostIsTriedWhateverIsWrongWithOne) {
  const SilentServer silent;
  const RefusingProxy proxy;
  options_.connect_timeout = absl::Seconds(2);
  const int port = Cluster::Shared().port();
  const auto target = [&](const std::string& ports) {
    return absl::StrCat("host=127.0.0.1,127.0.0.1,127.0.0.1 port=", ports,
                        " user=postgres dbname=postgres target_session_attrs=read-write");
  };
  options_.target = target(absl::StrCat(silent.port(), ",", proxy.port(), ",", port));
  const auto connection = Connection::Open(options_);
  EXPECT_TRUE(connection.ok()) << connection.status();
  const absl::Status none = Error(target(absl::StrCat(silent.port(), ",", proxy.port(), ",1")));
  EXPECT_EQ(none.code(), absl::StatusCode::kUnavailable);
  for (const char* const part : {"did not answer within 2s", "Connection refused"}) {
    EXPECT_THAT(std::string(none.message()), HasSubstr(part));
  }
}

TEST_F(OpenTest, HostsThatDoNotFitToPortsAreRefused) {
  const absl::Status status = Error("host=127.0.0.1,127.0.0.1 port=1,2,3 user=postgres");
  EXPECT_THAT(std::string(status.message()), HasSubstr("could not match"));
}

TEST_F(OpenTest, CancelledCallerDoesNotWait) {
  const SilentServer server;
  options_.connect_timeout = absl::Seconds(60);
  CancelledAfter cancelled(5);
  EXPECT_TRUE(absl::IsCancelled(Error(server.target())));
}

}  // namespace
}  // namespace hypermap::storage::postgres
