#include "tests/bench/server/postgis.h"

#include <libpq-fe.h>
#include <time.h>

#include <algorithm>
#include <thread>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "storage/libpq/testing/cluster.h"
#include "tests/bench/server/wkb.h"

namespace hypermap::bench {
namespace {

constexpr char kStatement[] = "asked";

struct Closer {
  void operator()(PGconn* connection) const { PQfinish(connection); }
  void operator()(PGresult* result) const { PQclear(result); }
};
using Connection = std::unique_ptr<PGconn, Closer>;
using Result = std::unique_ptr<PGresult, Closer>;

absl::Status Error(PGconn* connection) {
  return absl::InternalError(absl::StrCat("PostGIS: ", PQerrorMessage(connection)));
}

absl::StatusOr<Connection> Connect(const std::string& target) {
  Connection connection(PQconnectdb(target.c_str()));
  if (PQstatus(connection.get()) != CONNECTION_OK) return Error(connection.get());
  return connection;
}

absl::Status Execute(PGconn* connection, const std::string& sql) {
  const Result result(PQexec(connection, sql.c_str()));
  const ExecStatusType status = PQresultStatus(result.get());
  return status == PGRES_COMMAND_OK || status == PGRES_TUPLES_OK ? absl::OkStatus()
                                                                 : Error(connection);
}

absl::StatusOr<Connection> ConnectAndPrepare(const std::string& target, const std::string& sql) {
  absl::StatusOr<Connection> connection = Connect(target);
  HYPERMAP_RETURN_IF_ERROR(connection.status());
  const Result result(PQprepare(connection->get(), kStatement, sql.c_str(), 0, nullptr));
  if (PQresultStatus(result.get()) != PGRES_COMMAND_OK) return Error(connection->get());
  return connection;
}

// Returns the number of rows of the answer, which is in binary format.
absl::StatusOr<int> Call(PGconn* connection, const std::vector<std::string>& parameters) {
  std::vector<const char*> values;
  for (const std::string& parameter : parameters) values.push_back(parameter.c_str());
  const Result result(PQexecPrepared(connection, kStatement, static_cast<int>(values.size()),
                                     values.data(), nullptr, nullptr, 1));
  if (PQresultStatus(result.get()) != PGRES_TUPLES_OK) return Error(connection);
  return PQntuples(result.get());
}

double CpuSecondsOf(pid_t pid) {
  clockid_t clock;
  timespec time{};
  if (clock_getcpuclockid(pid, &clock) != 0 || clock_gettime(clock, &time) != 0) return 0;
  return absl::ToDoubleSeconds(absl::DurationFromTimespec(time));
}

}  // namespace

absl::StatusOr<std::unique_ptr<PostgisCluster>> PostgisCluster::Start() {
  using storage::postgres::Cluster;
  HYPERMAP_RETURN_IF_ERROR(Cluster::Installed());
  // Everything in memory, one process per connection, and no background work.
  absl::StatusOr<std::unique_ptr<Cluster>> cluster =
      Cluster::Create({.settings = {"shared_buffers=1GB", "jit=off",
                                    "max_parallel_workers_per_gather=0", "random_page_cost=1.1"}});
  HYPERMAP_RETURN_IF_ERROR(cluster.status());
  if (!(*cluster)->HasPostgis()) return absl::NotFoundError("PostGIS is not installed");
  return std::unique_ptr<PostgisCluster>(new PostgisCluster(*std::move(cluster)));
}

std::string PostgisCluster::ConnectionString() const { return cluster_->admin_target(); }

absl::Status PostgisCluster::Load(const GeneratedSite& site) {
  absl::StatusOr<Connection> connection = Connect(ConnectionString());
  HYPERMAP_RETURN_IF_ERROR(connection.status());
  PGconn* const c = connection->get();
  absl::Status status =
      Execute(c,
              "CREATE EXTENSION postgis; CREATE TABLE objects (id bigint PRIMARY KEY, "
              "label text NOT NULL, existence float8 NOT NULL, geom geometry(Polygon) NOT NULL)");
  HYPERMAP_RETURN_IF_ERROR(status);
  if (PQresultStatus(Result(PQexec(c, "COPY objects FROM STDIN")).get()) != PGRES_COPY_IN) {
    return Error(c);
  }
  for (int64_t i = 0; i < site.num_objects(); ++i) {
    const SemanticObject object = site.Object(i);
    const std::string line =
        absl::StrCat(object.id, "\t", object.label, "\t", object.existence, "\t",
                     absl::BytesToHexString(ToWkb(object.shape.polygon())), "\n");
    if (PQputCopyData(c, line.data(), static_cast<int>(line.size())) != 1) return Error(c);
  }
  if (PQputCopyEnd(c, nullptr) != 1) return Error(c);
  if (PQresultStatus(Result(PQgetResult(c)).get()) != PGRES_COMMAND_OK) return Error(c);
  while (PGresult* rest = PQgetResult(c)) PQclear(rest);
  // No index on label: with one, queries of a label in a box take several times as long.
  status = Execute(c, "CREATE INDEX ON objects USING gist (geom)");
  return status.ok() ? Execute(c, "VACUUM ANALYZE objects") : status;
}

absl::StatusOr<Cost> PostgisCluster::Run(const SqlCalls& calls, int connections,
                                         absl::Duration duration) const {
  struct Caller {
    Connection connection;
    std::vector<double> latencies_s;
    absl::Status status;
  };
  std::vector<Caller> callers(connections);
  double cpu_s = 0;
  for (Caller& caller : callers) {
    absl::StatusOr<Connection> connection = ConnectAndPrepare(ConnectionString(), calls.sql);
    HYPERMAP_RETURN_IF_ERROR(connection.status());
    caller.connection = *std::move(connection);
    // The first call of a connection loads the extension.
    const auto warm = Call(caller.connection.get(), calls.parameters(0));
    HYPERMAP_RETURN_IF_ERROR(warm.status());
    cpu_s -= CpuSecondsOf(PQbackendPID(caller.connection.get()));
  }
  const absl::Time start = absl::Now();
  std::vector<std::thread> threads;
  for (int c = 0; c < connections; ++c) {
    threads.emplace_back([&, c] {
      Caller& caller = callers[c];
      for (int64_t i = c; absl::Now() < start + duration && caller.status.ok(); i += connections) {
        const absl::Time sent = absl::Now();
        caller.status = Call(caller.connection.get(), calls.parameters(i)).status();
        caller.latencies_s.push_back(absl::ToDoubleSeconds(absl::Now() - sent));
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  const double wall_s = absl::ToDoubleSeconds(absl::Now() - start);
  LoadResult all;
  for (const Caller& caller : callers) {
    if (!caller.status.ok()) return caller.status;
    cpu_s += CpuSecondsOf(PQbackendPID(caller.connection.get()));
    all.latencies_s.insert(all.latencies_s.end(), caller.latencies_s.begin(),
                           caller.latencies_s.end());
  }
  std::sort(all.latencies_s.begin(), all.latencies_s.end());
  const auto count = static_cast<double>(all.latencies_s.size());
  return Cost{cpu_s / count, wall_s / count, all.Percentile(0.5), all.Percentile(0.99)};
}

absl::StatusOr<std::vector<int>> PostgisCluster::CountRows(const SqlCalls& calls, int count) const {
  absl::StatusOr<Connection> connection = ConnectAndPrepare(ConnectionString(), calls.sql);
  HYPERMAP_RETURN_IF_ERROR(connection.status());
  std::vector<int> rows;
  for (int i = 0; i < count; ++i) {
    const absl::StatusOr<int> n = Call(connection->get(), calls.parameters(i));
    HYPERMAP_RETURN_IF_ERROR(n.status());
    rows.push_back(*n);
  }
  return rows;
}

}  // namespace hypermap::bench
