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
  SELECT $1, r.lineage, r.object_id, r.first_revision, r.end_revision,
      box(point(r.min_x, r.min_y), point(r.max_x, r.max_y)), r.shape, r.label, r.existence,
      r.classes, r.tags, r.attributes, r.height_min, r.height_max, r.expires_at_ns
    FROM unnest($2::bigint[], $3::bigint[], $4::bigint[], $5::bigint[], $6::float8[],
        $7::float8[], $8::float8[], $9::float8[], $10::bytea[], $11::text[], $12::float8[],
        $13::text[], $14::text[], $15::text[], $16::float8[], $17::float8[], $18::bigint[])
      AS r (lineage, object_id, first_revision, end_revision, min_x, min_y, max_x, max_y, shape,
        label, existence, classes, tags, attributes, height_min, height_max, expires_at_ns)
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
  SELECT $1, r.revision, r.number, r.kind, r.lineage, r.object_id, r.tile_row, r.tile_col,
      nullif(r.detail, '')
    FROM unnest($2::bigint[], $3::bigint[], $4::text[], $5::bigint[], $6::bigint[], $7::bigint[], $8::bigint[],
        $9::text[])
      AS r (revision, number, kind, lineage, object_id, tile_row, tile_col, detail)
)sql";
constexpr char kPutLayerRevisions[] = R"sql(
INSERT INTO hypermap.layer_revisions (map, lineage, revision)
  SELECT $1, r.lineage, r.revision
    FROM unnest($2::bigint[], $3::bigint[]) AS r (lineage, revision)
  ON CONFLICT (map, lineage, revision) DO NOTHING
)sql";
constexpr char kInsertRevisions[] = R"sql(
INSERT INTO hypermap.revisions (map, revision, time_ns, author, num_changes)
  SELECT $1, r.revision, r.time_ns, r.author, r.num_changes
    FROM unnest($2::bigint[], $3::bigint[], $4::text[], $5::bigint[])
      AS r (revision, time_ns, author, num_changes)
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
  rows_.push_back({lineage, object.id, first_revision, kForever, object.shape.bounds(),
                   std::move(encoded.shape), object.label, object.existence,
                   std::move(encoded.classes), std::move(encoded.tags),
                   std::move(encoded.attributes), encoded.height_min, encoded.height_max,
                   encoded.expires_at_ns});
  return absl::OkStatus();
}

bool ObjectRows::End(int64_t lineage, ObjectId id, Revision end_revision) {
  for (; num_placed_ < rows_.size(); ++num_placed_) {
    const Row& row = rows_[num_placed_];
    places_[{row.lineage, row.id}] = num_placed_;
  }
  const auto place = places_.find({lineage, id});
  if (place == places_.end()) return false;
  rows_[place->second].end_revision = end_revision;
  return true;
}

void ObjectRows::Drop(int64_t lineage) {
  DropLineage(lineage, &rows_);
  places_.clear();
  num_placed_ = 0;
}

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
  pipeline.Add(kInsertObjects, map, integers([](auto& r) { return r.lineage; }),
               integers([](auto& r) { return r.id; }),
               integers([](auto& r) { return r.first_revision; }),
               integers([](auto& r) { return r.end_revision; }),
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

absl::Status ChangeRows::Add(Revision revision, int64_t number, std::optional<int64_t> lineage,
                             const Change& change) {
  HYPERMAP_ASSIGN_OR_RETURN(ChangeColumns columns, EncodeChange(change));
  Row row{revision,          number, columns.kind, lineage,
          columns.object_id, {},     {},           std::move(columns.detail)};
  if (columns.tile) {
    row.tile_row = columns.tile->row;
    row.tile_col = columns.tile->col;
  }
  rows_.push_back(std::move(row));
  return absl::OkStatus();
}

void ChangeRows::Send(Pipeline& pipeline, int64_t map) const {
  using OptionalInt = std::optional<int64_t>;
  InParts(
      absl::MakeConstSpan(rows_),
      [](const Row& row) { return row.detail ? row.detail->size() : 0; },
      [&](absl::Span<const Row> rows) {
        pipeline.Add(kInsertChanges, map, Column<int64_t>(rows, [](auto& r) { return r.revision; }),
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

void LayerRevisionRows::Add(int64_t lineage, Revision revision) {
  lineages_.push_back(lineage);
  revisions_.push_back(revision);
}

void LayerRevisionRows::Send(Pipeline& pipeline, int64_t map) const {
  if (lineages_.empty()) return;
  pipeline.Add(kPutLayerRevisions, map, absl::MakeConstSpan(lineages_),
               absl::MakeConstSpan(revisions_));
}

void RevisionRows::Send(Pipeline& pipeline, int64_t map) const {
  InParts(
      absl::MakeConstSpan(records_), [](const RevisionRecord& r) { return r.author.size(); },
      [&](absl::Span<const RevisionRecord> rows) {
        const auto integers = [&](auto get) { return Column<int64_t>(rows, get); };
        pipeline.Add(
            kInsertRevisions, map, integers([](auto& r) { return r.revision; }),
            integers([](auto& r) { return absl::ToUnixNanos(r.time); }),
            Column<absl::string_view>(rows, [](auto& r) { return absl::string_view(r.author); }),
            integers([](auto& r) { return r.num_changes; }));
      });
}

}  // namespace hypermap::storage::postgres
