#include "storage/transfer/migration.h"

#include <memory>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/transfer/map_copy.h"

namespace hypermap::storage {
namespace {

// A map that is written all the time is followed for so many copies.
constexpr int kMaxPasses = 5;

// Compares the map with one that is there already. nullopt if there is none, or an unfinished copy.
absl::StatusOr<std::optional<Migration>> CompareWithExisting(ReadableMap& map, MapStore& to) {
  const MapHeader& header = map.header();
  const absl::StatusOr<std::unique_ptr<ReadableMap>> existing = to.Pin(header.name);
  // FAILED_PRECONDITION is that of an unfinished copy; if it is another, the copying fails, too.
  if (absl::IsNotFound(existing.status()) || absl::IsFailedPrecondition(existing.status())) {
    return std::nullopt;
  }
  HYPERMAP_RETURN_IF_ERROR(existing.status());
  if ((*existing)->header().incarnation != header.incarnation) {
    return absl::AlreadyExistsError(
        absl::StrCat("there is a map ", header.name, " of another incarnation"));
  }
  Migration migration{header.name};
  HYPERMAP_ASSIGN_OR_RETURN(migration.source, DigestOf(map));
  HYPERMAP_ASSIGN_OR_RETURN(const MapDigest there, DigestOf(**existing));
  migration.differing = DifferingParts(migration.source, there);
  migration.state =
      migration.differing.empty() ? Migration::State::kThereBefore : Migration::State::kDiffers;
  return migration;
}

// Brings the copy up to the map, and compares them. The copy stays unfinished.
absl::StatusOr<Migration> CopyOnce(ReadableMap& map, StoredMap& copy,
                                   const std::function<void(Revision)>& copied) {
  HYPERMAP_RETURN_IF_ERROR(CopyMap(map, copy, copied));
  Migration migration{map.header().name};
  HYPERMAP_ASSIGN_OR_RETURN(migration.source, DigestOf(map));
  HYPERMAP_ASSIGN_OR_RETURN(const MapDigest of_copy, DigestOf(copy));
  migration.differing = DifferingParts(migration.source, of_copy);
  migration.state =
      migration.differing.empty() ? Migration::State::kInUse : Migration::State::kDiffers;
  return migration;
}

absl::StatusOr<Migration> MigrateOwned(ReadableMap& map, MapStore& to,
                                       const std::function<void(Revision)>& copied) {
  HYPERMAP_ASSIGN_OR_RETURN(std::optional<Migration> existing, CompareWithExisting(map, to));
  if (existing) return *std::move(existing);
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<StoredMap> copy,
                            BeginCopy(map, map.header(), to));
  HYPERMAP_ASSIGN_OR_RETURN(Migration migration, CopyOnce(map, *copy, copied));
  if (migration.state == Migration::State::kDiffers) return migration;
  HYPERMAP_RETURN_IF_ERROR(copy->FinishCopy());
  migration.state = Migration::State::kMoved;
  return migration;
}

absl::StatusOr<Migration> FollowServed(MapStore& from, MapStore& to, const std::string& name,
                                       const std::function<void(Revision)>& copied) {
  absl::StatusOr<Migration> migration = absl::InternalError("no pass");
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<ReadableMap> map, from.Pin(name));
    if (pass == 0) {
      HYPERMAP_ASSIGN_OR_RETURN(std::optional<Migration> existing, CompareWithExisting(*map, to));
      if (existing) return *std::move(existing);
    }
    HYPERMAP_ASSIGN_OR_RETURN(const MapPosition position, map->Position());
    const bool is_new = !migration.ok() || position.kept.newest != migration->source.newest;
    if (!is_new) return migration;
    HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<StoredMap> copy,
                              BeginCopy(*map, map->header(), to));
    migration = CopyOnce(*map, *copy, copied);
    // What was compacted while it was read is left out in the next pass.
    const bool may_pass = absl::IsUnavailable(migration.status()) && pass + 1 < kMaxPasses;
    if (!migration.ok() && !may_pass) return migration;
  }
  return migration;
}

}  // namespace

absl::string_view MigrationStateName(Migration::State state) {
  switch (state) {
    case Migration::State::kMoved:
      return "moved";
    case Migration::State::kThereBefore:
      return "there_before";
    case Migration::State::kInUse:
      return "in_use";
    case Migration::State::kDiffers:
      return "differs";
    case Migration::State::kToCopy:
      return "to_copy";
  }
  return "";
}

absl::StatusOr<Migration> MigrateMap(MapStore& from, MapStore& to, const std::string& map,
                                     const std::function<void(Revision)>& copied) {
  const absl::StatusOr<std::unique_ptr<StoredMap>> owned = from.Open(map);
  if (owned.ok()) return MigrateOwned(**owned, to, copied);
  // Probably a server has it open.
  if (absl::IsFailedPrecondition(owned.status())) return FollowServed(from, to, map, copied);
  return owned.status();
}

absl::StatusOr<Migration> CompareMaps(MapStore& from, MapStore* to, const std::string& map) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<ReadableMap> pinned, from.Pin(map));
  if (to != nullptr) {
    HYPERMAP_ASSIGN_OR_RETURN(std::optional<Migration> compared, CompareWithExisting(*pinned, *to));
    if (compared) return *std::move(compared);
  }
  Migration migration{map};
  HYPERMAP_ASSIGN_OR_RETURN(migration.source, DigestOf(*pinned));
  return migration;
}

}  // namespace hypermap::storage
