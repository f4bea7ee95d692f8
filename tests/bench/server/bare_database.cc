#include "tests/bench/server/bare_database.h"

#include <libpq-fe.h>

#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "base/status/status_macros.h"
#include "storage/libpq/parameters.h"

namespace hypermap::bench {
namespace {

// The statements, which are named by their place here. The rows of a group are inserted together,
// which takes less of the database's time than a statement for each.
enum Statement { kFence, kEnd, kObjects, kChanges, kLayerRevisions, kReceipts, kRevisions };
constexpr const char* kStatements[] = {
    "UPDATE hypermap.maps SET last_write = $4, revision = $6, provisional = false "
    "WHERE id = $1 AND epoch = $2 AND last_write = $3 AND revision = $5",
    "UPDATE hypermap.objects SET end_revision = $3 WHERE map = $1 AND lineage = 1 "
    "AND object_id = $2 AND end_revision = 9223372036854775807",
    "INSERT INTO hypermap.objects (map, lineage, object_id, first_revision, end_revision, bounds, "
    "shape, label, existence, classes, tags, attributes) SELECT $1, 1, r.id, r.revision, "
    "9223372036854775807, box(point(r.a, r.b), point(r.c, r.d)), r.shape, r.label, r.existence, "
    "'{}', '[]', '{}' FROM unnest($2::int8[], $3::int8[], $4::float8[], $5::float8[], "
    "$6::float8[], $7::float8[], $8::bytea[], $9::text[], $10::float8[]) "
    "AS r (id, revision, a, b, c, d, shape, label, existence)",
    "INSERT INTO hypermap.changes (map, revision, number, kind, lineage, object_id) "
    "SELECT $1, r.revision, 0, 'put', 1, r.id FROM unnest($2::int8[], $3::int8[]) "
    "AS r (revision, id)",
    "INSERT INTO hypermap.layer_revisions (map, lineage, revision) SELECT $1, 1, r "
    "FROM unnest($2::int8[]) AS r",
    "INSERT INTO hypermap.receipts (map, request_id, revision, time_ns, object_ids, digest) "
    "SELECT $1, r.id, r.revision, r.revision, '\\x02', '\\x0102030405060708090a0b0c0d0e0f10' "
    "FROM unnest($2::text[], $3::int8[]) AS r (id, revision)",
    "INSERT INTO hypermap.revisions (map, revision, time_ns, author, num_changes) "
    "SELECT $1, r, r, 'bench', 1 FROM unnest($2::int8[]) AS r"};

struct ClearResult {
  void operator()(PGresult* result) const { PQclear(result); }
};
using BareResult = std::unique_ptr<PGresult, ClearResult>;

absl::Status BareError(pg_conn* connection) {
  return absl::InternalError(absl::StrCat("bare libpq: ", PQerrorMessage(connection)));
}

// Sends a prepared statement with parameters in binary format.
template <typename... Values>
absl::Status Send(pg_conn* connection, const std::string& name, const Values&... parameters) {
  const storage::postgres::Parameters encoded(parameters...);
  std::vector<const char*> values;
  std::vector<int> lengths;
  for (const auto& value : encoded.values()) {
    values.push_back(value.bytes.data());
    lengths.push_back(static_cast<int>(value.bytes.size()));
  }
  const std::vector<int> binary(values.size(), 1);
  return PQsendQueryPrepared(connection, name.c_str(), static_cast<int>(values.size()),
                             values.data(), lengths.data(), binary.data(), 1) == 1
             ? absl::OkStatus()
             : BareError(connection);
}

// The columns of the rows of a group.
struct Columns {
  std::vector<int64_t> ids, revisions;
  std::vector<double> min_x, min_y, max_x, max_y, existences;
  std::vector<storage::postgres::BlobView> shapes;
  std::vector<absl::string_view> labels, request_ids;

