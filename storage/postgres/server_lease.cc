#include "storage/postgres/server_lease.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "base/sync/start_thread.h"
#include "storage/incarnation.h"

namespace hypermap::storage::postgres {
namespace {

// Also takes it from an earlier process with the same id.
constexpr char kTake[] = R"sql(
INSERT INTO hypermap.servers (id, address, session, lease_until)
  VALUES ($1, $2, $3, clock_timestamp() + $4 * interval '1 microsecond')
  ON CONFLICT (id) DO UPDATE SET address = excluded.address, session = excluded.session,
    lease_until = excluded.lease_until, draining = false
)sql";
// The row is made again if it was removed, but not taken back from a later process.
constexpr char kRenew[] = R"sql(
INSERT INTO hypermap.servers AS s (id, address, session, lease_until)
  VALUES ($1, $2, $3, clock_timestamp() + $4 * interval '1 microsecond')
  ON CONFLICT (id) DO UPDATE SET address = excluded.address, lease_until = excluded.lease_until
    WHERE s.session = excluded.session
)sql";
constexpr char kGiveBack[] = "DELETE FROM hypermap.servers WHERE id = $1 AND session = $2";
constexpr char kSetDraining[] =
    "UPDATE hypermap.servers SET draining = $2 WHERE id = $1 AND lease_until > clock_timestamp()";
constexpr int kRenewalsPerLease = 3;

}  // namespace

absl::StatusOr<std::unique_ptr<ServerLease>> ServerLease::Take(const Options& options) {
  std::unique_ptr<ServerLease> lease(new ServerLease(options));
  HYPERMAP_RETURN_IF_ERROR(lease->Extend(kTake));
  HYPERMAP_ASSIGN_OR_RETURN(lease->thread_, StartThread("hm-pg-lease", [lease = lease.get()] {
                              lease->RenewUntilStopped();
                            }));
  return lease;
}

ServerLease::ServerLease(Options options)
    : options_(std::move(options)), session_(static_cast<int64_t>(NewIncarnation())) {}

ServerLease::~ServerLease() {
  if (!thread_.joinable()) return;
  {
    const MutexLock lock(&mutex_);
    is_stopping_ = true;
    changed_.NotifyAll();
  }
  thread_.join();
  if (connection_ == nullptr || connection_->is_broken()) return;
  connection_->Query(kGiveBack, options_.server_id, session_).status().IgnoreError();
}

void ServerLease::Advertise(const std::string& address) {
  const MutexLock lock(&mutex_);
  address_ = address;
  is_renewal_due_ = true;
  changed_.NotifyAll();
}

absl::Duration ServerLease::Age() const {
  const MutexLock lock(&mutex_);
  return SteadyTime::Now() - renewed_at_;
}

void ServerLease::RenewUntilStopped() {
  const absl::Duration pause = options_.duration / kRenewalsPerLease;
  while (true) {
    {
      const MutexLock lock(&mutex_);
      if (!is_stopping_ && !is_renewal_due_) changed_.WaitFor(&mutex_, pause);
      if (is_stopping_) return;
      is_renewal_due_ = false;
    }
    // If the database can't be reached, the next attempt may succeed.
    Extend(kRenew).IgnoreError();
  }
}

absl::Status ServerLease::Extend(const char* sql) {
  if (connection_ == nullptr || connection_->is_broken()) {
    connection_.reset();
    ConnectOptions options = options_.connect;
    options.connect_timeout = options_.duration;
    options.response_timeout = options_.duration;
    options.prepares = false;
    HYPERMAP_ASSIGN_OR_RETURN(connection_, Connection::Open(options));
  }
  HYPERMAP_RETURN_IF_ERROR(options_.guard->Check(connection_.get()));
  std::string address;
  {
    const MutexLock lock(&mutex_);
    address = address_;
  }
  // The database counts from a later moment.
  const SteadyTime now = SteadyTime::Now();
  const absl::StatusOr<Rows> extended = connection_->Query(
      sql, options_.server_id, address, session_, absl::ToInt64Microseconds(options_.duration));
  HYPERMAP_RETURN_IF_ERROR(extended.status());
  const MutexLock lock(&mutex_);
  // None if a later process has this id.
  if (extended->changed_rows() > 0) renewed_at_ = now;
  return absl::OkStatus();
}

absl::Status SetDraining(Connection* connection, const std::string& server_id, bool draining) {
  HYPERMAP_ASSIGN_OR_RETURN(const Rows changed,
                            connection->Query(kSetDraining, server_id, draining));
  if (changed.changed_rows() > 0) return absl::OkStatus();
  return absl::NotFoundError(absl::StrCat("no server \"", server_id, "\" lives"));
}

}  // namespace hypermap::storage::postgres
