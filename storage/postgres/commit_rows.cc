#include "storage/postgres/commit_rows.h"

#include <algorithm>
#include <utility>

#include "absl/types/span.h"
#include "base/status/status_macros.h"
#include "storage/encoding/change_columns.h"
#include "storage/encoding/object_columns.h"
#include "storage/postgres/row_parts.h"
#include "storage/postgres/schema.h"

namespace hypermap::storage::postgres {
namespace {

constexpr char kInsertObjects[] = R"sql(
INSERT INTO hypermap.objects (map, lineage, object_id, first_revision, end_revision, bounds, shape,
    label, existence, classes, tags, attributes, height_min, height_max, expires_at_ns)
  SELECT $1, r.lineage, r.object_id, r.first_revision, $2,
      box(point(r.min_x, r.min_y), point(r.max_x, r.max_y)), r.shape, r.label, r.existence,
      r.classes, r.tags, r.attributes, r.height_min, r.height_max, r.expires_at_ns
    FROM unnest($3::bigint[], $4::bigint[], $5::bigint[], $6::float8[], $7::float8[],
        $8::float8[], $9::float8[], $10::bytea[], $11::text[], $12::float8[], $13::text[],
        $14::text[], $15::text[], $16::float8[], $17::float8[], $18::bigint[])
      AS r (lineage, object_id, first_revision, min_x, min_y, max_x, max_y, shape, label,
        existence, classes, tags, attributes, height_min, height_max, expires_at_ns)
)sql";
constexpr char kInsertTiles[] = R"sql(
INSERT INTO hypermap.tiles (map, lineage, tile_row, tile_col, first_revision, end_revision, image)
  SELECT $1, r.lineage, r.tile_row, r.tile_col, $2, $3, r.image
    FROM unnest($4::bigint[], $5::bigint[], $6::bigint[], $7::bytea[])
      AS r (lineage, tile_row, tile_col, image)
)sql";
// A detail that is NULL is sent as an empty text, which no detail is.
constexpr char kInsertChanges[] = R"sql(
INSERT INTO hypermap.changes (map, revision, number, kind, lineage, object_id, tile_row, tile_col,
    detail)
  SELECT $1, $2, r.number, r.kind, r.lineage, r.object_id, r.tile_row, r.tile_col,
      nullif(r.detail, '')
    FROM unnest($3::bigint[], $4::text[], $5::bigint[], $6::bigint[], $7::bigint[], $8::bigint[],
        $9::text[])
      AS r (number, kind, lineage, object_id, tile_row, tile_col, detail)
)sql";

template <typename Rows>
void DropLineage(int64_t lineage, Rows* rows) {
  rows->erase(std::remove_if(rows->begin(), rows->end(),
                             [lineage](const auto& row) { return row.lineage == lineage; }),
              rows->end());
}

}  // namespace

absl::Status ObjectRows::Add(int64_t lineage, const SemanticObject& object,
                             Revision first_revision) {
  HYPERMAP_ASSIGN_OR_RETURN(EncodedObject encoded, EncodeObject(object));
  rows_.push_back({lineage, object.id, first_revision, object.shape.bounds(),
                   std::move(encoded.shape), object.label, object.existence,
                   std::move(encoded.classes), std::move(encoded.tags),
                   std::move(encoded.attributes), encoded.height_min, encoded.height_max,
                   encoded.expires_at_ns});
  return absl::OkStatus();
}

void ObjectRows::Drop(int64_t lineage) { DropLineage(lineage, &rows_); }

void ObjectRows::Send(Pipeline& pipeline, int64_t map) const {
  InParts(
      absl::MakeConstSpan(rows_),
      [](const Row& row) { return row.shape.size() + row.attributes.size() + row.tags.size(); },
      [&](absl::Span<const Row> rows) { SendSome(pipeline, map, rows); });
}

