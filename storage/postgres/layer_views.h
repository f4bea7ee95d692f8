// Views of the semantic layers of all maps, for QGIS, ogrinfo and other programs that read PostGIS.
//
// The view "MAP/LAYER" in the schema hypermap_layers (with ':' for '.', and cut off after 63 bytes)
// has the objects that the layer has now, with the columns of a GeoPackage's feature table
// (docs/postgres_format.md). It finds its layer by the two names, and so stays right when a map is
// restored or a layer is made anew; until it is dropped it is empty.
//
// Views are made and dropped after the commits and not in their transactions: to drop a view waits
// for those who read it, and neither a program that reads slowly nor a missing permission may keep
// anybody from editing a map. A migration that alters a column of hypermap.objects has to drop the
// views first; they come back.
#ifndef HYPERMAP_STORAGE_POSTGRES_LAYER_VIEWS_H_
#define HYPERMAP_STORAGE_POSTGRES_LAYER_VIEWS_H_

#include <memory>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/sync/mutex.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

// Creates the schema of the views if there is none. FAILED_PRECONDITION if this role may not.
absl::Status PrepareViewSchema(Connection* connection);

// Makes the views that are missing, and drops those of layers that are no more. Goes on with the
// others if one can't be dropped, such as one that is being read, and returns the first error.
// Errors of CheckCancelled. REQUIRES: the schema of the views, and hypermap.objects has geometries.
absl::Status UpdateLayerViews(Connection* connection);

// Updates the views at the start, soon after each Wake, and every minute: the server that made or
// deleted a layer may have died before it came to the views. Has a connection only meanwhile.
// Thread safe.
class LayerViews {
 public:
  // `options` must be those of direct connections to the primary. RESOURCE_EXHAUSTED if there is no
  // thread for it.
  static absl::StatusOr<std::unique_ptr<LayerViews>> Start(const ConnectOptions& options);
  ~LayerViews();
  LayerViews(const LayerViews&) = delete;
  LayerViews& operator=(const LayerViews&) = delete;

  // Tells that there may be other layers.
  void Wake();

 private:
  explicit LayerViews(const ConnectOptions& options) : options_(options) {}
  void UpdateUntilStopped();
  absl::Status Update() const;

  const ConnectOptions options_;
  Mutex mutex_;
  CondVar changed_;
  bool is_awake_ ABSL_GUARDED_BY(mutex_) = true;
  bool is_stopping_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_LAYER_VIEWS_H_
