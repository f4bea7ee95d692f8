#include "storage/libpq/testing/cluster.h"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <set>
#include <string>
#include <thread>

#include "absl/strings/match.h"
#include "absl/time/clock.h"
#include "gtest/gtest.h"
#include "storage/libpq/connection.h"
#include "storage/libpq/testing/database_test.h"
#include "tests/support/eventually.h"

namespace hypermap::storage::postgres {
namespace {

using testing::Eventually;

class ClusterTest : public DatabaseTest {
 protected:
  // Fails the test if it can't be started.
  static std::unique_ptr<Cluster> Start(const Cluster::Options& options = {}) {
    auto cluster = Cluster::Create(options);
    EXPECT_TRUE(cluster.ok()) << cluster.status();
    return cluster.ok() ? *std::move(cluster) : nullptr;
  }
  static absl::StatusOr<std::unique_ptr<Connection>> Open(const std::string& target) {
    ConnectOptions options;
    options.target = target;
    return Connection::Open(options);
  }
  static absl::Status Execute(const std::string& target, const std::string& sql) {
    auto connection = Open(target);
    return connection.ok() ? (*connection)->Execute(sql) : connection.status();
  }
};

TEST_F(ClusterTest, DatabasesAreEmptyAndTheirOwn) {
  const std::string a = *Cluster::Shared().CreateDatabase();
  const std::string b = *Cluster::Shared().CreateDatabase();
  EXPECT_NE(a, b);
  EXPECT_EQ(Execute(a, "CREATE TABLE t (a bigint)"), absl::OkStatus());
  EXPECT_EQ(Execute(b, "CREATE TABLE t (a bigint)"), absl::OkStatus());
}

TEST_F(ClusterTest, TextIsNotOrderedByItsBytes) {
  auto rows = connection_->Query("SELECT 'a' < 'B', 'a' < 'B' COLLATE \"C\"");
  ASSERT_TRUE(rows->Next());
  EXPECT_TRUE(rows->Bool(0));
  EXPECT_FALSE(rows->Bool(1));
}

TEST_F(ClusterTest, PostgisIsThereIfItCanBeCreated) {
  EXPECT_EQ(connection_->Execute("CREATE EXTENSION postgis").ok(), Cluster::Shared().HasPostgis());
}

TEST_F(ClusterTest, SeveralRunAtOnceAndLeaveNothing) {
  std::set<int> ports;
  std::string folder;
  {
    const auto a = Start();
    const auto b = Start({.is_durable = true, .settings = {"max_connections=7"}});
    ports = {a->port(), b->port(), Cluster::Shared().port()};
    folder = a->folder().path();
    EXPECT_TRUE(std::filesystem::exists(folder));
    auto connection = Open(b->admin_target());
    auto rows =
        (*connection)->Query("SELECT current_setting('fsync'), current_setting('max_connections')");
    ASSERT_TRUE(rows.ok() && rows->Next());
    EXPECT_EQ(rows->Text(0), "on");
    EXPECT_EQ(rows->Text(1), "7");
  }
  EXPECT_EQ(ports.size(), 3u);
  EXPECT_FALSE(std::filesystem::exists(folder));
}

TEST_F(ClusterTest, ServerIsStoppedKilledAndStartedAgain) {
  const auto cluster = Start();
  const std::string target = *cluster->CreateDatabase();
  ASSERT_EQ(Execute(target, "CREATE TABLE t (a bigint)"), absl::OkStatus());
  for (const char* way : {"fast", "immediate", "kill", "kill"}) {
    SCOPED_TRACE(way);
    auto connection = Open(target);
    ASSERT_TRUE(connection.ok()) << connection.status();
    ASSERT_EQ((*connection)->Execute("INSERT INTO t VALUES (1)"), absl::OkStatus());
    if (way == std::string("kill")) {
      cluster->Kill();
    } else {
      cluster->Stop(way == std::string("fast") ? Cluster::StopMode::kFast
                                               : Cluster::StopMode::kImmediate);
    }
    EXPECT_EQ((*connection)->Execute("SELECT 1").code(), absl::StatusCode::kUnavailable);
    EXPECT_TRUE((*connection)->is_broken());
    EXPECT_EQ(Open(target).status().code(), absl::StatusCode::kUnavailable);
    ASSERT_EQ(cluster->Start(), absl::OkStatus());
  }
  auto connection = Open(target);
  ASSERT_TRUE(connection.ok()) << connection.status();
  EXPECT_EQ(**(*connection)->QueryInt64("SELECT count(*) FROM t"), 4);
}

TEST_F(ClusterTest, StatementThatRunsWhenTheServerIsKilledIsUnavailable) {
  const auto cluster = Start();
  auto connection = Open(cluster->admin_target());
  std::thread killer([&] {
    auto other = Open(cluster->admin_target());
    EXPECT_TRUE(Eventually([&] {
      return **(*other)->QueryInt64(
                 "SELECT count(*) FROM pg_stat_activity WHERE query LIKE '%sleep(60)' AND "
                 "pid <> pg_backend_pid() AND state = 'active'") == 1;
    }));
    cluster->Kill();
  });
  const absl::Status status = (*connection)->Query("SELECT pg_sleep(60)").status();
  killer.join();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable) << status;
  EXPECT_TRUE((*connection)->is_broken());
}

TEST_F(ClusterTest, KilledTestLeavesNothing) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const pid_t child = fork();
  if (child == 0) {
    // As a test would do it that is killed while it uses a server.
    const auto cluster = Cluster::Create();
    const std::string line = cluster.ok() ? (*cluster)->folder().path() + "\n" : "\n";
    static_cast<void>(!write(ends[1], line.data(), line.size()));
    for (;;) pause();
  }
  close(ends[1]);
  std::string folder;
  char c = 0;
  while (read(ends[0], &c, 1) == 1 && c != '\n') folder += c;
  close(ends[0]);
  EXPECT_FALSE(folder.empty());
  const auto count_processes = [&] {
    int count = 0;
    std::error_code error;
    for (const auto& process : std::filesystem::directory_iterator("/proc")) {
      const auto working = std::filesystem::read_symlink(process.path() / "cwd", error);
      if (!error && absl::StartsWith(working.string(), folder)) ++count;
    }
    return count;
  };
  EXPECT_GT(count_processes(), 1);
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_TRUE(Eventually([&] { return !std::filesystem::exists(folder); }));
  EXPECT_EQ(count_processes(), 0);
}

}  // namespace
}  // namespace hypermap::storage::postgres
