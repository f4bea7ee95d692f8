// A PostgreSQL server of the test's own.
#ifndef HYPERMAP_STORAGE_LIBPQ_TESTING_CLUSTER_H_
#define HYPERMAP_STORAGE_LIBPQ_TESTING_CLUSTER_H_

#include <sys/types.h>

#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "storage/libpq/testing/process_folder.h"

// Skips a test where PostgreSQL is missing. For the first line of a test or of its SetUp.
#define HYPERMAP_SKIP_WITHOUT_POSTGRES()                                                  \
  if (const absl::Status installed = ::hypermap::storage::postgres::Cluster::Installed(); \
      !installed.ok())                                                                    \
  GTEST_SKIP() << installed.message()

namespace hypermap::storage::postgres {

// A cluster in a temporary folder, whose server listens on a port of 127.0.0.1 that it has for
// itself, and trusts everybody. The server ends and the folder is removed with this, at the latest
// when the test's process is gone. Text is compared by the rules of English, so that a statement
// that relies on the order of bytes without saying so fails. Used by one thread at a time.
//
//   const std::string target = *Cluster::Shared().CreateDatabase();
class Cluster {
 public:
  struct Options {
    // Whether commits survive a power loss. Costs time.
    bool is_durable = false;
    // Further settings, such as "max_connections=10".
    std::vector<std::string> settings;
  };

  // NOT_FOUND, saying what is missing, if there is no PostgreSQL 15 here.
  static absl::Status Installed();
  // The cluster of this process, which is started at first use and stopped at exit. Ends the
  // process if that fails. REQUIRES: Installed.
  static Cluster& Shared();
  // Creates a cluster and starts its server, which takes about a second.
  static absl::StatusOr<std::unique_ptr<Cluster>> Create(const Options& options);
  static absl::StatusOr<std::unique_ptr<Cluster>> Create() { return Create(Options()); }
  ~Cluster();
  Cluster(const Cluster&) = delete;
  Cluster& operator=(const Cluster&) = delete;

  // Creates an empty database, or a copy of one that nobody is connected to. Takes and returns
  // connection strings.
  absl::StatusOr<std::string> CreateDatabase(const std::string& like = "");
  // Drops a database that was created so, and ends its sessions. Databases take 8 MB, which are
  // slow to remove once they were written to the disk.
  absl::Status DropDatabase(const std::string& target);
  // The connection string of the role that may do everything, and of the database "postgres".
  std::string admin_target() const { return TargetOf("postgres"); }
  int port() const { return port_; }
  const ProcessFolder& folder() const { return *folder_; }

  // Whether the extension PostGIS can be created.
  bool HasPostgis() const;

  // Stops the server: at once, as if it had crashed, or after its sessions were ended.
  enum class StopMode { kImmediate, kFast };
  void Stop(StopMode mode = StopMode::kImmediate);
  // Kills the server with all its processes.
  void Kill();
  // Has a program receive and confirm each commit until the server stops, as a synchronous standby
  // does.
  absl::Status ConfirmCommits();
  // Keeps a copy of the files, in place of an earlier one. REQUIRES: the server is stopped.
  absl::Status SaveFiles();
  // Puts the copy in the place of the files. REQUIRES: the server is stopped.
  absl::Status RestoreFiles();
  // Has the next start recover the database as from a backup, to the end of its WAL: it goes on
  // without a standby on a new timeline, as a standby does that is promoted. REQUIRES: the server
  // is stopped.
  absl::Status RecoverAtStart();
  // Starts the server again, on the same port. Waits until it accepts connections.
  absl::Status Start();

 private:
  Cluster(std::unique_ptr<ProcessFolder> folder, Options options);
  std::string TargetOf(const std::string& database) const;
  std::string NameOf(const std::string& target) const;
  // Runs a script of the shell in the folder.
  absl::Status RunScript(const std::string& script);
  absl::Status StartOnce();
  absl::Status AwaitReady();

  const std::unique_ptr<ProcessFolder> folder_;
  const Options options_;
  int port_ = 0;
  pid_t postmaster_ = -1;
  int num_databases_ = 0;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_LIBPQ_TESTING_CLUSTER_H_
