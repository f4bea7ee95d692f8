#include "storage/geopackage/packed_index.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "base/status/status_macros.h"

namespace hypermap::storage {
namespace {

constexpr int64_t kRootNode = 1;
constexpr size_t kNodeHeaderBytes = 4;
constexpr size_t kCellBytes = 24;
// Part of each node that is filled. The rest stays free, so that later edits need not split every
// node that they reach.
constexpr double kFill = 0.85;

// True if the tree consists of an empty root of height 0, with a node size of at least 1000 bytes.
// $t is the tree's name.
constexpr char kIsNewTree[] = R"sql(
SELECT length(data) >= 1000 AND hex(substr(data, 1, 4)) = '00000000'
    AND NOT EXISTS (SELECT 1 FROM "$t_node" WHERE nodeno <> 1)
    AND NOT EXISTS (SELECT 1 FROM "$t_rowid")
    AND NOT EXISTS (SELECT 1 FROM "$t_parent")
  FROM "$t_node" WHERE nodeno = 1
)sql";

// SQLite's own rounding to floats (rtreeValueDown, rtreeValueUp of ext/rtree/rtree.c).
constexpr double kTowardsZero = 1.0 - 1.0 / 8388608.0;
constexpr double kAwayFromZero = 1.0 + 1.0 / 8388608.0;

float RoundDown(double value) {
  const auto rounded = static_cast<float>(value);
  if (rounded <= value) return rounded;
  return static_cast<float>(value * (value < 0 ? kAwayFromZero : kTowardsZero));
}

float RoundUp(double value) {
  const auto rounded = static_cast<float>(value);
  if (rounded >= value) return rounded;
  return static_cast<float>(value * (value < 0 ? kTowardsZero : kAwayFromZero));
}

// Twice the middle of a cell along an axis; only the order matters.
template <int axis>
float Middle(const IndexCell& cell) {
  return cell.box[2 * axis] + cell.box[2 * axis + 1];
}

// The index at which part `i` begins if `size` cells are divided into `parts` nearly equal parts.
size_t PartBegin(size_t size, size_t parts, size_t i) { return size * i / parts; }

size_t DivideUp(size_t a, size_t b) { return (a + b - 1) / b; }

// Cuts the plane into slabs, and the slabs into tiles of at most `capacity` cells. Sorts the cells
// by tile. Returns the index at which each tile begins, followed by the number of cells.
std::vector<size_t> SortIntoTiles(std::vector<IndexCell>* cells, size_t capacity) {
  const size_t num_slabs =
      static_cast<size_t>(std::ceil(std::sqrt(double(DivideUp(cells->size(), capacity)))));
  std::sort(cells->begin(), cells->end(),
            [](const auto& a, const auto& b) { return Middle<0>(a) < Middle<0>(b); });
  std::vector<size_t> begins;
  for (size_t slab = 0; slab < num_slabs; ++slab) {
    const size_t begin = PartBegin(cells->size(), num_slabs, slab);
    const size_t size = PartBegin(cells->size(), num_slabs, slab + 1) - begin;
    // Every second slab runs backwards, so that its first tile is next to the last of the one
    // before.
    const bool is_back = slab % 2 == 1;
    std::sort(cells->begin() + begin, cells->begin() + begin + size,
              [is_back](const auto& a, const auto& b) {
                return is_back ? Middle<1>(b) < Middle<1>(a) : Middle<1>(a) < Middle<1>(b);
              });
    const size_t num_tiles = DivideUp(size, capacity);
    for (size_t i = 0; i < num_tiles; ++i) begins.push_back(begin + PartBegin(size, num_tiles, i));
  }
  begins.push_back(cells->size());
  return begins;
}

IndexCell Around(int64_t id, const IndexCell* begin, const IndexCell* end) {
  IndexCell around{id, begin->box};
  for (const IndexCell* cell = begin + 1; cell != end; ++cell) {
    for (const int axis : {0, 1}) {
      float& min = around.box[2 * axis];
      float& max = around.box[2 * axis + 1];
      min = std::min(min, cell->box[2 * axis]);
      max = std::max(max, cell->box[2 * axis + 1]);
    }
  }
  return around;
}

template <typename T>
char* WriteBigEndian(T value, char* out) {
  for (size_t i = 0; i < sizeof(T); ++i) {
    *out++ = static_cast<char>(value >> (8 * (sizeof(T) - 1 - i)));
  }
  return out;
}

// Writes the encoded node to `block`, whose size stays the same.
void WriteNode(uint16_t height, const IndexCell* begin, const IndexCell* end, std::string* block) {
  std::fill(block->begin(), block->end(), '\0');
  char* out = WriteBigEndian(height, block->data());
  out = WriteBigEndian(static_cast<uint16_t>(end - begin), out);
  for (const IndexCell* cell = begin; cell != end; ++cell) {
    out = WriteBigEndian(static_cast<uint64_t>(cell->id), out);
    for (const float bound : cell->box) out = WriteBigEndian(std::bit_cast<uint32_t>(bound), out);
  }
}

// Writes the tables of a tree, level by level from the leaves.
class TreeWriter {
 public:
  static absl::StatusOr<TreeWriter> Open(Database* database, const std::string& tree);

