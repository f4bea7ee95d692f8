// The rows that commits write, gathered so that each table takes few statements.
#ifndef HYPERMAP_STORAGE_POSTGRES_COMMIT_ROWS_H_
#define HYPERMAP_STORAGE_POSTGRES_COMMIT_ROWS_H_

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/types/span.h"
#include "map/edits/change.h"
#include "map/snapshot.h"
#include "storage/history.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

// New versions of objects of hypermap.objects.
class ObjectRows {
 public:
  // INVALID_ARGUMENT for text that is not UTF-8.
  absl::Status Add(int64_t lineage, const SemanticObject& object, Revision first_revision);
  // Ends the version that was added last of an object. False if none was, so that the version is in
  // the table.
  bool End(int64_t lineage, ObjectId id, Revision end_revision);
  // Forgets the versions of a layer.
  void Drop(int64_t lineage);
  void Send(Pipeline& pipeline, int64_t map) const;

 private:
  struct Row {
    int64_t lineage;
    ObjectId id;
    Revision first_revision, end_revision;
    Box bounds;
    std::string shape, label;
    double existence;
    std::string classes, tags, attributes;
    std::optional<double> height_min, height_max;
    std::optional<int64_t> expires_at_ns;
  };
  void SendSome(Pipeline& pipeline, int64_t map, absl::Span<const Row> rows) const;
  std::vector<Row> rows_;
  // The places in rows_ of the newest versions of objects, for the first num_placed_ rows. Only End
  // needs them, so that a bulk load makes none.
  absl::flat_hash_map<std::pair<int64_t, ObjectId>, size_t> places_;
  size_t num_placed_ = 0;
};

// New versions of tiles of hypermap.tiles.
class TileRows {
 public:
  void Add(int64_t lineage, const TileIndex& index, std::string image);
  void Drop(int64_t lineage);
  void Send(Pipeline& pipeline, int64_t map, Revision revision) const;

 private:
  struct Row {
    int64_t lineage;
    TileIndex index;
    std::string image;
  };
  std::vector<Row> rows_;
};

// Rows of hypermap.changes.
class ChangeRows {
 public:
  // `lineage` is that of the layer that the change is of; nullopt if it is of none.
  // INVALID_ARGUMENT for text that is not UTF-8.
  absl::Status Add(Revision revision, int64_t number, std::optional<int64_t> lineage,
                   const Change& change);
  void Send(Pipeline& pipeline, int64_t map) const;

 private:
  struct Row {
    Revision revision;
    int64_t number;
    const char* kind;
    std::optional<int64_t> lineage, object_id, tile_row, tile_col;
    std::optional<std::string> detail;
  };
  std::vector<Row> rows_;
};

// Rows of hypermap.layer_revisions.
class LayerRevisionRows {
 public:
  void Add(int64_t lineage, Revision revision);
  void Send(Pipeline& pipeline, int64_t map) const;

 private:
  std::vector<int64_t> lineages_;
  std::vector<Revision> revisions_;
};

// Rows of hypermap.revisions.
class RevisionRows {
 public:
  void Add(RevisionRecord record) { records_.push_back(std::move(record)); }
  void Send(Pipeline& pipeline, int64_t map) const;

 private:
  std::vector<RevisionRecord> records_;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_COMMIT_ROWS_H_
