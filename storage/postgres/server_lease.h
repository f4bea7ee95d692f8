// The lease by which other servers know that this one lives.
#ifndef HYPERMAP_STORAGE_POSTGRES_SERVER_LEASE_H_
#define HYPERMAP_STORAGE_POSTGRES_SERVER_LEASE_H_

#include <cstdint>
#include <memory>
#include <string>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"
#include "storage/libpq/connection.h"
#include "storage/postgres/database_guard.h"

namespace hypermap::storage::postgres {

// While a server has a lease, by the database's clock, no other takes its maps. The lease tells who
// may take a map, and never who may write it: that is told by the epoch (OwnedMap), so that a lease
// that can't be renewed does no harm before another server has taken a map. Thread safe.
class ServerLease {
 public:
  struct Options {
    ConnectOptions connect;
    std::string server_id;
    absl::Duration duration = absl::Seconds(3);
    // Is asked before each renewal, and must outlive the lease.
    DatabaseGuard* guard = nullptr;
  };
  // Takes a lease, and renews it three times in its duration until this is destroyed.
  static absl::StatusOr<std::unique_ptr<ServerLease>> Take(const Options& options);
  // Gives the lease back, so that others need not wait for its end.
  ~ServerLease();
  // Adds the address at which others reach this server.
  void Advertise(const std::string& address);
  // The time since the lease was renewed.
  absl::Duration Age() const;
  ServerLease(const ServerLease&) = delete;
  ServerLease& operator=(const ServerLease&) = delete;

 private:
  explicit ServerLease(Options options);
  void RenewUntilStopped();
  // Sets the end of the lease by one of two statements.
  absl::Status Extend(const char* sql);

  const Options options_;
  const int64_t session_;
  std::unique_ptr<Connection> connection_;  // used by the thread alone once it runs
  mutable Mutex mutex_;
  CondVar changed_;
  std::string address_ ABSL_GUARDED_BY(mutex_);
  SteadyTime renewed_at_ ABSL_GUARDED_BY(mutex_) = SteadyTime::InfinitePast();
  bool is_renewal_due_ ABSL_GUARDED_BY(mutex_) = false;
  bool is_stopping_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

// Marks a server that lives as one that is to own no maps, or takes the mark away. NOT_FOUND.
absl::Status SetDraining(Connection* connection, const std::string& server_id, bool draining);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_SERVER_LEASE_H_