void ObjectRows::SendSome(Pipeline& pipeline, int64_t map, absl::Span<const Row> rows) const {
  const auto integers = [&](auto get) { return Column<int64_t>(rows, get); };
  const auto doubles = [&](auto get) { return Column<double>(rows, get); };
  const auto texts = [&](auto get) { return Column<absl::string_view>(rows, get); };
  pipeline.Add(kInsertObjects, map, kForever, integers([](auto& r) { return r.lineage; }),
               integers([](auto& r) { return r.id; }),
               integers([](auto& r) { return r.first_revision; }),
               doubles([](auto& r) { return r.bounds.min.x; }),
               doubles([](auto& r) { return r.bounds.min.y; }),
               doubles([](auto& r) { return r.bounds.max.x; }),
               doubles([](auto& r) { return r.bounds.max.y; }),
               Column<BlobView>(rows, [](auto& r) { return BlobView{r.shape}; }),
               texts([](auto& r) { return absl::string_view(r.label); }),
               doubles([](auto& r) { return r.existence; }),
               texts([](auto& r) { return absl::string_view(r.classes); }),
               texts([](auto& r) { return absl::string_view(r.tags); }),
               texts([](auto& r) { return absl::string_view(r.attributes); }),
               Column<std::optional<double>>(rows, [](auto& r) { return r.height_min; }),
               Column<std::optional<double>>(rows, [](auto& r) { return r.height_max; }),
               Column<std::optional<int64_t>>(rows, [](auto& r) { return r.expires_at_ns; }));
}

void TileRows::Add(int64_t lineage, const TileIndex& index, std::string image) {
  rows_.push_back({lineage, index, std::move(image)});
}

void TileRows::Drop(int64_t lineage) { DropLineage(lineage, &rows_); }

void TileRows::Send(Pipeline& pipeline, int64_t map, Revision revision) const {
  InParts(
      absl::MakeConstSpan(rows_), [](const Row& row) { return row.image.size(); },
      [&](absl::Span<const Row> rows) {
        const auto integers = [&](auto get) { return Column<int64_t>(rows, get); };
        pipeline.Add(kInsertTiles, map, revision, kForever,
                     integers([](auto& r) { return r.lineage; }),
                     integers([](auto& r) { return r.index.row; }),
                     integers([](auto& r) { return r.index.col; }),
                     Column<BlobView>(rows, [](auto& r) { return BlobView{r.image}; }));
      });
}

absl::Status ChangeRows::Add(int64_t number, std::optional<int64_t> lineage, const Change& change) {
  HYPERMAP_ASSIGN_OR_RETURN(ChangeColumns columns, EncodeChange(change));
  Row row{number, columns.kind, lineage, columns.object_id, {}, {}, std::move(columns.detail)};
  if (columns.tile) {
    row.tile_row = columns.tile->row;
    row.tile_col = columns.tile->col;
  }
  rows_.push_back(std::move(row));
  return absl::OkStatus();
}

void ChangeRows::Send(Pipeline& pipeline, int64_t map, Revision revision) const {
  using OptionalInt = std::optional<int64_t>;
  InParts(
      absl::MakeConstSpan(rows_),
      [](const Row& row) { return row.detail ? row.detail->size() : 0; },
      [&](absl::Span<const Row> rows) {
        pipeline.Add(kInsertChanges, map, revision,
                     Column<int64_t>(rows, [](auto& r) { return r.number; }),
                     Column<absl::string_view>(rows, [](auto& r) { return r.kind; }),
                     Column<OptionalInt>(rows, [](auto& r) { return r.lineage; }),
                     Column<OptionalInt>(rows, [](auto& r) { return r.object_id; }),
                     Column<OptionalInt>(rows, [](auto& r) { return r.tile_row; }),
                     Column<OptionalInt>(rows, [](auto& r) { return r.tile_col; }),
                     Column<absl::string_view>(rows, [](auto& r) {
                       return r.detail ? absl::string_view(*r.detail) : absl::string_view();
                     }));
      });
}

}  // namespace hypermap::storage::postgres
