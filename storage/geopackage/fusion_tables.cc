#include "storage/geopackage/fusion_tables.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "base/cancellation/cancellation.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "storage/encoding/packed_bytes.h"
#include "storage/geopackage/evidence_retention.h"

namespace hypermap::storage {

const char kCreateFusionTables[] = R"sql(
CREATE TABLE hypermap_fusion (
  id INTEGER PRIMARY KEY,
  layer TEXT NOT NULL UNIQUE,
  strategy TEXT NOT NULL,
  parameters TEXT NOT NULL,
  exploration_layer TEXT NOT NULL
);
CREATE TABLE hypermap_observations (
  id INTEGER PRIMARY KEY,
  layer TEXT NOT NULL,
  stamp_ns INTEGER NOT NULL,
  robot TEXT NOT NULL,
  sequence INTEGER NOT NULL,
  content_hash INTEGER NOT NULL,
  retracted INTEGER NOT NULL,
  received_at_ns INTEGER NOT NULL,
  body_size INTEGER NOT NULL,
  body BLOB NOT NULL,
  UNIQUE (layer, robot, sequence)
);
CREATE INDEX hypermap_observations_order
  ON hypermap_observations (layer, stamp_ns, robot, sequence);
CREATE TABLE hypermap_operator_facts (
  id INTEGER PRIMARY KEY,
  layer TEXT NOT NULL,
  stamp_ns INTEGER NOT NULL,
  robot TEXT NOT NULL,
  sequence INTEGER NOT NULL,
  number INTEGER NOT NULL,
  kind TEXT NOT NULL,
  track TEXT NOT NULL,
  body BLOB NOT NULL,
  UNIQUE (layer, stamp_ns, robot, sequence, number)
);
CREATE TABLE hypermap_fusion_tracks (
  id INTEGER PRIMARY KEY,
  layer TEXT NOT NULL,
  track TEXT NOT NULL,
  object_id INTEGER NOT NULL,
  UNIQUE (layer, track)
);
CREATE TABLE hypermap_fusion_checkpoints (
  id INTEGER PRIMARY KEY,
  layer TEXT NOT NULL,
  stamp_ns INTEGER NOT NULL,
  robot TEXT NOT NULL,
  sequence INTEGER NOT NULL,
  number INTEGER NOT NULL,
  state_size INTEGER NOT NULL,
  state BLOB NOT NULL,
  stored_at_ns INTEGER NOT NULL DEFAULT 0,
  UNIQUE (layer, stamp_ns, robot, sequence, number)
);
)sql";

namespace {

// Memory of a range in a vector that grows by doubling.
constexpr int64_t kBytesOfRange = 2 * sizeof(SequenceRange);

constexpr char kNewestFirst[] = " ORDER BY stamp_ns DESC, robot DESC, sequence DESC, number DESC ";

constexpr const char* kFusionTables[] = {
    "hypermap_fusion",        "hypermap_observations",       "hypermap_operator_facts",
    "hypermap_fusion_tracks", "hypermap_fusion_checkpoints", kBasesTable,
    kForgottenTable};

// The entries of a layer ?1 after the key ?2 to ?5, at most ?6. $which restricts the observations.
constexpr char kReadEntries[] = R"sql(
SELECT * FROM (SELECT stamp_ns, robot, sequence, 0 AS number, '' AS kind, '' AS track, body,
    body_size, content_hash, received_at_ns, retracted
  FROM hypermap_observations WHERE layer = ?1 $which AND (stamp_ns, robot, sequence) > (?2, ?3, ?4)
  ORDER BY stamp_ns, robot, sequence LIMIT ?6)
UNION ALL SELECT stamp_ns, robot, sequence, number, kind, track, body, NULL, 0, 0, 0
  FROM hypermap_operator_facts WHERE layer = ?1
    AND (stamp_ns, robot, sequence, number) > (?2, ?3, ?4, ?5)
ORDER BY stamp_ns, robot, sequence, number LIMIT ?6
)sql";

