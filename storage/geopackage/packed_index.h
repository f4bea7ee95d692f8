// Filling the R*Tree of an empty feature table at once: packed bottom up by tiles (Leutenegger,
// Lopez, Edgington, "STR: A simple and efficient algorithm for R-tree packing", ICDE 1997) and
// written to SQLite's own tables of the tree, whose format is that of SQLite's R*Tree module:
//
//   <tree>_node    nodeno, data. A node is a block of fixed size, big-endian: in the root (nodeno
//                  1) the height of the tree, else 0 (16 bits); the number of cells (16 bits); the
//                  cells: id of the entry, or number of the child (64 bits), then min and max of x
//                  and of y (floats, rounded outwards as the module does). Zeros after that.
//   <tree>_rowid   entry -> the leaf it is in
//   <tree>_parent  node -> its parent; the root has none
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_PACKED_INDEX_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_PACKED_INDEX_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "map/geometry/point.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// An entry of the tree, or one of its nodes, with its box as it is stored.
struct IndexCell {
  int64_t id = 0;
  std::array<float, 4> box{};  // min x, max x, min y, max y

  // Not of an empty box.
  static IndexCell Of(int64_t id, const Box& box);
};

// Brings cells into an order in which those that follow each other are near each other.
void SortInSpace(std::vector<IndexCell>* cells);

// Whether the R*Tree of that name is empty and as a new one is made.
absl::StatusOr<bool> IsNewTree(Database* database, const std::string& tree);

// Fills a tree for which IsNewTree. Within a transaction of the caller, who allows writing to the
// tables of virtual ones.
absl::Status PackTree(Database* database, const std::string& tree, std::vector<IndexCell> cells);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_PACKED_INDEX_H_
