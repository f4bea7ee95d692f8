// A map at a past revision, read from the database.
#ifndef HYPERMAP_STORAGE_POSTGRES_PAST_MAP_H_
#define HYPERMAP_STORAGE_POSTGRES_PAST_MAP_H_

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "storage/history.h"
#include "storage/libpq/connection.h"
#include "storage/postgres/object_versions.h"
#include "storage/postgres/tile_versions.h"

namespace hypermap::storage::postgres {

// The structure of the map at one revision. It never changes, so it can be cached.
struct PastStructure {
  StructurePtr map;
  std::map<std::string, int64_t, std::less<>> lineages;  // of its layers
};
using PastStructurePtr = std::shared_ptr<const PastStructure>;

// `layers` and `frames` are the rows of AskForLayersAt and AskForFramesAt; no rows if there are no
// frames. `head` has the name of the map, its frame and the revision.
absl::StatusOr<PastStructurePtr> ReadStructure(Rows layers, Rows frames, MapStructure head);

// Borrows the readers. Everything is read within `transaction`, which is one of the connection.
class PostgresPastMap : public PastMap {
 public:
  PostgresPastMap(std::shared_ptr<Connection> connection, Transaction transaction,
                  ObjectVersions* objects, TileVersions* tiles, PastStructurePtr structure);

  const StructurePtr& structure() const override { return structure_->map; }
  absl::Status Expect(absl::Span<const Region> regions) override;
  absl::StatusOr<std::vector<ObjectPtr>> Objects(const std::string& layer, const Box& box) override;
  absl::StatusOr<std::vector<ObjectPtr>> Objects(const std::string& layer) override;
  absl::StatusOr<TileMap> Tiles(const std::string& layer, const CellBox& cells) override;

 private:
  struct Found {
    int64_t lineage = 0;
    LayerKind kind = LayerKind::kOccupancy;
  };
  // A region that was asked for.
  struct Asked {
    Region region;
    std::optional<Rows> rows;  // once they were read
  };
  // NOT_FOUND; FAILED_PRECONDITION when the layer is not a grid or, without `is_grid`, not
  // semantic.
  absl::StatusOr<Found> Find(const std::string& layer, bool is_grid) const;
  // Asks for the regions that are not empty, and forgets those asked for before.
  absl::Status Ask(absl::Span<const Region> regions);
  // The rows of a region that is not empty. Asks for it if that was not done before.
  absl::StatusOr<Rows> RowsOf(const Region& region);
  // Reads the rows of all that was asked for, so that the connection can be used otherwise.
  absl::StatusOr<Connection*> FinishAsking();
  absl::Status InMap(const absl::Status& status) const;

  const std::shared_ptr<Connection> connection_;  // outlives the transaction
  const Transaction transaction_;
  ObjectVersions* const objects_;
  TileVersions* const tiles_;
  const PastStructurePtr structure_;
  std::unique_ptr<Pipeline> asking_;  // null if all that was asked for was answered
  std::deque<Asked> asked_;           // whose rows were not used yet, in order
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_PAST_MAP_H_
