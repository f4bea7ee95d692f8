#include "tests/bench/server/bare_database.h"

#include <endian.h>
#include <libpq-fe.h>

#include <bit>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/status/status_macros.h"

namespace hypermap::bench {
namespace {

// The statements, which are named by their place here. The types of all parameters follow from the
// columns.
enum Statement { kFence, kEnd, kObject, kChange, kLayerRevision, kReceipt, kRevision };
constexpr const char* kStatements[] = {
    "UPDATE hypermap.maps SET last_write = $4, revision = $6, provisional = false "
    "WHERE id = $1 AND epoch = $2 AND last_write = $3 AND revision = $5",
    "UPDATE hypermap.objects SET end_revision = $3 WHERE map = $1 AND lineage = 1 "
    "AND object_id = $2 AND end_revision = 9223372036854775807",
    "INSERT INTO hypermap.objects (map, lineage, object_id, first_revision, end_revision, bounds, "
    "shape, label, existence, classes, tags, attributes) VALUES ($1, 1, $2, $3, "
    "9223372036854775807, $4, $5, $6, $7, '{}', '[]', '{}')",
    "INSERT INTO hypermap.changes (map, revision, number, kind, lineage, object_id) "
    "VALUES ($1, $2, 0, 'put', 1, $3)",
    "INSERT INTO hypermap.layer_revisions (map, lineage, revision) VALUES ($1, 1, $2)",
    "INSERT INTO hypermap.receipts (map, request_id, revision, time_ns, object_ids, digest) "
    "VALUES ($1, $2, $3, $3, '\\x02', '\\x0102030405060708090a0b0c0d0e0f10')",
    "INSERT INTO hypermap.revisions (map, revision, time_ns, author, num_changes) "
    "VALUES ($1, $2, $2, 'bench', 1)"};

struct ClearResult {
  void operator()(PGresult* result) const { PQclear(result); }
};
using BareResult = std::unique_ptr<PGresult, ClearResult>;

absl::Status BareError(pg_conn* connection) {
  return absl::InternalError(absl::StrCat("bare libpq: ", PQerrorMessage(connection)));
}

// The parameters of a statement in binary format. Texts and blobs must outlive it.
class Values {
 public:
  Values& Add(int64_t value) {
    numbers_.push_back(htobe64(static_cast<uint64_t>(value)));
    return AddView({nullptr, sizeof value});
  }
  Values& Add(double value) { return Add(std::bit_cast<int64_t>(value)); }
  Values& AddView(absl::string_view value) {
    views_.push_back(value);
    return *this;
  }
  // Two corners, the greater one first.
  Values& Add(const Box& box) {
    const double corners[] = {box.max.x, box.max.y, box.min.x, box.min.y};
    for (int i = 0; i < 4; ++i) box_[i] = htobe64(std::bit_cast<uint64_t>(corners[i]));
    return AddView({reinterpret_cast<const char*>(box_), sizeof box_});
  }

  bool Send(pg_conn* connection, Statement statement) const {
    std::vector<const char*> values;
    std::vector<int> lengths;
    size_t number = 0;
    for (const absl::string_view view : views_) {
      values.push_back(view.data() != nullptr ? view.data()
                                              : reinterpret_cast<const char*>(&numbers_[number++]));
      lengths.push_back(static_cast<int>(view.size()));
    }
    const std::vector<int> binary(views_.size(), 1);
    const std::string name = absl::StrCat(statement);
    return PQsendQueryPrepared(connection, name.c_str(), static_cast<int>(values.size()),
                               values.data(), lengths.data(), binary.data(), 1) == 1;
  }

 private:
  std::vector<uint64_t> numbers_;
  std::vector<absl::string_view> views_;  // without data: the next number
  uint64_t box_[4];
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

absl::Status BareDatabase::Execute(const char* name) {
  return PQsendQueryPrepared(connection_.get(), name, 0, nullptr, nullptr, nullptr, 1) == 1
             ? absl::OkStatus()
             : BareError(connection_.get());
}

absl::Status BareDatabase::Commit(absl::Span<const BareEdit> edits) {
  pg_conn* const c = connection_.get();
  HYPERMAP_RETURN_IF_ERROR(Execute("BEGIN"));
  const auto count = static_cast<int64_t>(edits.size());
  bool sent = Values()
                  .Add(map_)
                  .Add(epoch_)
                  .Add(last_write_)
                  .Add(last_write_ + 1)
                  .Add(revision_)
                  .Add(revision_ + count)
                  .Send(c, kFence);
  for (const BareEdit& edit : edits) {
    const SemanticObject& object = edit.object;
    ++revision_;
    sent = sent && Values().Add(map_).Add(object.id).Add(revision_).Send(c, kEnd) &&
           Values()
               .Add(map_)
               .Add(object.id)
               .Add(revision_)
               .Add(object.shape.bounds())
               .AddView(edit.shape)
               .AddView(object.label)
               .Add(object.existence)
               .Send(c, kObject) &&
           Values().Add(map_).Add(revision_).Add(object.id).Send(c, kChange) &&
           Values().Add(map_).Add(revision_).Send(c, kLayerRevision) &&
           Values().Add(map_).AddView(edit.request_id).Add(revision_).Send(c, kReceipt) &&
           Values().Add(map_).Add(revision_).Send(c, kRevision);
  }
  ++last_write_;
  if (!sent) return BareError(c);
  HYPERMAP_RETURN_IF_ERROR(Execute("COMMIT"));
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
    // Each statement but BEGIN and COMMIT changes one row.
    const absl::string_view changed = PQcmdTuples(result.get());
    if (!changed.empty() && changed != "1") {
      return absl::InternalError("bare libpq: a statement changed no row");
    }
  }
}

}  // namespace hypermap::bench
