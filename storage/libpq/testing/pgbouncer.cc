#include "storage/libpq/testing/pgbouncer.h"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "base/sync/deadline.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {
namespace {

constexpr char kProgram[] = "/usr/sbin/pgbouncer";
constexpr char kPgbouncerLog[] = "log";
constexpr int kMostTries = 20;

}  // namespace

absl::Status Pgbouncer::Installed() {
  if (access(kProgram, X_OK) == 0) return absl::OkStatus();
  return absl::NotFoundError("pgbouncer is not installed (tools/deps.sh test)");
}

absl::StatusOr<std::unique_ptr<Pgbouncer>> Pgbouncer::Start(const Cluster& cluster, int sessions) {
  HYPERMAP_RETURN_IF_ERROR(Installed());
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<ProcessFolder> folder, ProcessFolder::Create());
  std::unique_ptr<Pgbouncer> pgbouncer(new Pgbouncer(std::move(folder)));
  absl::Status status;
  // The port may be taken.
  for (int i = 0; i < kMostTries; ++i) {
    status = pgbouncer->StartOnce(cluster, sessions);
    if (status.ok()) return pgbouncer;
  }
  return status;
}

Pgbouncer::~Pgbouncer() {
  if (pid_ < 0) return;
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

absl::Status Pgbouncer::StartOnce(const Cluster& cluster, int sessions) {
  port_ = RandomPort();
  HYPERMAP_RETURN_IF_ERROR(folder_->Write("users", "\"postgres\" \"\"\n"));
  HYPERMAP_RETURN_IF_ERROR(folder_->Write(
      "ini",
      absl::StrCat("[databases]\n* = host=127.0.0.1 port=", cluster.port(),
                   "\n[pgbouncer]\nlisten_addr = 127.0.0.1\nlisten_port = ", port_,
                   "\nunix_socket_dir =\nauth_type = trust\nauth_file = ", folder_->path(),
                   "/users\npool_mode = transaction\ndefault_pool_size = ", sessions, "\n")));
  HYPERMAP_ASSIGN_OR_RETURN(pid_, folder_->Start({kProgram, "ini"}, kPgbouncerLog));
  const Deadline deadline(absl::Minutes(1));
  while (!deadline.has_passed()) {
    if (waitpid(pid_, nullptr, WNOHANG) == pid_) {
      pid_ = -1;
      return absl::InternalError(absl::StrCat("pgbouncer ended: ", folder_->Tail(kPgbouncerLog)));
    }
    ConnectOptions options;
    options.target = Through(cluster.admin_target());
    options.prepares = false;
    const auto connection = Connection::Open(options);
    if (connection.ok() && (*connection)->Execute("SELECT 1").ok()) return absl::OkStatus();
    absl::SleepFor(absl::Milliseconds(10));
  }
  return absl::DeadlineExceededError("pgbouncer did not get ready");
}

std::string Pgbouncer::Through(const std::string& target) const {
  return absl::StrCat(target, " port=", port_);
}

}  // namespace hypermap::storage::postgres