int64_t Nanos(absl::Time time) { return absl::ToUnixNanos(time); }

absl::Status PutSettings(Database* database, const std::string& layer,
                         const FusionSettings& settings) {
  return database->Run(
      "INSERT INTO hypermap_fusion (layer, strategy, parameters, exploration_layer) "
      "VALUES (?, ?, ?, ?) ON CONFLICT (layer) DO UPDATE SET strategy = excluded.strategy, "
      "parameters = excluded.parameters, exploration_layer = excluded.exploration_layer",
      layer, settings.strategy, settings.parameters, settings.exploration_layer);
}

absl::Status InsertObservation(Database* database, const std::string& layer,
                               const LoggedObservation& observation) {
  const std::string body = PackBytes(observation.body);
  return database->Run(
      "INSERT INTO hypermap_observations (layer, stamp_ns, robot, sequence, content_hash, "
      "retracted, received_at_ns, body_size, body) VALUES (?, ?, ?, ?, ?, 0, ?, ?, ?)",
      layer, Nanos(observation.key.stamp), observation.key.robot, observation.key.sequence,
      static_cast<int64_t>(observation.content_hash), Nanos(observation.received_at),
      static_cast<int64_t>(observation.body.size()), BlobView{body});
}

absl::Status RetractObservation(Database* database, const std::string& layer,
                                const ObservationKey& key) {
  absl::Status status = database->Run(
      "UPDATE hypermap_observations SET retracted = 1 "
      "WHERE layer = ? AND robot = ? AND sequence = ?",
      layer, key.robot, key.sequence);
  if (status.ok() && database->changed_rows() != 1) {
    return absl::InternalError("retracts an observation that is not there");
  }
  return status;
}

absl::Status InsertFact(Database* database, const std::string& layer, const LoggedFact& fact) {
  return database->Run(
      "INSERT INTO hypermap_operator_facts (layer, stamp_ns, robot, sequence, number, kind, track, "
      "body) VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
      layer, Nanos(fact.key.after.stamp), fact.key.after.robot, fact.key.after.sequence,
      fact.key.number, fact.kind, fact.track, BlobView{fact.body});
}

absl::Status PutTrack(Database* database, const std::string& layer, const TrackId& track) {
  return database->Run(
      "INSERT INTO hypermap_fusion_tracks (layer, track, object_id) VALUES (?, ?, ?) "
      "ON CONFLICT (layer, track) DO UPDATE SET object_id = excluded.object_id",
      layer, track.first, track.second);
}

absl::Status DropCheckpointsFrom(Database* database, const std::string& layer, const LogKey& key) {
  return database->Run(
      "DELETE FROM hypermap_fusion_checkpoints "
      "WHERE layer = ? AND (stamp_ns, robot, sequence, number) >= (?, ?, ?, ?)",
      layer, Nanos(key.after.stamp), key.after.robot, key.after.sequence, key.number);
}

// Reads a key from the columns stamp_ns, robot and sequence, of which stamp_ns is column `first`.
ObservationKey KeyAt(Statement* row, int first) {
  return {absl::FromUnixNanos(row->Int64(first)), std::string(row->Text(first + 1)),
          row->Int64(first + 2)};
}

// Calls `take` for each row. DATA_LOSS naming `table` if a column has another type than expected;
// errors of `take`, to which DATA_LOSS adds the table.
template <typename Take>
absl::Status ForEachRow(Statement* select, const char* table, Take take) {
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select->Step());
    if (!has_row) return absl::OkStatus();
    absl::Status status = take();
    if (status.ok()) status = select->row_status();
    if (absl::IsDataLoss(status)) {
      return absl::DataLossError(absl::StrCat(table, ": ", status.message()));
    }
    HYPERMAP_RETURN_IF_ERROR(status);
  }
}

}  // namespace

