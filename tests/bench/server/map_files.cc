#include "tests/bench/server/map_files.h"

#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "map/edits/apply.h"
#include "storage/encoding/geometry_blob.h"
#include "storage/geopackage/geopackage_store.h"
#include "storage/geopackage/schema.h"

namespace hypermap::bench {
namespace {

namespace fs = std::filesystem;

// Version of the generated content. Increase it to have kept files generated again.
constexpr int kContentVersion = 1;
constexpr double kResolution = 0.05;
constexpr int32_t kStripRows = 512;

absl::Status WriteBatch(storage::StoredMap* map, Snapshot* newest, EditBatch batch) {
  batch.time = absl::Now();
  storage::Commit commit;
  absl::StatusOr<AppliedBatch> applied = Apply(*newest, batch);
  HYPERMAP_RETURN_IF_ERROR(applied.status());
  *newest = *applied->snapshot;
  commit.applied = *std::move(applied);
  commit.time = batch.time;
  return map->Write({&commit, 1});
}

absl::StatusOr<std::unique_ptr<storage::StoredMap>> CreateMap(storage::MapStore* store,
                                                              const std::string& name,
                                                              const LayerSpec& layer,
                                                              Snapshot* newest) {
  storage::MapHeader header;
  header.name = name;
  header.frame_id = newest->frame_id;
  header.created_at = absl::Now();
  absl::StatusOr<std::unique_ptr<storage::StoredMap>> map = store->Create(header);
  HYPERMAP_RETURN_IF_ERROR(map.status());
  newest->map_name = name;
  EditBatch batch;
  batch.edits.push_back(CreateLayer{layer});
  if (absl::Status status = WriteBatch(map->get(), newest, std::move(batch)); !status.ok()) {
    return status;
  }
  return map;
}

// Free rooms of 4 m with walls of two cells and doors, and some clutter, partly unknown.
std::optional<double> CellValue(int32_t row, int32_t col) {
  constexpr int32_t kRoom = 80;
  const int32_t r = row % kRoom;
  const int32_t c = col % kRoom;
  const bool door = (r > 30 && r < 50) || (c > 30 && c < 50);
  if ((r < 2 || c < 2) && !door) return 0.98;
  const uint32_t patch =
      static_cast<uint32_t>(row / 7) * 2654435761U ^ static_cast<uint32_t>(col / 9) * 2246822519U;
  if (patch % 97 == 0) return std::nullopt;
  if (patch % 89 == 0) return 0.86;
  return patch % 5 == 0 ? 0.04 : 0.02;
}

absl::Status MakeGrid(const std::string& folder, int side) {
  absl::StatusOr<std::unique_ptr<storage::MapStore>> store = storage::OpenGeoPackageStore(folder);
  HYPERMAP_RETURN_IF_ERROR(store.status());
  LayerSpec layer{.name = kGridLayer, .kind = LayerKind::kOccupancy};
  layer.grid = GridGeometry{{}, kResolution};
  Snapshot newest;
  absl::StatusOr<std::unique_ptr<storage::StoredMap>> map =
      CreateMap(store->get(), kGridMap, layer, &newest);
  HYPERMAP_RETURN_IF_ERROR(map.status());
  for (int32_t row = 0; row < side; row += kStripRows) {
    WriteCells edit{kGridLayer, {row, std::min(row + kStripRows, side), 0, side}, {}};
    edit.values.reserve(edit.box.num_cells());
    for (int32_t r = edit.box.row_begin; r < edit.box.row_end; ++r) {
      for (int32_t c = 0; c < side; ++c) edit.values.push_back(CellValue(r, c));
    }
    EditBatch batch;
    batch.edits.push_back(std::move(edit));
    HYPERMAP_RETURN_IF_ERROR(WriteBatch(map->get(), &newest, std::move(batch)));
  }
  return absl::OkStatus();
}

absl::Status MakeSite(const std::string& folder, const GeneratedSite& site) {
  absl::StatusOr<std::unique_ptr<storage::MapStore>> store = storage::OpenGeoPackageStore(folder);
  HYPERMAP_RETURN_IF_ERROR(store.status());
  // One commit, which is the fastest way to load a map.
  return WriteSite(store->get(), site, site.num_objects());
}

// Returns the folder from the cache, or generates it atomically.
absl::StatusOr<std::string> Kept(const std::string& cache, const std::string& name,
                                 const std::function<absl::Status(const std::string&)>& make) {
  const std::string folder = absl::StrCat(cache, "/", name, "-schema", storage::kSchemaVersion,
                                          "-content", kContentVersion);
  if (fs::exists(folder)) return folder;
  const std::string unfinished = folder + ".new";
  std::error_code error;
  fs::remove_all(unfinished, error);
  fs::create_directories(unfinished, error);
  HYPERMAP_RETURN_IF_ERROR(make(unfinished));
  fs::rename(unfinished, folder, error);
  if (error) return absl::InternalError(absl::StrCat(folder, ": ", error.message()));
  return folder;
}

}  // namespace

bool IsGridCell(int32_t row, int32_t col, double value) {
  const std::optional<double> right = CellValue(row, col);
  return right ? std::abs(*right - value) < 1e-6 : std::isnan(value);
}

absl::StatusOr<std::unique_ptr<storage::StoredMap>> CreateObjectsMap(storage::MapStore* store,
                                                                     const std::string& name) {
  Snapshot newest;
  return CreateMap(store, name, {.name = kObjectsLayer, .kind = LayerKind::kSemantic}, &newest);
}

storage::Commit CommitOfObjects(const GeneratedSite& site, int64_t first, int64_t count,
                                Revision revision) {
  auto snapshot = std::make_shared<Snapshot>();
  snapshot->revision = revision;
  snapshot->next_object_id = first + count + 1;
  storage::Commit commit;
  commit.time = absl::Now();
  commit.applied.changes.reserve(count);
  for (int64_t i = first; i < first + count; ++i) {
    auto object = std::make_shared<SemanticObject>(site.Object(i));
    object->version = revision;
    commit.applied.changes.emplace_back(ObjectPut{kObjectsLayer, nullptr, std::move(object)});
    commit.applied.object_ids.push_back(i + 1);
  }
  commit.applied.snapshot = std::move(snapshot);
  return commit;
}

absl::Status WriteSite(storage::MapStore* store, const GeneratedSite& site, int64_t per_commit) {
  absl::StatusOr<std::unique_ptr<storage::StoredMap>> map = CreateObjectsMap(store, kSiteMap);
  HYPERMAP_RETURN_IF_ERROR(map.status());
  Revision revision = 1;
  for (int64_t first = 0; first < site.num_objects(); first += per_commit) {
    const int64_t count = std::min(per_commit, site.num_objects() - first);
    const storage::Commit commit = CommitOfObjects(site, first, count, ++revision);
    HYPERMAP_RETURN_IF_ERROR((*map)->Write({&commit, 1}));
  }
  return absl::OkStatus();
}

BareRow ToBareRow(const SemanticObject& object) {
  return {object.id, storage::EncodeGeometryBlob(object.shape), object.label, object.existence};
}

absl::StatusOr<std::string> SiteFolder(const std::string& cache, const GeneratedSite& site) {
  return Kept(cache, absl::StrCat("site-", site.num_objects()),
              [&site](const std::string& folder) { return MakeSite(folder, site); });
}

absl::StatusOr<std::string> GridFolder(const std::string& cache, int side) {
  return Kept(cache, absl::StrCat("grid-", side),
              [side](const std::string& folder) { return MakeGrid(folder, side); });
}

ScratchFolder::ScratchFolder(const std::string& parent) {
  std::error_code ignored;
  fs::create_directories(parent, ignored);
  path_ = parent + "/scratch_XXXXXX";
  if (mkdtemp(path_.data()) == nullptr) path_ = parent + "/scratch";
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

absl::Status CopyMaps(const std::string& from, const std::string& to) {
  std::error_code error;
  fs::create_directories(to, error);
  for (const fs::directory_entry& file : fs::directory_iterator(from, error)) {
    if (file.path().extension() != ".gpkg") continue;
    fs::copy_file(file.path(), fs::path(to) / file.path().filename(), error);
    if (error) return absl::InternalError(absl::StrCat(to, ": ", error.message()));
  }
  // Otherwise the first durable commits would also wait for the copy to reach the disk.
  sync();
  return absl::OkStatus();
}

}  // namespace hypermap::bench
