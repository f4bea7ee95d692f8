#include "storage/postgres/layer_versions.h"

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "base/status/status_macros.h"
#include "storage/encoding/frame_columns.h"

namespace hypermap::storage::postgres {
namespace {

// $columns stands for kLayerColumns. A layer without a version gives a row whose columns of it are
// NULL, so that it is found.
constexpr char kLayersAt[] = R"sql(
SELECT $columns, (
    SELECT max(r.revision) FROM hypermap.layer_revisions AS r
      WHERE r.map = $1 AND r.lineage = l.lineage AND r.revision <= $2)
  FROM hypermap.lineages AS l LEFT JOIN LATERAL (
    SELECT * FROM hypermap.layer_versions
      WHERE map = $1 AND lineage = l.lineage AND first_revision <= $2
      ORDER BY first_revision DESC LIMIT 1) AS v ON true
  WHERE l.map = $1 AND l.first_revision <= $2 AND l.end_revision > $2
  ORDER BY l.name
)sql";
constexpr char kLineages[] = R"sql(
SELECT $columns
  FROM hypermap.lineages AS l LEFT JOIN LATERAL (
    SELECT * FROM hypermap.layer_versions WHERE map = $1 AND lineage = l.lineage
      ORDER BY first_revision LIMIT 1) AS v ON true
  WHERE l.map = $1 AND l.lineage = ANY ($2)
)sql";

// Steps from frame to frame in the index, so that the number of versions of a frame costs nothing.
constexpr char kFramesAt[] = R"sql(
WITH RECURSIVE frame AS (
  SELECT min(child_frame_id) AS id FROM hypermap.frame_versions WHERE map = $1
  UNION ALL
  SELECT (SELECT min(child_frame_id) FROM hypermap.frame_versions
            WHERE map = $1 AND child_frame_id > frame.id)
    FROM frame WHERE frame.id IS NOT NULL)
SELECT v.child_frame_id, v.parent_frame_id, v.x, v.y, v.yaw
  FROM frame CROSS JOIN LATERAL (
    SELECT * FROM hypermap.frame_versions
      WHERE map = $1 AND child_frame_id = frame.id AND first_revision <= $2
      ORDER BY first_revision DESC LIMIT 1) AS v
)sql";

std::string WithLayerColumns(absl::string_view sql) {
  return absl::StrReplaceAll(sql, {{"$columns", kLayerColumns}});
}

absl::StatusOr<StoredLayer> ReadNamedLayerRow(Rows* row) {
  const int64_t lineage = row->Int64(0);
  absl::StatusOr<StoredLayer> layer = ReadLayerRow(row);
  if (layer.ok()) return layer;
  return absl::DataLossError(
      absl::StrCat("hypermap.lineages, lineage ", lineage, ": ", layer.status().message()));
}

}  // namespace

void AskForLayersAt(Pipeline& pipeline, int64_t map, Revision revision) {
  pipeline.Ask(WithLayerColumns(kLayersAt), map, revision);
}

absl::StatusOr<std::vector<LayerAt>> ReadLayersAt(Connection& connection, int64_t map,
                                                  Revision revision) {
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows,
                            connection.Query(WithLayerColumns(kLayersAt), map, revision));
  return LayersOf(std::move(rows));
}

absl::StatusOr<std::vector<LayerAt>> LayersOf(Rows rows) {
  std::vector<LayerAt> layers;
  while (rows.Next()) {
    HYPERMAP_ASSIGN_OR_RETURN(StoredLayer stored, ReadNamedLayerRow(&rows));
    const Revision version = rows.OptionalInt64(kNumLayerColumns).value_or(0);
    layers.push_back({std::move(stored), version});
  }
  HYPERMAP_RETURN_IF_ERROR(rows.row_status());
  return layers;
}

absl::StatusOr<std::map<int64_t, StoredLayer>> ReadLineages(Connection& connection, int64_t map,
                                                            absl::Span<const int64_t> lineages) {
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows,
                            connection.Query(WithLayerColumns(kLineages), map, lineages));
  std::map<int64_t, StoredLayer> layers;
  while (rows.Next()) {
    HYPERMAP_ASSIGN_OR_RETURN(StoredLayer layer, ReadNamedLayerRow(&rows));
    layers.emplace(layer.lineage, std::move(layer));
  }
  for (const int64_t lineage : lineages) {
    if (layers.contains(lineage)) continue;
    return absl::DataLossError(absl::StrCat("hypermap.lineages has no lineage ", lineage));
  }
  return layers;
}

void AskForFramesAt(Pipeline& pipeline, int64_t map, Revision revision) {
  pipeline.Ask(kFramesAt, map, revision);
}

absl::StatusOr<FrameTree> ReadFramesAt(Connection& connection, int64_t map, Revision revision) {
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows, connection.Query(kFramesAt, map, revision));
  return FramesOf(std::move(rows));
}

absl::StatusOr<FrameTree> FramesOf(Rows rows) {
  FrameTree frames;
  while (rows.Next()) {
    if (absl::Status status = AddFrameOf(&rows, &frames); !status.ok()) {
      return absl::DataLossError(
          absl::StrCat("hypermap.frame_versions, frame ", rows.Text(0), ": ", status.message()));
    }
  }
  return frames;
}

}  // namespace hypermap::storage::postgres
