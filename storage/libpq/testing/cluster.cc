#include "storage/libpq/testing/cluster.h"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "base/sync/deadline.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {
namespace {

constexpr char kPrograms[] = "/usr/lib/postgresql/15/bin/";
constexpr char kData[] = "db";
constexpr char kSaved[] = "saved";
constexpr char kLog[] = "log";
// A port may be taken; a server that was killed leaves processes, which end by themselves.
constexpr int kMostStarts = 50;

absl::StatusOr<std::unique_ptr<Connection>> Connect(const std::string& target) {
  ConnectOptions options;
  options.target = target;
  return Connection::Open(options);
}

std::vector<pid_t> ChildrenOf(pid_t pid) {
  std::ifstream file(absl::StrCat("/proc/", pid, "/task/", pid, "/children"));
  std::vector<pid_t> children;
  for (pid_t child = 0; file >> child;) children.push_back(child);
  return children;
}

}  // namespace

absl::Status Cluster::Installed() {
  for (const char* program : {"initdb", "postgres"}) {
    const std::string path = absl::StrCat(kPrograms, program);
    if (access(path.c_str(), X_OK) != 0) {
      return absl::NotFoundError(
          absl::StrCat("PostgreSQL 15 is not installed (tools/deps.sh test): there is no ", path));
    }
  }
  return absl::OkStatus();
}

Cluster& Cluster::Shared() {
  static const std::unique_ptr<Cluster> shared = [] {
    absl::StatusOr<std::unique_ptr<Cluster>> cluster = Create();
    if (!cluster.ok()) {
      std::fprintf(stderr, "PostgreSQL can't be started: %s\n",
                   cluster.status().ToString().c_str());
      std::exit(EXIT_FAILURE);
    }
    return *std::move(cluster);
  }();
  return *shared;
}

absl::StatusOr<std::unique_ptr<Cluster>> Cluster::Create(const Options& options) {
  HYPERMAP_RETURN_IF_ERROR(Installed());
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<ProcessFolder> folder, ProcessFolder::Create());
  HYPERMAP_ASSIGN_OR_RETURN(
      const pid_t initdb,
      folder->Start(
          {absl::StrCat(kPrograms, "initdb"), "--pgdata", kData, "--username", "postgres", "--auth",
           "trust", "--encoding", "UTF8", "--locale", "C.UTF-8", "--locale-provider", "icu",
           "--icu-locale", "en", "--wal-segsize", "1", "--no-sync", "--no-instructions"},
          kLog));
  if (!AwaitSuccess(initdb)) {
    return absl::InternalError(absl::StrCat("initdb failed: ", folder->Tail(kLog)));
  }
  std::unique_ptr<Cluster> cluster(new Cluster(std::move(folder), options));
  HYPERMAP_RETURN_IF_ERROR(cluster->Start());
  return cluster;
}

Cluster::Cluster(std::unique_ptr<ProcessFolder> folder, Options options)
    : folder_(std::move(folder)), options_(std::move(options)) {}

Cluster::~Cluster() { Stop(); }

std::string Cluster::TargetOf(const std::string& database) const {
  return absl::StrCat("host=127.0.0.1 port=", port_, " user=postgres dbname=", database);
}

absl::StatusOr<std::string> Cluster::CreateDatabase(const std::string& like) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<Connection> connection, Connect(admin_target()));
  const std::string name = absl::StrCat("test_", ++num_databases_);
  const std::string source = like.empty() ? "" : absl::StrCat(" TEMPLATE ", NameOf(like));
  HYPERMAP_RETURN_IF_ERROR(connection->Execute(absl::StrCat("CREATE DATABASE ", name, source)));
  return TargetOf(name);
}

absl::Status Cluster::DropDatabase(const std::string& target) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<Connection> connection, Connect(admin_target()));
  return connection->Execute(absl::StrCat("DROP DATABASE ", NameOf(target), " WITH (FORCE)"));
}

std::string Cluster::NameOf(const std::string& target) const {
  return target.substr(TargetOf("").size());
}

bool Cluster::HasPostgis() const {
  const auto connection = Connect(admin_target());
  if (!connection.ok()) return false;
  const auto found =
      (*connection)
          ->QueryInt64("SELECT count(*) FROM pg_available_extensions WHERE name = 'postgis'");
  return found.ok() && *found == 1;
}

void Cluster::Stop(StopMode mode) {
  if (postmaster_ < 0) return;
  kill(postmaster_, mode == StopMode::kFast ? SIGINT : SIGQUIT);
  waitpid(postmaster_, nullptr, 0);
  postmaster_ = -1;
}