  // Writes the nodes of a level. Returns a cell for each node: the content of the next level.
  absl::StatusOr<std::vector<IndexCell>> WriteLevel(std::vector<IndexCell> cells);
  absl::Status WriteRoot(const std::vector<IndexCell>& cells);

  bool FitsInRoot(size_t num_cells) const { return num_cells <= capacity_; }

 private:
  TreeWriter(Database* database, const std::string& tree, size_t node_bytes, Statement write_node)
      : database_(database),
        tree_(tree),
        block_(node_bytes, '\0'),
        write_node_(std::move(write_node)),
        capacity_(static_cast<size_t>((node_bytes - kNodeHeaderBytes) / kCellBytes * kFill)) {}

  // Writes the node that contains each cell: to the _rowid table for cells of leaves, otherwise to
  // the _parent table.
  absl::Status WritePlaces(std::vector<std::pair<int64_t, int64_t>> places);

  Database* database_;
  std::string tree_;
  std::string block_;
  Statement write_node_;
  size_t capacity_;
  uint16_t height_ = 0;  // height of the current level; leaves have 0
  int64_t next_node_ = kRootNode + 1;
};

absl::StatusOr<TreeWriter> TreeWriter::Open(Database* database, const std::string& tree) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<int64_t> node_bytes,
                            database->QueryInt64(absl::StrCat("SELECT length(data) FROM \"", tree,
                                                              "_node\" WHERE nodeno = 1")));
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement write_node,
      database->Prepare(absl::StrCat("INSERT OR REPLACE INTO \"", tree, "_node\" VALUES (?, ?)")));
  return TreeWriter(database, tree, static_cast<size_t>(node_bytes.value_or(0)),
                    std::move(write_node));
}

absl::Status TreeWriter::WritePlaces(std::vector<std::pair<int64_t, int64_t>> places) {
  std::sort(places.begin(), places.end());
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement write,
      database_->Prepare(absl::StrCat("INSERT INTO \"", tree_, height_ == 0 ? "_rowid" : "_parent",
                                      "\" VALUES (?, ?)")));
  for (const auto& [cell, node] : places) {
    HYPERMAP_RETURN_IF_ERROR(write.Bind(cell, node).Run());
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<IndexCell>> TreeWriter::WriteLevel(std::vector<IndexCell> cells) {
  const std::vector<size_t> begins = SortIntoTiles(&cells, capacity_);
  std::vector<IndexCell> parents;
  std::vector<std::pair<int64_t, int64_t>> places;
  places.reserve(cells.size());
  for (size_t i = 0; i + 1 < begins.size(); ++i) {
    const int64_t node = next_node_++;
    const IndexCell* begin = &cells[begins[i]];
    const IndexCell* end = cells.data() + begins[i + 1];
    WriteNode(/*height=*/0, begin, end, &block_);
    HYPERMAP_RETURN_IF_ERROR(write_node_.Bind(node, BlobView{block_}).Run());
    parents.push_back(Around(node, begin, end));
    for (const IndexCell* cell = begin; cell != end; ++cell) places.emplace_back(cell->id, node);
  }
  HYPERMAP_RETURN_IF_ERROR(WritePlaces(std::move(places)));
  ++height_;
  return parents;
}

absl::Status TreeWriter::WriteRoot(const std::vector<IndexCell>& cells) {
  WriteNode(height_, cells.data(), cells.data() + cells.size(), &block_);
  HYPERMAP_RETURN_IF_ERROR(write_node_.Bind(kRootNode, BlobView{block_}).Run());
  std::vector<std::pair<int64_t, int64_t>> places;
  for (const IndexCell& cell : cells) places.emplace_back(cell.id, kRootNode);
  return WritePlaces(std::move(places));
}

}  // namespace

IndexCell IndexCell::Of(int64_t id, const Box& box) {
  return {id, {RoundDown(box.min.x), RoundUp(box.max.x), RoundDown(box.min.y), RoundUp(box.max.y)}};
}

void SortInSpace(std::vector<IndexCell>* cells) {
  // Smaller than the nodes of a tree, which have a few dozen cells.
  constexpr size_t kTileSize = 8;
  SortIntoTiles(cells, kTileSize);
}

absl::StatusOr<bool> IsNewTree(Database* database, const std::string& tree) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<int64_t> is_new,
                            database->QueryInt64(absl::StrReplaceAll(kIsNewTree, {{"$t", tree}})));
  return is_new.value_or(0) == 1;
}

absl::Status PackTree(Database* database, const std::string& tree, std::vector<IndexCell> cells) {
  HYPERMAP_ASSIGN_OR_RETURN(TreeWriter writer, TreeWriter::Open(database, tree));
  while (!writer.FitsInRoot(cells.size())) {
    HYPERMAP_ASSIGN_OR_RETURN(std::vector<IndexCell> parents, writer.WriteLevel(std::move(cells)));
    cells = std::move(parents);
  }
  return writer.WriteRoot(cells);
}

}  // namespace hypermap::storage
