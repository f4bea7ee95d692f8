#include "storage/geopackage/evidence_retention.h"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/status/status_macros.h"
#include "storage/encoding/packed_bytes.h"

namespace hypermap::storage {

// A robot counts its observations, so that their names take a row for each gap and not one for each
// observation.
const char kCreateRetentionTables[] = R"sql(
CREATE TABLE hypermap_fusion_bases (
  id INTEGER PRIMARY KEY,
  layer TEXT NOT NULL UNIQUE,
  stamp_ns INTEGER NOT NULL,
  robot TEXT NOT NULL,
  sequence INTEGER NOT NULL,
  number INTEGER NOT NULL,
  num_facts INTEGER NOT NULL,
  state_size INTEGER NOT NULL,
  state BLOB NOT NULL
);
CREATE TABLE hypermap_forgotten_sequences (
  id INTEGER PRIMARY KEY,
  layer TEXT NOT NULL,
  robot TEXT NOT NULL,
  first_sequence INTEGER NOT NULL,
  last_sequence INTEGER NOT NULL,
  UNIQUE (layer, robot, first_sequence)
);
)sql";

namespace {

constexpr char kCheckpoints[] = "hypermap_fusion_checkpoints";

// The checkpoint that becomes the base, and the number of the newest fact up to it. Facts of before
// the former base may be removed by now.
constexpr char kMoveBase[] = R"sql(
INSERT INTO hypermap_fusion_bases
    (layer, stamp_ns, robot, sequence, number, num_facts, state_size, state)
  SELECT layer, stamp_ns, robot, sequence, number,
      max(coalesce((SELECT max(f.number) FROM hypermap_operator_facts AS f WHERE f.layer = c.layer
                      AND (f.stamp_ns, f.robot, f.sequence, f.number)
                        <= (c.stamp_ns, c.robot, c.sequence, c.number)), 0),
          coalesce((SELECT b.num_facts FROM hypermap_fusion_bases AS b WHERE b.layer = c.layer), 0)),
      state_size, state
    FROM hypermap_fusion_checkpoints AS c WHERE c.layer = ? AND c.stamp_ns = ? AND c.robot = ?
      AND c.sequence = ? AND c.number = ?
  ON CONFLICT (layer) DO UPDATE SET stamp_ns = excluded.stamp_ns, robot = excluded.robot,
    sequence = excluded.sequence, number = excluded.number, num_facts = excluded.num_facts,
    state_size = excluded.state_size, state = excluded.state
)sql";

constexpr char kRemoveCheckpoints[] =
    "DELETE FROM hypermap_fusion_checkpoints WHERE layer = ? "
    "AND (stamp_ns, robot, sequence, number) <= (?, ?, ?, ?)";

constexpr char kRemoveFacts[] =
    "DELETE FROM hypermap_operator_facts WHERE id IN (SELECT id FROM hypermap_operator_facts "
    "WHERE layer = ? AND (stamp_ns, robot, sequence, number) <= (?, ?, ?, ?) LIMIT ?)";

// Reads a key from four columns, of which stamp_ns is column `first`.
LogKey LogKeyAt(Statement* row, int first) {
  return {{absl::FromUnixNanos(row->Int64(first)), std::string(row->Text(first + 1)),
           row->Int64(first + 2)},
          row->Int64(first + 3)};
}

absl::Status Named(const char* table, const absl::Status& status) {
  if (!absl::IsDataLoss(status)) return status;
  return absl::DataLossError(absl::StrCat(table, ": ", status.message()));
}

// Keys of the bases of all logs, by layer.
absl::StatusOr<std::map<std::string, LogKey>> BaseKeys(Database* database) {
  HYPERMAP_ASSIGN_OR_RETURN(Statement select,
                            database->Prepare("SELECT layer, stamp_ns, robot, sequence, number "
                                              "FROM hypermap_fusion_bases"));
  std::map<std::string, LogKey> keys;
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return keys;
    keys.emplace(std::string(select.Text(0)), LogKeyAt(&select, 1));
    HYPERMAP_RETURN_IF_ERROR(Named(kBasesTable, select.row_status()));
  }
}

