#include "storage/postgres/change_log.h"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "storage/encoding/change_columns.h"
#include "storage/postgres/change_page.h"
#include "storage/postgres/layer_versions.h"

namespace hypermap::storage::postgres {
namespace {

constexpr int64_t kRevisionsPerPage = 4096;

constexpr char kSelectRevisions[] =
    "SELECT revision, time_ns, author, num_changes FROM hypermap.revisions "
    "WHERE map = $1 AND revision > $2 AND revision < $3 ORDER BY revision ";

int64_t MemoryOf(const RevisionRecord& record) {
  return static_cast<int64_t>(sizeof record + record.author.size());
}

// Different versions in the order in which they were added, and their content once it was read.
template <typename Version, typename Content>
class WantedVersions {
 public:
  void Add(const Version& version) {
    if (places_.try_emplace(version.key(), versions_.size()).second) versions_.push_back(version);
  }
  template <typename Reader>
  absl::Status Read(Connection& connection, Reader* reader) {
    HYPERMAP_ASSIGN_OR_RETURN(contents_, reader->Read(connection, versions_));
    return absl::OkStatus();
  }
  const Content& Of(const Version& version) const {
    return contents_.at(places_.at(version.key()));
  }

 private:
  absl::flat_hash_map<decltype(std::declval<const Version&>().key()), size_t> places_;
  std::vector<Version> versions_;
  std::vector<Content> contents_;
};

// Turns pages of the log into changes.
class ChangeReader {
 public:
  ChangeReader(Connection& connection, int64_t map, ObjectVersions* objects, TileVersions* tiles)
      : connection_(connection), map_(map), objects_(objects), tiles_(tiles) {}

  // Reads what the changes of a page refer to.
  absl::Status Prepare(const std::vector<LoggedChange>& page);
  // REQUIRES: the change is in the page.
  absl::StatusOr<Change> ToChange(const LoggedChange& logged) const;

 private:
  absl::Status ReadLayers(const std::vector<LoggedChange>& page);
  absl::StatusOr<Change> ToTileWritten(const LoggedChange& logged, const LayerSpec& layer) const;
  absl::StatusOr<Change> ToObjectChange(const LoggedChange& logged, const LayerSpec& layer) const;

  static ObjectVersion ObjectVersionOf(const LoggedChange& logged, const LoggedVersion& version) {
    return {logged.lineage, logged.object_id, version.first_revision, version.end_revision,
            version.bytes};
  }
  static TileVersion TileVersionOf(const LoggedChange& logged, const LayerSpec& layer,
                                   const TileIndex& index, const LoggedVersion& version) {
    return {logged.lineage,         layer.kind,           index,
            version.first_revision, version.end_revision, version.bytes};
  }

