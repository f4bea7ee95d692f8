// Expressions of SQL for the names by which findings of a check call rows.
#ifndef HYPERMAP_STORAGE_POSTGRES_ROW_NAMES_H_
#define HYPERMAP_STORAGE_POSTGRES_ROW_NAMES_H_

namespace hypermap::storage::postgres {

// Of a row v of hypermap.objects, as ObjectVersion::Name.
inline constexpr char kObjectName[] =
    "'lineage ' || v.lineage || ', object ' || v.object_id || ', version ' || v.first_revision";
// Of a row v of hypermap.tiles, as TileVersion::Name.
inline constexpr char kTileName[] =
    "'lineage ' || v.lineage || ', tile_row ' || v.tile_row || ', tile_col ' || v.tile_col || "
    "', version ' || v.first_revision";
// Of an entry of a log of evidence, or of a state after it, as InRow.
inline constexpr char kEntryName[] =
    "'layer ' || layer || ', stamp_ns ' || stamp_ns || ', robot ' || robot || ', sequence ' || "
    "sequence || ', number ' || number";
// Of a row of hypermap.forgotten_sequences.
inline constexpr char kRangeName[] =
    "'layer ' || f.layer || ', robot ' || f.robot || ', sequence ' || f.first_sequence";

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_ROW_NAMES_H_
