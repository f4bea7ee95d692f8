// The rows that a commit writes, gathered so that each table takes few statements.
#ifndef HYPERMAP_STORAGE_POSTGRES_COMMIT_ROWS_H_
#define HYPERMAP_STORAGE_POSTGRES_COMMIT_ROWS_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "map/edits/change.h"
#include "map/snapshot.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

// New versions of objects of hypermap.objects.
class ObjectRows {
 public:
  // INVALID_ARGUMENT for text that is not UTF-8.
  absl::Status Add(int64_t lineage, const SemanticObject& object, Revision first_revision);
  // Forgets the versions of a layer.
  void Drop(int64_t lineage);
  void Send(Pipeline& pipeline, int64_t map) const;

 private:
  struct Row {
    int64_t lineage;
    ObjectId id;
    Revision first_revision;
    Box bounds;
    std::string shape, label;
    double existence;
    std::string classes, tags, attributes;
    std::optional<double> height_min, height_max;
    std::optional<int64_t> expires_at_ns;
  };
  void SendSome(Pipeline& pipeline, int64_t map, absl::Span<const Row> rows) const;
  std::vector<Row> rows_;
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
  absl::Status Add(int64_t number, std::optional<int64_t> lineage, const Change& change);
  void Send(Pipeline& pipeline, int64_t map, Revision revision) const;

 private:
  struct Row {
    int64_t number;
    const char* kind;
    std::optional<int64_t> lineage, object_id, tile_row, tile_col;
    std::optional<std::string> detail;
  };
  std::vector<Row> rows_;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_COMMIT_ROWS_H_