  Connection& connection_;
  const int64_t map_;
  ObjectVersions* const objects_;
  TileVersions* const tiles_;
  std::map<int64_t, StoredLayer> layers_;  // by lineage; of all pages so far
  WantedVersions<ObjectVersion, ObjectPtr> wanted_objects_;
  WantedVersions<TileVersion, TilePtr> wanted_tiles_;
};

absl::Status ChangeReader::ReadLayers(const std::vector<LoggedChange>& page) {
  std::set<int64_t> missing;
  for (const LoggedChange& logged : page) {
    if (logged.lineage != 0 && !layers_.contains(logged.lineage)) missing.insert(logged.lineage);
  }
  if (missing.empty()) return absl::OkStatus();
  const std::vector<int64_t> lineages(missing.begin(), missing.end());
  HYPERMAP_ASSIGN_OR_RETURN(auto layers, ReadLineages(connection_, map_, lineages));
  layers_.merge(layers);
  return absl::OkStatus();
}

absl::Status ChangeReader::Prepare(const std::vector<LoggedChange>& page) {
  HYPERMAP_RETURN_IF_ERROR(ReadLayers(page));
  wanted_objects_ = {};
  wanted_tiles_ = {};
  for (const LoggedChange& logged : page) {
    if (logged.lineage == 0) continue;
    for (const std::optional<LoggedVersion>& version : {logged.before, logged.after}) {
      if (!version) continue;
      if (logged.kind != kTileWritten) {
        wanted_objects_.Add(ObjectVersionOf(logged, *version));
        continue;
      }
      HYPERMAP_ASSIGN_OR_RETURN(const TileIndex index,
                                ToTileIndex(logged.tile_row, logged.tile_col));
      wanted_tiles_.Add(TileVersionOf(logged, layers_.at(logged.lineage).spec, index, *version));
    }
  }
  HYPERMAP_RETURN_IF_ERROR(wanted_objects_.Read(connection_, objects_));
  return wanted_tiles_.Read(connection_, tiles_);
}

absl::StatusOr<Change> ChangeReader::ToChange(const LoggedChange& logged) const {
  if (logged.lineage == 0) return DecodeStructureChange(logged.kind, logged.detail, LayerSpec());
  const LayerSpec& layer = layers_.at(logged.lineage).spec;
  if (logged.kind == kTileWritten) return ToTileWritten(logged, layer);
  if (logged.kind == kObjectPut || logged.kind == kObjectRemoved) {
    return ToObjectChange(logged, layer);
  }
  return DecodeStructureChange(logged.kind, logged.detail, layer);
}

absl::StatusOr<Change> ChangeReader::ToTileWritten(const LoggedChange& logged,
                                                   const LayerSpec& layer) const {
  if (!logged.after) return absl::DataLossError("a tile that is not there");
  HYPERMAP_ASSIGN_OR_RETURN(const TileIndex index, ToTileIndex(logged.tile_row, logged.tile_col));
  const auto content = [&](const LoggedVersion& version) {
    return wanted_tiles_.Of(TileVersionOf(logged, layer, index, version));
  };
  TilePtr before = logged.before ? content(*logged.before) : nullptr;
  return Change(TileWritten{layer.name, index, std::move(before), content(*logged.after)});
}

absl::StatusOr<Change> ChangeReader::ToObjectChange(const LoggedChange& logged,
                                                    const LayerSpec& layer) const {
  const auto content = [&](const LoggedVersion& version) {
    return wanted_objects_.Of(ObjectVersionOf(logged, version));
  };
  ObjectPtr before = logged.before ? content(*logged.before) : nullptr;
  if (logged.kind == kObjectRemoved) {
    if (before == nullptr) return absl::DataLossError("removes an object that was not there");
    return Change(ObjectRemoved{layer.name, std::move(before)});
  }
  if (!logged.after) return absl::DataLossError("puts an object that is not there");
  return Change(ObjectPut{layer.name, std::move(before), content(*logged.after)});
}

// Whole commits after `after`, without their changes.
absl::StatusOr<std::vector<PastCommit>> ChooseCommits(Connection& connection, int64_t map,
                                                      Revision after, int max_changes) {
  // Also bounds the number of commits that have no changes.
  std::vector<RevisionRecord> records;
  {
    // Charged for the moment only: most callers keep the changes alone.
    const TemporaryMemory temporary;
    HYPERMAP_ASSIGN_OR_RETURN(
        records, ReadRevisions(connection, map, after, std::numeric_limits<Revision>::max(),
                               /*newest_first=*/false, std::max(max_changes, 1)));
  }
  std::vector<PastCommit> commits;
  int64_t room = max_changes;
  for (RevisionRecord& record : records) {
    room -= record.num_changes;
    if (!commits.empty() && room < 0) break;
    PastCommit& commit = commits.emplace_back();
    commit.changes.reserve(std::clamp<int64_t>(record.num_changes, 0, 65536));
    commit.record = std::move(record);
  }
  return commits;
}

// Adds the changes of a page to their commits. `commit` is the one that the last change before the
// page belongs to.
absl::Status AddPage(const std::vector<LoggedChange>& page, const ChangeReader& reader,
                     std::vector<PastCommit>::iterator end,
                     std::vector<PastCommit>::iterator* commit) {
  for (const LoggedChange& logged : page) {
    while (*commit != end && (*commit)->record.revision < logged.place.revision) ++*commit;
    if (*commit == end || (*commit)->record.revision != logged.place.revision) {
      return absl::DataLossError(
          absl::StrCat("hypermap.revisions has no revision ", logged.place.revision));
    }
    absl::StatusOr<Change> change = reader.ToChange(logged);
    if (!change.ok()) {
      return absl::Status(change.status().code(),
                          absl::StrCat("hypermap.changes, revision ", logged.place.revision, ": ",
                                       change.status().message()));
    }
    HYPERMAP_RETURN_IF_ERROR(TakeMemory(static_cast<int64_t>(logged.detail.size())));
    (*commit)->changes.push_back(*std::move(change));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::vector<RevisionRecord>> ReadRevisions(Connection& connection, int64_t map,
                                                          Revision after, Revision before,
                                                          bool newest_first, int64_t max_count) {
  const std::string sql =
      absl::StrCat(kSelectRevisions, newest_first ? "DESC" : "ASC", " LIMIT $4");
  std::vector<RevisionRecord> records;
  while (true) {
    const int64_t room = max_count - static_cast<int64_t>(records.size());
    const int64_t limit = std::min(room, kRevisionsPerPage);
    HYPERMAP_ASSIGN_OR_RETURN(Rows rows, connection.Query(sql, map, after, before, limit));
    while (rows.Next()) {
      records.push_back({rows.Int64(0), absl::FromUnixNanos(rows.Int64(1)),
                         std::string(rows.Text(2)), rows.Int64(3)});
      HYPERMAP_RETURN_IF_ERROR(rows.row_status());
      HYPERMAP_RETURN_IF_ERROR(TakeMemory(MemoryOf(records.back())));
    }
    if (rows.size() < kRevisionsPerPage) return records;
    (newest_first ? before : after) = records.back().revision;
  }
}

absl::StatusOr<std::vector<PastCommit>> ReadCommits(Connection& connection, int64_t map,
                                                    Revision after, int max_changes,
                                                    ObjectVersions* objects, TileVersions* tiles) {
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<PastCommit> commits,
                            ChooseCommits(connection, map, after, max_changes));
  if (commits.empty()) return commits;
  ChangeReader reader(connection, map, objects, tiles);
  auto commit = commits.begin();
  ChangePlace place{commits.front().record.revision, -1};
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(
        const ChangePage page,
        ReadChangePage(connection, map, place, commits.back().record.revision));
    HYPERMAP_RETURN_IF_ERROR(reader.Prepare(page.changes));
    HYPERMAP_RETURN_IF_ERROR(AddPage(page.changes, reader, commits.end(), &commit));
    if (!page.may_have_next) break;
    place = page.changes.back().place;
  }
  for (const PastCommit& past : commits) {
    if (past.record.num_changes == static_cast<int64_t>(past.changes.size())) continue;
    return absl::DataLossError(absl::StrCat("hypermap.changes has ", past.changes.size(),
                                            " changes of revision ", past.record.revision, ", not ",
                                            past.record.num_changes));
  }
  return commits;
}

}  // namespace hypermap::storage::postgres
