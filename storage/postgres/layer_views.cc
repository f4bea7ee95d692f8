#include "storage/postgres/layer_views.h"

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "base/sync/start_thread.h"

namespace hypermap::storage::postgres {
namespace {

// Time between two updates that nobody asks for.
constexpr absl::Duration kPause = absl::Minutes(1);

// To drop a view waits for its readers, and its next readers wait for that.
constexpr char kWaitShortly[] = "SET lock_timeout = '200ms'";

// The statements that make the views as they should be, those first that wait for nobody.
//
// Names of maps and layers have no '/' and no ':'. The latter stands for '.', which OGR takes for
// the end of a schema's name. PostgreSQL's names have at most 63 bytes: the rest of a longer one is
// told by a digest. A view has the type of geometry that the layer has in a GeoPackage. Where that
// is any, there is no cast, so that an index of the geometries can be used.
constexpr char kDifferences[] = R"sql(
WITH wanted AS (
  SELECT CASE WHEN length(path) <= 63 THEN path
      ELSE left(path, 54) || '/' || left(md5(path), 8) END AS name,
    m.name AS map, l.name AS layer,
    CASE json_array_length(v.parameters::json -> 'shape_kinds') WHEN 1
      THEN replace(v.parameters::json -> 'shape_kinds' ->> 0, '_', '') ELSE 'geometry' END AS type
  FROM hypermap.maps AS m JOIN hypermap.lineages AS l ON l.map = m.id
    CROSS JOIN LATERAL (SELECT parameters FROM hypermap.layer_versions
      WHERE map = m.id AND lineage = l.lineage ORDER BY first_revision DESC LIMIT 1) AS v
    CROSS JOIN LATERAL (SELECT replace(m.name || '/' || l.name, '.', ':') AS path) AS p
  WHERE m.name IS NOT NULL AND NOT m.provisional AND NOT m.unfinished_copy AND l.kind = 'semantic'
    AND l.end_revision = 9223372036854775807),
present AS (
  SELECT c.relname::text AS name, lower(postgis_typmod_type(a.atttypmod)) AS type
  FROM pg_class AS c LEFT JOIN pg_attribute AS a ON a.attrelid = c.oid AND a.attname = 'geom'
  WHERE c.relnamespace = 'hypermap_layers'::regnamespace AND c.relkind = 'v'
    AND c.relname LIKE '%/%')
SELECT concat(
  CASE WHEN present.name IS NOT NULL
    THEN format('DROP VIEW IF EXISTS hypermap_layers.%I;', name) END,
  CASE WHEN wanted.name IS NOT NULL THEN format($view$
CREATE VIEW hypermap_layers.%I AS
  SELECT object_id AS id, geom%s AS geom, label, existence, classes, tags, attributes,
    height_min, height_max, first_revision AS version, expires_at_ns
  FROM hypermap.objects
  WHERE (map, lineage) = (
      SELECT m.id, l.lineage FROM hypermap.maps AS m JOIN hypermap.lineages AS l ON l.map = m.id
      WHERE m.name = %L AND NOT m.provisional AND NOT m.unfinished_copy AND l.name = %L
        AND l.kind = 'semantic' AND l.end_revision = 9223372036854775807)
    AND end_revision = 9223372036854775807
$view$, name, '::geometry(' || nullif(wanted.type, 'geometry') || ')', wanted.map,
    wanted.layer) END)
FROM wanted FULL JOIN present USING (name)
WHERE wanted.type IS DISTINCT FROM present.type
ORDER BY present.name IS NOT NULL
)sql";

absl::StatusOr<std::vector<std::string>> FindDifferences(Connection* connection) {
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows, connection->Query(kDifferences));
  std::vector<std::string> statements;
  while (rows.Next()) statements.emplace_back(rows.Text(0));
  HYPERMAP_RETURN_IF_ERROR(rows.row_status());
  return statements;
}

}  // namespace

absl::Status PrepareViewSchema(Connection* connection) {
  // Without the permission to create schemas, CREATE SCHEMA IF NOT EXISTS fails for any.
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::optional<int64_t> found,
      connection->QueryInt64("SELECT 1 FROM pg_namespace WHERE nspname = 'hypermap_layers'"));
  if (found) return absl::OkStatus();
  const absl::Status created = connection->Execute("CREATE SCHEMA IF NOT EXISTS hypermap_layers");
  // Another server has made it meanwhile.
  return absl::IsAlreadyExists(created) ? absl::OkStatus() : created;
}

absl::Status UpdateLayerViews(Connection* connection) {
  HYPERMAP_RETURN_IF_ERROR(connection->Execute(kWaitShortly));
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<std::string> statements, FindDifferences(connection));
  absl::Status first_error;
  for (const std::string& statement : statements) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    first_error.Update(connection->Execute(statement));
    if (connection->is_broken()) break;
  }
  return first_error;
}

absl::StatusOr<std::unique_ptr<LayerViews>> LayerViews::Start(const ConnectOptions& options) {
  std::unique_ptr<LayerViews> views(new LayerViews(options));
  HYPERMAP_ASSIGN_OR_RETURN(views->thread_, StartThread("hm-pg-views", [views = views.get()] {
                              views->UpdateUntilStopped();
                            }));
  return views;
}

LayerViews::~LayerViews() {
  if (!thread_.joinable()) return;
  {
    const MutexLock lock(&mutex_);
    is_stopping_ = true;
    changed_.NotifyAll();
  }
  thread_.join();
}

void LayerViews::Wake() {
  const MutexLock lock(&mutex_);
  is_awake_ = true;
  changed_.NotifyAll();
}

void LayerViews::UpdateUntilStopped() {
  Cancellation stop([this] {
    const MutexLock lock(&mutex_);
    return is_stopping_ ? absl::CancelledError("the store is closing") : absl::OkStatus();
  });
  const ScopedCancellation here(&stop);
  while (true) {
    {
      const MutexLock lock(&mutex_);
      if (!is_awake_ && !is_stopping_) changed_.WaitFor(&mutex_, kPause);
      if (is_stopping_) return;
      is_awake_ = false;
    }
    // What could not be done is a difference that the next update finds.
    Update().IgnoreError();
  }
}

absl::Status LayerViews::Update() const {
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<Connection> connection,
                            Connection::Open(options_));
  return UpdateLayerViews(connection.get());
}

}  // namespace hypermap::storage::postgres
