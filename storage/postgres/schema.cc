#include "storage/postgres/schema.h"

#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/postgres/database_guard.h"
#include "storage/postgres/tables.h"

namespace hypermap::storage::postgres {
namespace {

// Servers that start together prepare the schema one after the other. The number is arbitrary; the
// lock ends with the transaction.
constexpr char kLock[] = "SELECT pg_advisory_xact_lock(7310582214)::text";

constexpr char kCreateVersion[] = R"sql(
CREATE SCHEMA hypermap;
CREATE EXTENSION IF NOT EXISTS btree_gist;
CREATE TABLE hypermap.schema_version (
  id integer PRIMARY KEY CHECK (id = 1),
  version bigint NOT NULL
);
)sql";

// Of version 1, to make version 2.
constexpr char kAddDraining[] =
    "ALTER TABLE hypermap.servers ADD COLUMN draining boolean NOT NULL DEFAULT false";

absl::StatusOr<bool> Exists(Connection* connection, const char* sql) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<int64_t> found, connection->QueryInt64(sql));
  return found.has_value();
}

absl::Status CreateSchema(Connection* connection) {
  HYPERMAP_RETURN_IF_ERROR(connection->Execute(absl::StrCat(kCreateVersion, kTables, kPlaceTable)));
  HYPERMAP_RETURN_IF_ERROR(RecordPlace(connection));
  return connection
      ->Query("INSERT INTO hypermap.schema_version (id, version) VALUES (1, $1)", kSchemaVersion)
      .status();
}

absl::Status Migrate(Connection* connection, int64_t version) {
  if (version < 2) {
    HYPERMAP_RETURN_IF_ERROR(connection->Execute(kAddDraining));
    HYPERMAP_RETURN_IF_ERROR(connection->Execute(kPlaceTable));
    // Whether it was restored before can't be told.
    HYPERMAP_RETURN_IF_ERROR(RecordPlace(connection));
  }
  return connection
      ->Query("UPDATE hypermap.schema_version SET version = $1 WHERE id = 1", kSchemaVersion)
      .status();
}

absl::Status BringUpToDate(Connection* connection) {
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::optional<int64_t> version,
      connection->QueryInt64("SELECT version FROM hypermap.schema_version WHERE id = 1"));
  if (!version) return absl::DataLossError("hypermap.schema_version has no row");
  if (*version == kSchemaVersion) return absl::OkStatus();
  if (*version < kSchemaVersion) return Migrate(connection, *version);
  return absl::FailedPreconditionError(
      absl::StrCat("schema version ", *version, " of the database is newer than this program's ",
                   kSchemaVersion));
}

absl::StatusOr<bool> HasPostgis(Connection* connection) {
  return Exists(connection, "SELECT 1 FROM pg_extension WHERE extname = 'postgis'");
}

// Installs PostGIS if the database may have it and this role may install it.
absl::StatusOr<bool> InstallPostgis(Connection* connection) {
  HYPERMAP_ASSIGN_OR_RETURN(
      const bool available,
      Exists(connection, "SELECT 1 FROM pg_available_extensions WHERE name = 'postgis'"));
  if (!available) return false;
  HYPERMAP_RETURN_IF_ERROR(connection->Execute("SAVEPOINT without_postgis"));
  if (connection->Execute("CREATE EXTENSION postgis").ok()) return true;
  HYPERMAP_RETURN_IF_ERROR(connection->Execute("ROLLBACK TO SAVEPOINT without_postgis"));
  return false;
}

absl::StatusOr<bool> AddGeometry(Connection* connection) {
  HYPERMAP_ASSIGN_OR_RETURN(const bool has_column, HasGeometry(connection));
  if (has_column) return true;
  HYPERMAP_ASSIGN_OR_RETURN(bool has_postgis, HasPostgis(connection));
  if (!has_postgis) {
    HYPERMAP_ASSIGN_OR_RETURN(has_postgis, InstallPostgis(connection));
  }
  if (!has_postgis) return false;
  HYPERMAP_RETURN_IF_ERROR(
      connection->Execute(absl::StrCat("ALTER TABLE hypermap.objects ADD COLUMN geom geometry "
                                       "GENERATED ALWAYS AS (ST_GeomFromWKB(",
                                       kWkbOfShape, ")) STORED")));
  return true;
}

}  // namespace

absl::StatusOr<bool> HasGeometry(Connection* connection) {
  return Exists(connection,
                "SELECT 1 FROM pg_attribute WHERE attrelid = 'hypermap.objects'::regclass "
                "AND attname = 'geom' AND NOT attisdropped");
}

absl::StatusOr<bool> PrepareSchema(Connection* connection) {
  HYPERMAP_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(connection));
  HYPERMAP_RETURN_IF_ERROR(connection->Query(kLock).status());
  HYPERMAP_ASSIGN_OR_RETURN(
      const bool exists,
      Exists(connection, "SELECT 1 FROM pg_namespace WHERE nspname = 'hypermap'"));
  HYPERMAP_RETURN_IF_ERROR(exists ? BringUpToDate(connection) : CreateSchema(connection));
  HYPERMAP_ASSIGN_OR_RETURN(const bool has_geometry, AddGeometry(connection));
  HYPERMAP_RETURN_IF_ERROR(transaction.Commit());
  return has_geometry;
}

}  // namespace hypermap::storage::postgres