// Adds forgotten sequences of a robot, and joins them with those that they continue.
absl::Status AddForgotten(Database* database, const std::string& layer, const std::string& robot,
                          SequenceRange added) {
  constexpr int64_t kFirst = std::numeric_limits<int64_t>::min();
  constexpr int64_t kLast = std::numeric_limits<int64_t>::max();
  const int64_t touches_from = added.first == kFirst ? kFirst : added.first - 1;
  const int64_t touches_to = added.last == kLast ? kLast : added.last + 1;
  std::vector<int64_t> joined;
  {
    // Ranges do not overlap, so that the first one that ends before is followed by no other.
    HYPERMAP_ASSIGN_OR_RETURN(
        Statement select,
        database->Prepare("SELECT id, first_sequence, last_sequence "
                          "FROM hypermap_forgotten_sequences WHERE layer = ? AND robot = ? "
                          "AND first_sequence <= ? ORDER BY first_sequence DESC"));
    select.Bind(layer, robot, touches_to);
    while (true) {
      HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
      if (!has_row) break;
      const SequenceRange range = {select.Int64(1), select.Int64(2)};
      HYPERMAP_RETURN_IF_ERROR(Named(kForgottenTable, select.row_status()));
      if (range.last < touches_from) break;
      joined.push_back(select.Int64(0));
      added.first = std::min(added.first, range.first);
      added.last = std::max(added.last, range.last);
    }
  }
  for (const int64_t id : joined) {
    HYPERMAP_RETURN_IF_ERROR(
        database->Run("DELETE FROM hypermap_forgotten_sequences WHERE id = ?", id));
  }
  return InsertForgotten(database, layer, {robot, added});
}

// Removes at most `max_rows` observations up to the base.
absl::StatusOr<int64_t> RemoveObservations(Database* database, const std::string& layer,
                                           const ObservationKey& base, int64_t max_rows) {
  std::vector<int64_t> ids;
  std::map<std::string, std::vector<int64_t>> sequences;  // by robot
  {
    HYPERMAP_ASSIGN_OR_RETURN(
        Statement select,
        database->Prepare("SELECT id, robot, sequence FROM hypermap_observations WHERE layer = ? "
                          "AND (stamp_ns, robot, sequence) <= (?, ?, ?) "
                          "ORDER BY stamp_ns, robot, sequence LIMIT ?"));
    select.Bind(layer, absl::ToUnixNanos(base.stamp), base.robot, base.sequence, max_rows);
    while (true) {
      HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
      if (!has_row) break;
      ids.push_back(select.Int64(0));
      sequences[std::string(select.Text(1))].push_back(select.Int64(2));
      HYPERMAP_RETURN_IF_ERROR(Named("hypermap_observations", select.row_status()));
    }
  }
  for (auto& [robot, of_robot] : sequences) {
    std::sort(of_robot.begin(), of_robot.end());
    std::vector<SequenceRange> ranges;
    for (const int64_t sequence : of_robot) AppendSequence(sequence, &ranges);
    for (const SequenceRange& range : ranges) {
      HYPERMAP_RETURN_IF_ERROR(AddForgotten(database, layer, robot, range));
    }
  }
  for (const int64_t id : ids) {
    HYPERMAP_RETURN_IF_ERROR(database->Run("DELETE FROM hypermap_observations WHERE id = ?", id));
  }
  return static_cast<int64_t>(ids.size());
}

}  // namespace

absl::StatusOr<std::optional<FusionBase>> FindFusionBase(Database* database,
                                                         const std::string& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select, database->Prepare("SELECT stamp_ns, robot, sequence, number, num_facts, "
                                          "state_size, state FROM hypermap_fusion_bases "
                                          "WHERE layer = ?"));
  HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Bind(layer).Step());
  if (!has_row) return std::nullopt;
  FusionBase base{LogKeyAt(&select, 0), select.Int64(4), ""};
  const int64_t size = select.Int64(5);
  const absl::string_view packed = select.Blob(6);
  HYPERMAP_RETURN_IF_ERROR(Named(kBasesTable, select.row_status()));
  absl::StatusOr<std::string> state = UnpackBytes(packed, size);
  if (!state.ok()) return Named(kBasesTable, state.status());
  base.state = *std::move(state);
  return base;
}

absl::StatusOr<bool> HasForgottenObservations(Database* database, const std::string& layer,
                                              const std::string& robot) {
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::optional<int64_t> found,
      database->QueryInt64(
          "SELECT EXISTS (SELECT 1 FROM hypermap_forgotten_sequences WHERE layer = ?1 AND robot = "
          "?2) OR EXISTS (SELECT 1 FROM hypermap_observations AS o JOIN hypermap_fusion_bases AS b "
          "ON b.layer = o.layer WHERE o.layer = ?1 AND o.robot = ?2 "
          "AND (o.stamp_ns, o.robot, o.sequence) <= (b.stamp_ns, b.robot, b.sequence))",
          layer, robot));
  return found.value_or(0) != 0;
}