absl::Status WriteFusionChange(Database* database, const FusionChange& change) {
  absl::Status status;
  if (change.settings) status = PutSettings(database, change.layer, *change.settings);
  if (status.ok() && change.stale_from) {
    status = DropCheckpointsFrom(database, change.layer, *change.stale_from);
  }
  const auto write_all = [&](const auto& values, auto write) {
    for (const auto& value : values) {
      if (!status.ok()) return;
      status = write(database, change.layer, value);
    }
  };
  write_all(change.observations, InsertObservation);
  write_all(change.retracted, RetractObservation);
  write_all(change.facts, InsertFact);
  write_all(change.tracks, PutTrack);
  if (status.ok() && change.base) status = PutFusionBase(database, change.layer, *change.base);
  write_all(change.forgotten, InsertForgotten);
  return status;
}

absl::Status DropAllFusion(Database* database) {
  for (const char* table : kFusionTables) {
    HYPERMAP_RETURN_IF_ERROR(database->Run(absl::StrCat("DELETE FROM ", table)));
  }
  return absl::OkStatus();
}

absl::Status DropFusion(Database* database, const std::string& layer) {
  for (const char* table : kFusionTables) {
    HYPERMAP_RETURN_IF_ERROR(
        database->Run(absl::StrCat("DELETE FROM ", table, " WHERE layer = ?"), layer));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<std::pair<std::string, FusionSettings>>> FusionTables::FusedLayers() {
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select, database_->Prepare("SELECT layer, strategy, parameters, exploration_layer "
                                           "FROM hypermap_fusion ORDER BY layer"));
  std::vector<std::pair<std::string, FusionSettings>> layers;
  absl::Status status = ForEachRow(&select, "hypermap_fusion", [&] {
    layers.push_back(
        {std::string(select.Text(0)),
         {std::string(select.Text(1)), std::string(select.Text(2)), std::string(select.Text(3))}});
    return absl::OkStatus();
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  return layers;
}

absl::StatusOr<std::vector<TrackId>> FusionTables::Tracks(const std::string& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select,
      database_->Prepare(
          "SELECT track, object_id FROM hypermap_fusion_tracks WHERE layer = ? ORDER BY track"));
  std::vector<TrackId> tracks;
  absl::Status status = ForEachRow(&select.Bind(layer), "hypermap_fusion_tracks", [&] {
    tracks.emplace_back(std::string(select.Text(0)), select.Int64(1));
    return absl::OkStatus();
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  return tracks;
}

absl::StatusOr<std::optional<FusionLog::Known>> FusionTables::FindObservation(
    const std::string& layer, const std::string& robot, int64_t sequence) {
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select,
      database_->Prepare("SELECT content_hash, retracted FROM hypermap_observations "
                         "WHERE layer = ? AND robot = ? AND sequence = ?"));
  std::optional<Known> known;
  absl::Status status =
      ForEachRow(&select.Bind(layer, robot, sequence), "hypermap_observations", [&] {
        known = Known{static_cast<uint64_t>(select.Int64(0)), select.Int64(1) != 0};
        return absl::OkStatus();
      });
  HYPERMAP_RETURN_IF_ERROR(status);
  if (known) return known;
  HYPERMAP_ASSIGN_OR_RETURN(const bool is_forgotten,
                            IsForgotten(database_, layer, robot, sequence));
  if (is_forgotten) known = Known();
  return known;
}

absl::StatusOr<std::vector<SequenceRange>> FusionTables::Sequences(const std::string& layer,
                                                                   const std::string& robot) {
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select,
      database_->Prepare(
          "SELECT first_sequence, last_sequence FROM hypermap_forgotten_sequences "
          "WHERE layer = ?1 AND robot = ?2 UNION ALL SELECT sequence, sequence "
          "FROM hypermap_observations WHERE layer = ?1 AND robot = ?2 ORDER BY first_sequence"));
  std::vector<SequenceRange> sequences;
  absl::Status status =
      ForEachRow(&select.Bind(layer, robot), "hypermap_observations", [&]() -> absl::Status {
        const size_t num_ranges = sequences.size();
        AppendSequences({select.Int64(0), select.Int64(1)}, &sequences);
        if (sequences.size() > num_ranges) HYPERMAP_RETURN_IF_ERROR(TakeMemory(kBytesOfRange));
        return CheckCancelled();
      });
  HYPERMAP_RETURN_IF_ERROR(status);
  return sequences;
}

absl::StatusOr<std::vector<ObservationKey>> FusionTables::KeysOf(const std::string& layer,
                                                                 const std::string& robot,
                                                                 absl::Time from, absl::Time to) {
  // Times that do not fit into nanoseconds are clamped; no observation has such a stamp.
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select,
      database_->Prepare(
          "SELECT stamp_ns, robot, sequence FROM hypermap_observations "
          "WHERE layer = ? AND robot = ? AND stamp_ns >= ? AND stamp_ns < ? AND retracted = 0 "
          "ORDER BY stamp_ns, sequence"));
  std::vector<ObservationKey> keys;
  absl::Status status =
      ForEachRow(&select.Bind(layer, robot, Nanos(from), Nanos(to)), "hypermap_observations", [&] {
        keys.push_back(KeyAt(&select, 0));
        return absl::OkStatus();
      });
  HYPERMAP_RETURN_IF_ERROR(status);
  return keys;
}

absl::StatusOr<std::optional<absl::Time>> FusionTables::NewestStamp(const std::string& layer,
                                                                    const std::string& robot) {
  // No index has the stamps of one robot. Two scans advance in turn, and the one that ends first
  // answers: of the layer, newest first, which soon meets a robot that still sends; and of the
  // robot, which has few rows or none if it never sent much. Only rows of the robot are looked up
  // in the table.
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement of_layer,
      database_->Prepare("SELECT stamp_ns, CASE WHEN robot = ?2 THEN retracted = 0 ELSE 0 END "
                         "FROM hypermap_observations INDEXED BY hypermap_observations_order "
                         "WHERE layer = ?1 ORDER BY stamp_ns DESC"));
  HYPERMAP_ASSIGN_OR_RETURN(Statement of_robot,
                            database_->Prepare("SELECT stamp_ns, retracted FROM "
                                               "hypermap_observations "
                                               "WHERE layer = ? AND robot = ?"));
  of_layer.Bind(layer, robot);
  of_robot.Bind(layer, robot);
  std::optional<int64_t> newest_ns;
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool robot_has_row, of_robot.Step());
    if (!robot_has_row) break;
    if (of_robot.Int64(1) == 0) {
      newest_ns = std::max(newest_ns.value_or(of_robot.Int64(0)), of_robot.Int64(0));
    }
    HYPERMAP_ASSIGN_OR_RETURN(const bool layer_has_row, of_layer.Step());
    const bool is_newest = layer_has_row && of_layer.Int64(1) != 0;
    if (is_newest) newest_ns = of_layer.Int64(0);
    for (const Statement* scan : {&of_robot, &of_layer}) {
      if (absl::Status status = scan->row_status(); !status.ok()) {
        return absl::DataLossError(absl::StrCat("hypermap_observations: ", status.message()));
      }
    }
    if (is_newest) break;
  }
  if (!newest_ns) return std::nullopt;
  return absl::FromUnixNanos(*newest_ns);
}

