// A connection pooler of the test's own.
#ifndef HYPERMAP_STORAGE_LIBPQ_TESTING_PGBOUNCER_H_
#define HYPERMAP_STORAGE_LIBPQ_TESTING_PGBOUNCER_H_

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "storage/libpq/testing/cluster.h"

// Skips a test where pgbouncer is missing.
#define HYPERMAP_SKIP_WITHOUT_PGBOUNCER()                                                   \
  if (const absl::Status installed = ::hypermap::storage::postgres::Pgbouncer::Installed(); \
      !installed.ok())                                                                      \
  GTEST_SKIP() << installed.message()

namespace hypermap::storage::postgres {

// A pgbouncer in transaction mode before a cluster: each transaction may get another of its few
// sessions. Ends with the process, at the latest.
class Pgbouncer {
 public:
  // NOT_FOUND if there is no pgbouncer here.
  static absl::Status Installed();
  // `sessions`: how many it opens with each database. The cluster must outlive it.
  static absl::StatusOr<std::unique_ptr<Pgbouncer>> Start(const Cluster& cluster, int sessions);
  ~Pgbouncer();
  Pgbouncer(const Pgbouncer&) = delete;
  Pgbouncer& operator=(const Pgbouncer&) = delete;

  // The connection string by which a database of the cluster is reached through this.
  std::string Through(const std::string& target) const;

 private:
  explicit Pgbouncer(std::unique_ptr<ProcessFolder> folder) : folder_(std::move(folder)) {}
  absl::Status StartOnce(const Cluster& cluster, int sessions);

  const std::unique_ptr<ProcessFolder> folder_;
  int port_ = 0;
  pid_t pid_ = -1;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_LIBPQ_TESTING_PGBOUNCER_H_
