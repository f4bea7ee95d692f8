#include "tests/bench/bare_map.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace hypermap {
namespace {

void Check(bool ok, sqlite3* database, const char* what) {
  if (ok) return;
  std::fprintf(stderr, "bare SQLite: %s: %s\n", what, sqlite3_errmsg(database));
  std::exit(1);
}

// The number at `offset` of the envelope, which follows a header of 8 bytes.
template <int offset>
void Envelope(sqlite3_context* context, int, sqlite3_value** arguments) {
  const auto* blob = static_cast<const char*>(sqlite3_value_blob(arguments[0]));
  double value = 0;
  std::memcpy(&value, blob + 8 + 8 * offset, sizeof(value));
  sqlite3_result_double(context, value);
}

void IsEmpty(sqlite3_context* context, int, sqlite3_value** arguments) {
  const auto* blob = static_cast<const uint8_t*>(sqlite3_value_blob(arguments[0]));
  sqlite3_result_int(context, blob[3] >> 4 & 1);
}

void RegisterFunctions(sqlite3* database) {
  const struct {
    const char* name;
    void (*function)(sqlite3_context*, int, sqlite3_value**);
  } functions[] = {{"ST_IsEmpty", IsEmpty},
                   {"ST_MinX", Envelope<0>},
                   {"ST_MaxX", Envelope<1>},
                   {"ST_MinY", Envelope<2>},
                   {"ST_MaxY", Envelope<3>}};
  for (const auto& [name, function] : functions) {
    const int flags = SQLITE_UTF8 | SQLITE_DETERMINISTIC | SQLITE_INNOCUOUS;
    Check(sqlite3_create_function_v2(database, name, 1, flags, nullptr, function, nullptr, nullptr,
                                     nullptr) == SQLITE_OK,
          database, name);
  }
}

void BindText(sqlite3_stmt* statement, int index, const char* text, size_t size) {
  sqlite3_bind_text(statement, index, text, static_cast<int>(size), SQLITE_STATIC);
}

}  // namespace

BareMap::BareMap(const std::string& path, const std::string& table) {
  Check(sqlite3_open(path.c_str(), &database_) == SQLITE_OK, database_, "open");
  RegisterFunctions(database_);
  Check(sqlite3_exec(database_,
                     "PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; "
                     "PRAGMA temp_store = MEMORY; PRAGMA cache_size = -16384",
                     nullptr, nullptr, nullptr) == SQLITE_OK,
        database_, "settings");
  begin_ = Prepare("BEGIN IMMEDIATE");
  put_ = Prepare("INSERT INTO \"" + table +
                 "\" (id, geom, label, existence, classes, tags, attributes, version) "
                 "VALUES (?, ?, ?, ?, '{}', '[]', '{}', ?)");
  change_ = Prepare(
      "INSERT INTO hypermap_changes (revision, number, kind, lineage, object_id) "
      "VALUES (?, ?, 'put', 1, ?)");
  layer_revision_ = Prepare("INSERT INTO hypermap_layer_revisions VALUES (1, ?)");
  revision_row_ = Prepare("INSERT INTO hypermap_revisions VALUES (?, 0, 'bench', ?)");
  receipt_ = Prepare(
      "INSERT INTO hypermap_receipts (request_id, revision, time_ns, object_ids) "
      "VALUES (?, ?, 0, x'0102')");
  contents_ = Prepare(
      "UPDATE gpkg_contents SET last_change = '2026-01-01T00:00:00.000Z', max_x = max_x "
      "WHERE table_name = '" +
      table + "'");
  metadata_ = Prepare("UPDATE hypermap_metadata SET revision = ?, next_object_id = ? WHERE id = 1");
  commit_ = Prepare("COMMIT");
  revision_ = Query("SELECT revision FROM hypermap_metadata");
  next_id_ = Query("SELECT next_object_id FROM hypermap_metadata");
}

BareMap::~BareMap() {
  for (sqlite3_stmt* statement : statements_) sqlite3_finalize(statement);
  sqlite3_close(database_);
}

sqlite3_stmt* BareMap::Prepare(const std::string& sql) {
  sqlite3_stmt* statement = nullptr;
  Check(sqlite3_prepare_v3(database_, sql.c_str(), -1, SQLITE_PREPARE_PERSISTENT, &statement,
                           nullptr) == SQLITE_OK,
        database_, sql.c_str());
  statements_.push_back(statement);
  return statement;
}

int64_t BareMap::Query(const std::string& sql) {
  sqlite3_stmt* statement = Prepare(sql);
  Check(sqlite3_step(statement) == SQLITE_ROW, database_, sql.c_str());
  const int64_t value = sqlite3_column_int64(statement, 0);
  sqlite3_reset(statement);
  return value;
}

void BareMap::Commit(const BareRow* begin, const BareRow* end, const std::string& request_id) {
  const auto run = [&](sqlite3_stmt* statement) {
    Check(sqlite3_step(statement) == SQLITE_DONE, database_, sqlite3_sql(statement));
    sqlite3_reset(statement);
  };
  run(begin_);
  ++revision_;
  for (const BareRow* row = begin; row != end; ++row) {
    sqlite3_bind_int64(put_, 1, row->id);
    sqlite3_bind_blob(put_, 2, row->geometry.data(), static_cast<int>(row->geometry.size()),
                      SQLITE_STATIC);
    BindText(put_, 3, row->label.data(), row->label.size());
    sqlite3_bind_double(put_, 4, row->existence);
    sqlite3_bind_int64(put_, 5, revision_);
    run(put_);
    sqlite3_bind_int64(change_, 1, revision_);
    sqlite3_bind_int64(change_, 2, row - begin);
    sqlite3_bind_int64(change_, 3, row->id);
    run(change_);
  }
  next_id_ += end - begin;
  sqlite3_bind_int64(layer_revision_, 1, revision_);
  run(layer_revision_);
  sqlite3_bind_int64(revision_row_, 1, revision_);
  sqlite3_bind_int64(revision_row_, 2, end - begin);
  run(revision_row_);
  if (!request_id.empty()) {
    BindText(receipt_, 1, request_id.data(), request_id.size());
    sqlite3_bind_int64(receipt_, 2, revision_);
    run(receipt_);
  }
  run(contents_);
  sqlite3_bind_int64(metadata_, 1, revision_);
  sqlite3_bind_int64(metadata_, 2, next_id_);
  run(metadata_);
  run(commit_);
}

}  // namespace hypermap