absl::StatusOr<std::optional<ObservationKey>> FusionTables::NewestKey(const std::string& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select,
      database_->Prepare("SELECT stamp_ns, robot, sequence FROM hypermap_observations "
                         "WHERE layer = ? AND retracted = 0 "
                         "ORDER BY stamp_ns DESC, robot DESC, sequence DESC LIMIT 1"));
  std::optional<ObservationKey> key;
  absl::Status status = ForEachRow(&select.Bind(layer), "hypermap_observations", [&] {
    key = KeyAt(&select, 0);
    return absl::OkStatus();
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  return key;
}

absl::StatusOr<std::optional<LogKey>> FusionTables::NewestFact(const std::string& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select, database_->Prepare(absl::StrCat(
                            "SELECT stamp_ns, robot, sequence, number FROM hypermap_operator_facts "
                            "WHERE layer = ?",
                            kNewestFirst, "LIMIT 1")));
  std::optional<LogKey> key;
  absl::Status status = ForEachRow(&select.Bind(layer), "hypermap_operator_facts", [&] {
    key = LogKey{KeyAt(&select, 0), select.Int64(3)};
    return absl::OkStatus();
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  return key;
}

absl::StatusOr<std::vector<LogEntry>> FusionTables::FactsOfKind(const std::string& layer,
                                                                const std::string& kind) {
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select,
      database_->Prepare("SELECT stamp_ns, robot, sequence, number, track, body "
                         "FROM hypermap_operator_facts WHERE layer = ? AND kind = ? "
                         "ORDER BY stamp_ns, robot, sequence, number"));
  std::vector<LogEntry> facts;
  absl::Status status = ForEachRow(&select.Bind(layer, kind), "hypermap_operator_facts", [&] {
    facts.push_back({{KeyAt(&select, 0), select.Int64(3)},
                     kind,
                     std::string(select.Text(4)),
                     std::string(select.Blob(5))});
    return absl::OkStatus();
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  return facts;
}

absl::StatusOr<std::vector<LogEntry>> FusionTables::Read(const std::string& layer,
                                                         const LogKey& after, int max_entries) {
  std::vector<LogEntry> entries;
  const absl::Status status =
      ForEachEntry(layer, after, "AND retracted = 0", max_entries,
                   [&](StoredEntry entry) { entries.push_back(std::move(entry.entry)); });
  HYPERMAP_RETURN_IF_ERROR(status);
  return entries;
}

absl::StatusOr<std::vector<FusionLog::StoredEntry>> FusionTables::ReadStored(
    const std::string& layer, const LogKey& after, int max_entries) {
  std::vector<StoredEntry> entries;
  const absl::Status status =
      ForEachEntry(layer, after, /*which=*/"", max_entries,
                   [&](StoredEntry entry) { entries.push_back(std::move(entry)); });
  HYPERMAP_RETURN_IF_ERROR(status);
  return entries;
}

absl::Status FusionTables::ForEachEntry(const std::string& layer, const LogKey& after,
                                        absl::string_view which, int max_entries,
                                        absl::FunctionRef<void(StoredEntry)> take) {
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select, database_->Prepare(absl::StrReplaceAll(kReadEntries, {{"$which", which}})));
  select.Bind(layer, Nanos(after.after.stamp), after.after.robot, after.after.sequence,
              after.number, max_entries);
  return ForEachRow(&select, "hypermap_observations", [&] {
    StoredEntry stored;
    LogEntry& entry = stored.entry;
    entry.key = {KeyAt(&select, 0), select.Int64(3)};
    entry.kind = std::string(select.Text(4));
    entry.track = std::string(select.Text(5));
    const absl::string_view body = select.Blob(6);
    if (entry.key.number > 0) {
      entry.body = std::string(body);
    } else {
      HYPERMAP_ASSIGN_OR_RETURN(entry.body, UnpackBytes(body, select.Int64(7)));
      stored.content_hash = static_cast<uint64_t>(select.Int64(8));
      stored.received_at = absl::FromUnixNanos(select.Int64(9));
      stored.retracted = select.Int64(10) != 0;
    }
    take(std::move(stored));
    return absl::OkStatus();
  });
}

absl::StatusOr<std::vector<ForgottenNames>> FusionTables::Forgotten(
    const std::string& layer, const std::optional<ForgottenNames>& after, int max_count) {
  return ReadForgotten(database_, layer, after, max_count);
}

absl::StatusOr<std::optional<FusionCheckpoint>> FusionTables::FindCheckpoint(
    const std::string& layer, const std::optional<LogKey>& before) {
  const std::string where = before ? "AND (stamp_ns, robot, sequence, number) < (?, ?, ?, ?)" : "";
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select,
      database_->Prepare(
          absl::StrCat("SELECT stamp_ns, robot, sequence, number, state_size, state, stored_at_ns "
                       "FROM hypermap_fusion_checkpoints WHERE layer = ? ",
                       where, kNewestFirst, "LIMIT 1")));
  if (before) {
    select.Bind(layer, Nanos(before->after.stamp), before->after.robot, before->after.sequence,
                before->number);
  } else {
    select.Bind(layer);
  }
  std::optional<FusionCheckpoint> checkpoint;
  absl::Status status = ForEachRow(&select, "hypermap_fusion_checkpoints", [&] {
    HYPERMAP_ASSIGN_OR_RETURN(std::string state, UnpackBytes(select.Blob(5), select.Int64(4)));
    checkpoint = FusionCheckpoint{{KeyAt(&select, 0), select.Int64(3)},
                                  std::move(state),
                                  absl::FromUnixNanos(select.Int64(6))};
    return absl::OkStatus();
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  return checkpoint;
}

absl::StatusOr<std::vector<FusionLog::CheckpointKey>> FusionTables::Checkpoints(
    const std::string& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select,
      database_->Prepare(
          "SELECT stamp_ns, robot, sequence, number, stored_at_ns FROM hypermap_fusion_checkpoints "
          "WHERE layer = ? ORDER BY stamp_ns, robot, sequence, number"));
  std::vector<CheckpointKey> keys;
  absl::Status status = ForEachRow(&select.Bind(layer), "hypermap_fusion_checkpoints", [&] {
    keys.push_back({{KeyAt(&select, 0), select.Int64(3)}, absl::FromUnixNanos(select.Int64(4))});
    return absl::OkStatus();
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  return keys;
}

absl::Status FusionTables::KeepCheckpoint(const std::string& layer,
                                          const FusionCheckpoint& checkpoint,
                                          absl::Span<const LogKey> dropped) {
  HYPERMAP_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(database_));
  const std::string state = PackBytes(checkpoint.state);
  absl::Status status = database_->Run(
      "INSERT OR REPLACE INTO hypermap_fusion_checkpoints "
      "(layer, stamp_ns, robot, sequence, number, state_size, state, stored_at_ns) "
      "VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
      layer, Nanos(checkpoint.key.after.stamp), checkpoint.key.after.robot,
      checkpoint.key.after.sequence, checkpoint.key.number,
      static_cast<int64_t>(checkpoint.state.size()), BlobView{state}, Nanos(checkpoint.stored_at));
  for (const LogKey& key : dropped) {
    if (!status.ok()) break;
    status = database_->Run(
        "DELETE FROM hypermap_fusion_checkpoints WHERE layer = ? AND stamp_ns = ? AND robot = ? "
        "AND sequence = ? AND number = ?",
        layer, Nanos(key.after.stamp), key.after.robot, key.after.sequence, key.number);
  }
  if (status.ok()) status = transaction.Commit();
  return status;
}

absl::StatusOr<std::optional<FusionBase>> FusionTables::FindBase(const std::string& layer) {
  return FindFusionBase(database_, layer);
}

absl::StatusOr<bool> FusionTables::HasForgotten(const std::string& layer,
                                                const std::string& robot) {
  return HasForgottenObservations(database_, layer, robot);
}

absl::StatusOr<std::optional<FusionCheckpoint>> FusionTables::FindNextBase(
    const std::string& layer, absl::Time stored_before) {
  return FindNextFusionBase(database_, layer, stored_before);
}

absl::Status FusionTables::MoveBase(const std::string& layer, const LogKey& checkpoint) {
  return MoveFusionBase(database_, layer, checkpoint);
}

}  // namespace hypermap::storage