absl::StatusOr<std::optional<FusionCheckpoint>> FindNextFusionBase(Database* database,
                                                                   const std::string& layer,
                                                                   absl::Time stored_before) {
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select,
      database->Prepare("SELECT stamp_ns, robot, sequence, number, stored_at_ns, state_size, state "
                        "FROM hypermap_fusion_checkpoints "
                        "WHERE layer = ? AND stamp_ns > ? AND stored_at_ns < ? "
                        "ORDER BY stamp_ns DESC, robot DESC, sequence DESC, number DESC LIMIT 1"));
  // A state before all observations is no base: nothing would be forgotten.
  select.Bind(layer, absl::ToUnixNanos(BeforeAll().after.stamp), absl::ToUnixNanos(stored_before));
  HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
  if (!has_row) return std::nullopt;
  FusionCheckpoint checkpoint{LogKeyAt(&select, 0), "", absl::FromUnixNanos(select.Int64(4))};
  const int64_t size = select.Int64(5);
  const absl::string_view packed = select.Blob(6);
  HYPERMAP_RETURN_IF_ERROR(Named(kCheckpoints, select.row_status()));
  HYPERMAP_ASSIGN_OR_RETURN(const auto bases, BaseKeys(database));
  const auto base = bases.find(layer);
  if (base != bases.end() && checkpoint.key <= base->second) return std::nullopt;
  absl::StatusOr<std::string> state = UnpackBytes(packed, size);
  if (!state.ok()) return Named(kCheckpoints, state.status());
  checkpoint.state = *std::move(state);
  return checkpoint;
}

absl::Status MoveFusionBase(Database* database, const std::string& layer,
                            const LogKey& checkpoint) {
  const ObservationKey& after = checkpoint.after;
  const int64_t stamp_ns = absl::ToUnixNanos(after.stamp);
  HYPERMAP_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(database));
  HYPERMAP_RETURN_IF_ERROR(
      database->Run(kMoveBase, layer, stamp_ns, after.robot, after.sequence, checkpoint.number));
  if (database->changed_rows() != 1) {
    return absl::InternalError("moves the base of a log to a checkpoint that is not there");
  }
  HYPERMAP_RETURN_IF_ERROR(database->Run(kRemoveCheckpoints, layer, stamp_ns, after.robot,
                                         after.sequence, checkpoint.number));
  return transaction.Commit();
}

absl::StatusOr<std::vector<ForgottenNames>> ReadForgotten(
    Database* database, const std::string& layer, const std::optional<ForgottenNames>& after,
    int max_count) {
  const std::string where = after ? "AND (robot, first_sequence) > (?3, ?4) " : "";
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select,
      database->Prepare(absl::StrCat("SELECT robot, first_sequence, last_sequence "
                                     "FROM hypermap_forgotten_sequences WHERE layer = ?1 ",
                                     where, "ORDER BY robot, first_sequence LIMIT ?2")));
  if (after) {
    select.Bind(layer, max_count, after->robot, after->sequences.first);
  } else {
    select.Bind(layer, max_count);
  }
  std::vector<ForgottenNames> names;
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return names;
    names.push_back({std::string(select.Text(0)), {select.Int64(1), select.Int64(2)}});
    HYPERMAP_RETURN_IF_ERROR(Named(kForgottenTable, select.row_status()));
  }
}

absl::Status PutFusionBase(Database* database, const std::string& layer, const FusionBase& base) {
  const ObservationKey& after = base.key.after;
  const std::string state = PackBytes(base.state);
  return database->Run(
      "INSERT OR REPLACE INTO hypermap_fusion_bases "
      "(layer, stamp_ns, robot, sequence, number, num_facts, state_size, state) "
      "VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
      layer, absl::ToUnixNanos(after.stamp), after.robot, after.sequence, base.key.number,
      base.num_facts, static_cast<int64_t>(base.state.size()), BlobView{state});
}

absl::Status InsertForgotten(Database* database, const std::string& layer,
                             const ForgottenNames& names) {
  return database->Run(
      "INSERT INTO hypermap_forgotten_sequences (layer, robot, first_sequence, last_sequence) "
      "VALUES (?, ?, ?, ?)",
      layer, names.robot, names.sequences.first, names.sequences.last);
}

absl::StatusOr<bool> IsForgotten(Database* database, const std::string& layer,
                                 const std::string& robot, int64_t sequence) {
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::optional<int64_t> last,
      database->QueryInt64("SELECT last_sequence FROM hypermap_forgotten_sequences "
                           "WHERE layer = ? AND robot = ? AND first_sequence <= ? "
                           "ORDER BY first_sequence DESC LIMIT 1",
                           layer, robot, sequence));
  return last && sequence <= *last;
}

absl::StatusOr<int64_t> RemoveForgottenEvidence(Database* database, int64_t max_rows) {
  HYPERMAP_ASSIGN_OR_RETURN(const auto bases, BaseKeys(database));
  int64_t removed = 0;
  for (const auto& [layer, base] : bases) {
    HYPERMAP_ASSIGN_OR_RETURN(const int64_t observations,
                              RemoveObservations(database, layer, base.after, max_rows - removed));
    removed += observations;
    HYPERMAP_RETURN_IF_ERROR(database->Run(kRemoveFacts, layer, absl::ToUnixNanos(base.after.stamp),
                                           base.after.robot, base.after.sequence, base.number,
                                           max_rows - removed));
    removed += database->changed_rows();
  }
  return removed;
}

}  // namespace hypermap::storage
