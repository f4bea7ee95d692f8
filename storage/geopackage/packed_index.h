// Fills the R*Tree of an empty feature table at once, which is much faster than entry by entry. The
// tree is packed bottom up by tiles (Leutenegger, Lopez, Edgington, "STR: A simple and efficient
// algorithm for R-tree packing", ICDE 1997) and written to the tables in which SQLite's R*Tree
// module keeps it:
//
//   <tree>_node    nodeno, data. A node is a block of fixed size, big-endian: in the root (nodeno
//                  1) the height of the tree, else 0 (16 bits); the number of cells (16 bits); the
//                  cells: id of the entry, or number of the child (64 bits), then min and max of x
//                  and of y (floats, rounded outwards as the module does). Zeros after that.
//   <tree>_rowid   from each entry to its leaf
//   <tree>_parent  from each node to its parent; the root has none
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

// An entry or a node of the tree, with its box as it is stored.
struct IndexCell {
  int64_t id = 0;
  std::array<float, 4> box{};  // min x, max x, min y, max y

  // REQUIRES: the box is not empty; it may have no extent.
  static IndexCell Of(int64_t id, const Box& box);
};

// Sorts cells so that those that follow each other are near each other.
void SortInSpace(std::vector<IndexCell>* cells);

// Returns whether the R*Tree of that name is empty and has the layout of a newly created one.
absl::StatusOr<bool> IsNewTree(Database* database, const std::string& tree);

// Fills a tree. REQUIRES: IsNewTree; the caller has begun a transaction and allows writing to
// shadow tables (SQLITE_DBCONFIG_DEFENSIVE is off).
absl::Status PackTree(Database* database, const std::string& tree, std::vector<IndexCell> cells);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_PACKED_INDEX_H_