void Cluster::Kill() {
  if (postmaster_ < 0) return;
  const std::vector<pid_t> children = ChildrenOf(postmaster_);
  kill(postmaster_, SIGKILL);
  for (const pid_t child : children) kill(child, SIGKILL);
  waitpid(postmaster_, nullptr, 0);
  postmaster_ = -1;
}

absl::Status Cluster::RunScript(const std::string& script) {
  HYPERMAP_ASSIGN_OR_RETURN(const pid_t shell, folder_->Start({"/bin/sh", "-ec", script}, kLog));
  if (AwaitSuccess(shell)) return absl::OkStatus();
  return absl::InternalError(absl::StrCat(script, ": ", folder_->Tail(kLog)));
}

absl::Status Cluster::SaveFiles() {
  return RunScript(absl::StrCat("rm -rf ", kSaved, "; cp -a ", kData, " ", kSaved));
}

absl::Status Cluster::RestoreFiles() {
  return RunScript(absl::StrCat("rm -rf ", kData, "; cp -a ", kSaved, " ", kData));
}

absl::Status Cluster::RecoverAtStart() {
  HYPERMAP_RETURN_IF_ERROR(RunScript(
      absl::StrCat("sed -i /synchronous_standby_names/d ", kData, "/postgresql.auto.conf")));
  return folder_->Write(absl::StrCat(kData, "/recovery.signal"), "");
}

absl::Status Cluster::ConfirmCommits() {
  HYPERMAP_RETURN_IF_ERROR(RunScript("rm -rf received; mkdir received"));
  HYPERMAP_RETURN_IF_ERROR(folder_
                               ->Start({absl::StrCat(kPrograms, "pg_receivewal"), "-D", "received",
                                        "-d", admin_target(), "--synchronous", "--no-loop"},
                                       kLog)
                               .status());
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<Connection> connection, Connect(admin_target()));
  HYPERMAP_RETURN_IF_ERROR(connection->Execute("ALTER SYSTEM SET synchronous_standby_names = '*'"));
  return connection->Query("SELECT pg_reload_conf()").status();
}

absl::Status Cluster::Start() {
  const bool has_port = port_ != 0;
  absl::Status status;
  for (int i = 0; i < kMostStarts; ++i) {
    if (!has_port) port_ = RandomPort();
    status = StartOnce();
    if (status.ok()) return status;
    absl::SleepFor(absl::Milliseconds(100));
  }
  return status;
}

absl::Status Cluster::StartOnce() {
  std::vector<std::string> command = {absl::StrCat(kPrograms, "postgres"), "-D", kData};
  std::vector<std::string> settings = {"listen_addresses=127.0.0.1", absl::StrCat("port=", port_),
                                       absl::StrCat("unix_socket_directories=", folder_->path()),
                                       "max_connections=300", "shared_buffers=32MB",
                                       "max_wal_size=128MB", "autovacuum=off", "lc_messages=C",
                                       // There is no archive: what is in the folder is recovered.
                                       "restore_command=false",
                                       // Its shared memory is in the folder, and goes with it.
                                       "dynamic_shared_memory_type=mmap"};
  if (!options_.is_durable) {
    settings.insert(settings.end(), {"fsync=off", "full_page_writes=off"});
  }
  settings.insert(settings.end(), options_.settings.begin(), options_.settings.end());
  for (const std::string& setting : settings) command.insert(command.end(), {"-c", setting});
  HYPERMAP_ASSIGN_OR_RETURN(postmaster_, folder_->Start(command, kLog));
  absl::Status status = AwaitReady();
  if (!status.ok()) Kill();
  return status;
}

absl::Status Cluster::AwaitReady() {
  const Deadline deadline(absl::Minutes(1));
  while (!deadline.has_passed()) {
    if (waitpid(postmaster_, nullptr, WNOHANG) == postmaster_) {
      postmaster_ = -1;
      return absl::InternalError(absl::StrCat("PostgreSQL ended: ", folder_->Tail(kLog)));
    }
    // Another program's server may have the port; this one ends then.
    const auto connection = Connect(admin_target());
    if (connection.ok()) {
      HYPERMAP_ASSIGN_OR_RETURN(Rows rows, (*connection)->Query("SHOW data_directory"));
      if (rows.Next() && rows.Text(0) == absl::StrCat(folder_->path(), "/", kData)) {
        return absl::OkStatus();
      }
    }
    absl::SleepFor(absl::Milliseconds(10));
  }
  return absl::DeadlineExceededError("PostgreSQL did not get ready");
}

}  // namespace hypermap::storage::postgres
