// Writes commits to the tables of a map, within a transaction of the caller.
#ifndef HYPERMAP_STORAGE_POSTGRES_CHANGE_WRITER_H_
#define HYPERMAP_STORAGE_POSTGRES_CHANGE_WRITER_H_

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "storage/libpq/connection.h"
#include "storage/map_store.h"
#include "storage/postgres/commit_rows.h"
#include "storage/postgres/layer_row.h"

namespace hypermap::storage::postgres {

// The layers of a map, and the number that the next new one gets.
struct OpenLayers {
  std::map<std::string, StoredLayer> by_name;
  int64_t next_lineage = 1;
};

// Sends the statements of commits. Nothing is read: the statements need no answers. Rows of several
// commits are inserted together, so that the number of statements does not grow with the number of
// commits. Finish sends the last ones.
class ChangeWriter {
 public:
  // `layers` are those of the map before the first commit.
  ChangeWriter(Pipeline* pipeline, int64_t map, OpenLayers layers);

  // Writes the changes of one commit, the ends of the versions that they replace, its evidence, its
  // receipt and its revision. INTERNAL when a change does not fit the map; INVALID_ARGUMENT for
  // text that is not UTF-8. Errors of CheckCancelled.
  absl::Status Write(const Commit& commit);
  // Sends the rows that are left. REQUIRES: nothing is written afterwards.
  void Finish() { SendRows(); }

  // The layers after the commits.
  const OpenLayers& layers() const { return layers_; }

 private:
  // The revision of `snapshot` that changed a layer last.
  Revision VersionOf(const std::string& layer, int64_t lineage, const Snapshot& snapshot) const;
  absl::Status Apply(const LayerCreated& change);
  absl::Status Apply(const LayerDeleted& change);
  absl::Status Apply(const TransformSet& change);
  absl::Status Apply(const ObjectPut& change);
  absl::Status Apply(const ObjectRemoved& change);
  absl::Status Apply(const TileWritten& change);
  absl::Status Apply(const ExtentGrown& change);
  absl::Status Apply(const AliasesSet& change);

  // Returns the layer and notes that the change in work is of it. INTERNAL when there is none, or
  // when it is of another sort.
  absl::StatusOr<StoredLayer*> Touch(const std::string& name);
  absl::StatusOr<StoredLayer*> TouchSemantic(const std::string& name);
  absl::StatusOr<StoredLayer*> TouchGrid(const std::string& name);
  // Ends the current version of an object.
  void EndObject(int64_t lineage, ObjectId id);
  // Sends the rows that are gathered.
  void SendRows();
  // Sends the extent and the parameters that a layer has from this revision on.
  absl::Status PutLayerVersion(const StoredLayer& layer);

  Pipeline* const pipeline_;
  const int64_t map_;
  OpenLayers layers_;
  // Of the commit in work.
  Revision revision_ = 0;
  std::map<int64_t, std::string> changed_;  // lineage -> layer
  std::optional<int64_t> lineage_;          // of the change in work, where it is of a layer
  TileRows tiles_;
  // Of this commit and those before it, since rows were sent.
  int64_t num_changes_ = 0;
  ObjectRows objects_;
  ChangeRows changes_;
  LayerRevisionRows layer_revisions_;
  std::vector<TimedReceipt> receipts_;
  RevisionRows revisions_;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_CHANGE_WRITER_H_