  void Add(const BareEdit& edit, int64_t revision) {
    const Box bounds = edit.object.shape.bounds();
    ids.push_back(edit.object.id);
    revisions.push_back(revision);
    min_x.push_back(bounds.min.x);
    min_y.push_back(bounds.min.y);
    max_x.push_back(bounds.max.x);
    max_y.push_back(bounds.max.y);
    existences.push_back(edit.object.existence);
    shapes.push_back({edit.shape});
    labels.push_back(edit.object.label);
    request_ids.push_back(edit.request_id);
  }
};

}  // namespace

void BareDatabase::Closer::operator()(pg_conn* connection) const { PQfinish(connection); }

absl::StatusOr<std::unique_ptr<BareDatabase>> BareDatabase::Open(const std::string& target) {
  std::unique_ptr<BareDatabase> bare(new BareDatabase(PQconnectdb(target.c_str())));
  pg_conn* const connection = bare->connection_.get();
  if (PQstatus(connection) != CONNECTION_OK) return BareError(connection);
  for (size_t i = 0; i < std::size(kStatements); ++i) {
    const BareResult result(
        PQprepare(connection, absl::StrCat(i).c_str(), kStatements[i], 0, nullptr));
    if (PQresultStatus(result.get()) != PGRES_COMMAND_OK) return BareError(connection);
  }
  for (const char* word : {"BEGIN", "COMMIT"}) {
    const BareResult result(PQprepare(connection, word, word, 0, nullptr));
    if (PQresultStatus(result.get()) != PGRES_COMMAND_OK) return BareError(connection);
  }
  HYPERMAP_RETURN_IF_ERROR(bare->ReadMap());
  if (PQenterPipelineMode(connection) != 1) return BareError(connection);
  return bare;
}

absl::Status BareDatabase::ReadMap() {
  const BareResult row(
      PQexec(connection_.get(), "SELECT id, epoch, last_write, revision FROM hypermap.maps"));
  if (PQntuples(row.get()) != 1) return BareError(connection_.get());
  int column = 0;
  for (int64_t* value : {&map_, &epoch_, &last_write_, &revision_}) {
    *value = std::strtoll(PQgetvalue(row.get(), 0, column++), nullptr, 10);
  }
  return absl::OkStatus();
}

absl::Status BareDatabase::Commit(absl::Span<const BareEdit> edits) {
  pg_conn* const c = connection_.get();
  const auto count = static_cast<int64_t>(edits.size());
  const auto send = [c](Statement statement, const auto&... values) {
    return Send(c, absl::StrCat(statement), values...);
  };
  const auto array = [](const auto& column) { return absl::MakeConstSpan(column); };
  HYPERMAP_RETURN_IF_ERROR(Send(c, "BEGIN"));
  HYPERMAP_RETURN_IF_ERROR(
      send(kFence, map_, epoch_, last_write_, last_write_ + 1, revision_, revision_ + count));
  Columns columns;
  for (const BareEdit& edit : edits) {
    columns.Add(edit, ++revision_);
    HYPERMAP_RETURN_IF_ERROR(send(kEnd, map_, edit.object.id, revision_));
  }
  ++last_write_;
  const auto revisions = array(columns.revisions);
  HYPERMAP_RETURN_IF_ERROR(send(kObjects, map_, array(columns.ids), revisions, array(columns.min_x),
                                array(columns.min_y), array(columns.max_x), array(columns.max_y),
                                array(columns.shapes), array(columns.labels),
                                array(columns.existences)));
  HYPERMAP_RETURN_IF_ERROR(send(kChanges, map_, revisions, array(columns.ids)));
  HYPERMAP_RETURN_IF_ERROR(send(kLayerRevisions, map_, revisions));
  HYPERMAP_RETURN_IF_ERROR(send(kReceipts, map_, array(columns.request_ids), revisions));
  HYPERMAP_RETURN_IF_ERROR(send(kRevisions, map_, revisions));
  HYPERMAP_RETURN_IF_ERROR(Send(c, "COMMIT"));
  if (PQpipelineSync(c) != 1) return BareError(c);
  return ReadAnswers();
}

absl::Status BareDatabase::ReadAnswers() {
  while (true) {
    // Null between the answers to two statements.
    const BareResult result(PQgetResult(connection_.get()));
    if (result == nullptr) continue;
    const ExecStatusType status = PQresultStatus(result.get());
    if (status == PGRES_PIPELINE_SYNC) return absl::OkStatus();
    const bool is_ended = status == PGRES_COMMAND_OK || status == PGRES_TUPLES_OK;
    if (!is_ended) return BareError(connection_.get());
    // Empty for BEGIN and COMMIT; the others change rows.
    if (absl::string_view(PQcmdTuples(result.get())) == "0") {
      return absl::InternalError("bare libpq: a statement changed no row");
    }
  }
}

}  // namespace hypermap::bench
