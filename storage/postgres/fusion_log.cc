#include "storage/postgres/fusion_log.h"

#include <limits>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "base/cancellation/cancellation.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "storage/encoding/packed_bytes.h"
#include "storage/postgres/evidence_retention.h"
#include "storage/postgres/fusion_rows.h"

namespace hypermap::storage::postgres {
namespace {

constexpr char kFusionTable[] = "hypermap.fusion";
constexpr char kFactsTable[] = "hypermap.operator_facts";
constexpr char kTracksTable[] = "hypermap.fusion_tracks";

constexpr char kNewestFirst[] = " ORDER BY stamp_ns DESC, robot DESC, sequence DESC, number DESC ";

constexpr char kFusedLayers[] =
    "SELECT layer, strategy, parameters, exploration_layer FROM hypermap.fusion "
    "WHERE map = $1 ORDER BY layer";
constexpr char kFindTracks[] =
    "SELECT track, object_id FROM hypermap.fusion_tracks WHERE map = $1 AND layer = $2 "
    "ORDER BY track";
// The observation, or a row without a hash if only its name is kept.
constexpr char kFindObservation[] = R"sql(
SELECT content_hash, retracted FROM hypermap.observations
  WHERE map = $1 AND layer = $2 AND robot = $3 AND sequence = $4
UNION ALL SELECT NULL::bigint, false WHERE $4 <= (
  SELECT last_sequence FROM hypermap.forgotten_sequences
    WHERE map = $1 AND layer = $2 AND robot = $3 AND first_sequence <= $4
    ORDER BY first_sequence DESC LIMIT 1)
)sql";
constexpr char kSequences[] = R"sql(
SELECT first_sequence, last_sequence FROM hypermap.forgotten_sequences
  WHERE map = $1 AND layer = $2 AND robot = $3 AND first_sequence >= $4
UNION ALL SELECT sequence, sequence FROM hypermap.observations
  WHERE map = $1 AND layer = $2 AND robot = $3 AND sequence >= $4
ORDER BY first_sequence LIMIT )sql";
constexpr char kKeysOf[] = R"sql(
SELECT stamp_ns, robot, sequence FROM hypermap.observations
  WHERE map = $1 AND layer = $2 AND robot = $3 AND stamp_ns >= $4 AND stamp_ns < $5
    AND NOT retracted
  ORDER BY stamp_ns, sequence
)sql";
constexpr char kNewestStamp[] = R"sql(
SELECT stamp_ns FROM hypermap.observations
  WHERE map = $1 AND layer = $2 AND robot = $3 AND NOT retracted
  ORDER BY stamp_ns DESC LIMIT 1
)sql";
constexpr char kNewestKey[] = R"sql(
SELECT stamp_ns, robot, sequence FROM hypermap.observations
  WHERE map = $1 AND layer = $2 AND NOT retracted
  ORDER BY stamp_ns DESC, robot DESC, sequence DESC LIMIT 1
)sql";
constexpr char kFactsOfKind[] = R"sql(
SELECT stamp_ns, robot, sequence, number, track, body FROM hypermap.operator_facts
  WHERE map = $1 AND layer = $2 AND kind = $3
  ORDER BY stamp_ns, robot, sequence, number
)sql";
// $which restricts the observations.
constexpr char kReadEntries[] = R"sql(
(SELECT stamp_ns, robot, sequence, 0::bigint AS number, '' AS kind, '' AS track, body_size, body,
    content_hash, received_at_ns, retracted
  FROM hypermap.observations WHERE map = $1 AND layer = $2 $which
    AND (stamp_ns, robot, sequence) > ($3, $4, $5)
  ORDER BY stamp_ns, robot, sequence LIMIT $7)
UNION ALL (SELECT stamp_ns, robot, sequence, number, kind, track, NULL::bigint, body,
    0::bigint, 0::bigint, false
  FROM hypermap.operator_facts WHERE map = $1 AND layer = $2
    AND (stamp_ns, robot, sequence, number) > ($3, $4, $5, $6)
  ORDER BY stamp_ns, robot, sequence, number LIMIT $7)
ORDER BY stamp_ns, robot, sequence, number LIMIT $7
)sql";
constexpr char kOfCheckpoints[] =
    " FROM hypermap.fusion_checkpoints WHERE map = $1 AND layer = $2 ";
constexpr char kBeforeKey[] = "AND (stamp_ns, robot, sequence, number) < ($3, $4, $5, $6)";
constexpr char kFindCheckpoints[] =
    "SELECT stamp_ns, robot, sequence, number, stored_at_ns FROM hypermap.fusion_checkpoints "
    "WHERE map = $1 AND layer = $2 ORDER BY stamp_ns, robot, sequence, number";
constexpr char kPutCheckpoint[] = R"sql(
INSERT INTO hypermap.fusion_checkpoints (map, layer, stamp_ns, robot, sequence, number, state_size,
    state, stored_at_ns)
  VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9)
  ON CONFLICT (map, layer, stamp_ns, robot, sequence, number) DO UPDATE
    SET state_size = excluded.state_size, state = excluded.state,
      stored_at_ns = excluded.stored_at_ns
)sql";
constexpr char kDropCheckpoint[] =
    "DELETE FROM hypermap.fusion_checkpoints WHERE map = $1 AND layer = $2 AND stamp_ns = $3 "
    "AND robot = $4 AND sequence = $5 AND number = $6";

// Memory of a range in a vector that grows by doubling.
constexpr int64_t kBytesOfRange = 2 * sizeof(SequenceRange);
// Rows of sequences that are in memory at a time.
constexpr int kSequencesPerPage = 10'000;

// Adds a row of kSequences.
absl::Status AddSequences(const SequenceRange& added, std::vector<SequenceRange>* sequences) {
  const size_t num_ranges = sequences->size();
  AppendSequences(added, sequences);
  if (sequences->size() > num_ranges) HYPERMAP_RETURN_IF_ERROR(TakeMemory(kBytesOfRange));
  return CheckCancelled();
}

// Reads an entry from a row of kReadEntries.
absl::StatusOr<FusionLog::StoredEntry> EntryAt(Rows* rows) {
  FusionLog::StoredEntry stored;
  LogEntry& entry = stored.entry;
  entry = {LogKeyAt(rows, 0), std::string(rows->Text(4)), std::string(rows->Text(5)), ""};
  if (entry.key.number > 0) {
    entry.body = std::string(rows->Blob(7));
  } else {
    HYPERMAP_ASSIGN_OR_RETURN(entry.body, UnpackedAt(rows, 7));
    stored.content_hash = static_cast<uint64_t>(rows->Int64(8));
    stored.received_at = absl::FromUnixNanos(rows->Int64(9));
    stored.retracted = rows->Bool(10);
  }
  HYPERMAP_RETURN_IF_ERROR(rows->row_status());
  return stored;
}

}  // namespace

template <typename... Values>
absl::StatusOr<Rows> PostgresFusionLog::Query(const std::string& sql, const std::string& layer,
                                              const Values&... values) {
  HYPERMAP_ASSIGN_OR_RETURN(Connection* const connection, owned_->connection());
  return connection->Query(sql, owned_->map(), layer, values...);
}

absl::StatusOr<std::vector<std::pair<std::string, FusionSettings>>>
PostgresFusionLog::FusedLayers() {
  HYPERMAP_ASSIGN_OR_RETURN(Connection* const connection, owned_->connection());
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows, connection->Query(kFusedLayers, owned_->map()));
  std::vector<std::pair<std::string, FusionSettings>> layers;
  while (rows.Next()) {
    layers.push_back(
        {std::string(rows.Text(0)),
         {std::string(rows.Text(1)), std::string(rows.Text(2)), std::string(rows.Text(3))}});
    HYPERMAP_RETURN_IF_ERROR(InTable(kFusionTable, layers.back().first, rows.row_status()));
  }
  return layers;
}

absl::StatusOr<std::vector<TrackId>> PostgresFusionLog::Tracks(const std::string& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows, Query(kFindTracks, layer));
  std::vector<TrackId> tracks;
  while (rows.Next()) tracks.emplace_back(std::string(rows.Text(0)), rows.Int64(1));
  HYPERMAP_RETURN_IF_ERROR(InTable(kTracksTable, layer, rows.row_status()));
  return tracks;
}

absl::StatusOr<std::optional<FusionLog::Known>> PostgresFusionLog::FindObservation(
    const std::string& layer, const std::string& robot, int64_t sequence) {
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows, Query(kFindObservation, layer, robot, sequence));
  if (!rows.Next()) return std::nullopt;
  Known known;
  const std::optional<int64_t> hash = rows.OptionalInt64(0);
  if (hash) known.content_hash = static_cast<uint64_t>(*hash);
  known.retracted = rows.Bool(1);
  HYPERMAP_RETURN_IF_ERROR(InTable(kObservationsTable, layer, rows.row_status()));
  return known;
}

absl::StatusOr<std::vector<SequenceRange>> PostgresFusionLog::Sequences(const std::string& layer,
                                                                        const std::string& robot) {
  const std::string sql = absl::StrCat(kSequences, kSequencesPerPage);
  std::vector<SequenceRange> sequences;
  int64_t from = std::numeric_limits<int64_t>::min();
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(Rows rows, Query(sql, layer, robot, from));
    while (rows.Next()) {
      const SequenceRange range = {rows.Int64(0), rows.Int64(1)};
      HYPERMAP_RETURN_IF_ERROR(InTable(kObservationsTable, layer, rows.row_status()));
      HYPERMAP_RETURN_IF_ERROR(AddSequences(range, &sequences));
    }
    const bool is_last_page = rows.size() < kSequencesPerPage;
    if (is_last_page || sequences.back().last == std::numeric_limits<int64_t>::max()) {
      return sequences;
    }
    from = sequences.back().last + 1;
  }
}

absl::StatusOr<std::vector<ObservationKey>> PostgresFusionLog::KeysOf(const std::string& layer,
                                                                      const std::string& robot,
                                                                      absl::Time from,
                                                                      absl::Time to) {
  // Times that do not fit into nanoseconds are clamped; no observation has such a stamp.
  HYPERMAP_ASSIGN_OR_RETURN(
      Rows rows, Query(kKeysOf, layer, robot, absl::ToUnixNanos(from), absl::ToUnixNanos(to)));
  std::vector<ObservationKey> keys;
  while (rows.Next()) keys.push_back(KeyAt(&rows, 0));
  HYPERMAP_RETURN_IF_ERROR(InTable(kObservationsTable, layer, rows.row_status()));
  return keys;
}

absl::StatusOr<std::optional<absl::Time>> PostgresFusionLog::NewestStamp(const std::string& layer,
                                                                         const std::string& robot) {
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows, Query(kNewestStamp, layer, robot));
  if (!rows.Next()) return std::nullopt;
  const absl::Time stamp = absl::FromUnixNanos(rows.Int64(0));
  HYPERMAP_RETURN_IF_ERROR(InTable(kObservationsTable, layer, rows.row_status()));
  return stamp;
}

absl::StatusOr<std::optional<ObservationKey>> PostgresFusionLog::NewestKey(
    const std::string& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows, Query(kNewestKey, layer));
  if (!rows.Next()) return std::nullopt;
  ObservationKey key = KeyAt(&rows, 0);
  HYPERMAP_RETURN_IF_ERROR(InTable(kObservationsTable, layer, rows.row_status()));
  return key;
}

absl::StatusOr<std::optional<LogKey>> PostgresFusionLog::NewestFact(const std::string& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(
      Rows rows, Query(absl::StrCat("SELECT stamp_ns, robot, sequence, number "
                                    "FROM hypermap.operator_facts WHERE map = $1 AND layer = $2",
                                    kNewestFirst, "LIMIT 1"),
                       layer));
  if (!rows.Next()) return std::nullopt;
  LogKey key = LogKeyAt(&rows, 0);
  HYPERMAP_RETURN_IF_ERROR(InTable(kFactsTable, layer, rows.row_status()));
  return key;
}

absl::StatusOr<std::vector<LogEntry>> PostgresFusionLog::FactsOfKind(const std::string& layer,
                                                                     const std::string& kind) {
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows, Query(kFactsOfKind, layer, kind));
  std::vector<LogEntry> facts;
  while (rows.Next()) {
    facts.push_back(
        {LogKeyAt(&rows, 0), kind, std::string(rows.Text(4)), std::string(rows.Blob(5))});
    HYPERMAP_RETURN_IF_ERROR(InRow(kFactsTable, layer, facts.back().key, rows.row_status()));
  }
  return facts;
}

absl::StatusOr<std::vector<LogEntry>> PostgresFusionLog::Read(const std::string& layer,
                                                              const LogKey& after,
                                                              int max_entries) {
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<StoredEntry> stored,
                            ReadEntries(layer, after, "AND NOT retracted", max_entries));
  std::vector<LogEntry> entries;
  entries.reserve(stored.size());
  for (StoredEntry& entry : stored) entries.push_back(std::move(entry.entry));
  return entries;
}

absl::StatusOr<std::vector<FusionLog::StoredEntry>> PostgresFusionLog::ReadStored(
    const std::string& layer, const LogKey& after, int max_entries) {
  return ReadEntries(layer, after, /*which=*/"", max_entries);
}

absl::StatusOr<std::vector<FusionLog::StoredEntry>> PostgresFusionLog::ReadEntries(
    const std::string& layer, const LogKey& after, absl::string_view which, int max_entries) {
  const std::string sql = absl::StrReplaceAll(kReadEntries, {{"$which", which}});
  HYPERMAP_ASSIGN_OR_RETURN(
      Rows rows, Query(sql, layer, absl::ToUnixNanos(after.after.stamp), after.after.robot,
                       after.after.sequence, after.number, max_entries));
  std::vector<StoredEntry> entries;
  while (rows.Next()) {
    absl::StatusOr<StoredEntry> entry = EntryAt(&rows);
    if (!entry.ok()) {
      const LogKey key = LogKeyAt(&rows, 0);
      return InRow(key.number > 0 ? kFactsTable : kObservationsTable, layer, key, entry.status());
    }
    entries.push_back(*std::move(entry));
  }
  return entries;
}

absl::StatusOr<std::vector<ForgottenNames>> PostgresFusionLog::Forgotten(
    const std::string& layer, const std::optional<ForgottenNames>& after, int max_count) {
  HYPERMAP_ASSIGN_OR_RETURN(Connection* const connection, owned_->connection());
  return ReadForgotten(*connection, owned_->map(), layer, after, max_count);
}

absl::StatusOr<std::optional<FusionCheckpoint>> PostgresFusionLog::FindCheckpoint(
    const std::string& layer, const std::optional<LogKey>& before) {
  const std::string sql = absl::StrCat("SELECT ", kCheckpointColumns, kOfCheckpoints,
                                       before ? kBeforeKey : "", kNewestFirst, "LIMIT 1");
  const auto find = [&] {
    if (!before) return Query(sql, layer);
    const ObservationKey& after = before->after;
    return Query(sql, layer, absl::ToUnixNanos(after.stamp), after.robot, after.sequence,
                 before->number);
  };
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows, find());
  if (!rows.Next()) return std::nullopt;
  HYPERMAP_ASSIGN_OR_RETURN(FusionCheckpoint checkpoint, CheckpointAt(&rows, layer));
  return checkpoint;
}

absl::StatusOr<std::vector<FusionLog::CheckpointKey>> PostgresFusionLog::Checkpoints(
    const std::string& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows, Query(kFindCheckpoints, layer));
  std::vector<CheckpointKey> keys;
  while (rows.Next()) {
    keys.push_back({LogKeyAt(&rows, 0), absl::FromUnixNanos(rows.Int64(4))});
  }
  HYPERMAP_RETURN_IF_ERROR(InTable(kCheckpointsTable, layer, rows.row_status()));
  return keys;
}

absl::Status PostgresFusionLog::KeepCheckpoint(const std::string& layer,
                                               const FusionCheckpoint& checkpoint,
                                               absl::Span<const LogKey> dropped) {
  const std::string state = PackBytes(checkpoint.state);
  return owned_->Write([&](Pipeline& pipeline) {
    const ObservationKey& after = checkpoint.key.after;
    pipeline.Add(kPutCheckpoint, owned_->map(), layer, absl::ToUnixNanos(after.stamp), after.robot,
                 after.sequence, checkpoint.key.number,
                 static_cast<int64_t>(checkpoint.state.size()), BlobView{state},
                 absl::ToUnixNanos(checkpoint.stored_at));
    for (const LogKey& key : dropped) {
      pipeline.Add(kDropCheckpoint, owned_->map(), layer, absl::ToUnixNanos(key.after.stamp),
                   key.after.robot, key.after.sequence, key.number);
    }
    return absl::OkStatus();
  });
}

absl::StatusOr<std::optional<FusionBase>> PostgresFusionLog::FindBase(const std::string& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(Connection* const connection, owned_->connection());
  return postgres::FindBase(*connection, owned_->map(), layer);
}

absl::StatusOr<bool> PostgresFusionLog::HasForgotten(const std::string& layer,
                                                     const std::string& robot) {
  HYPERMAP_ASSIGN_OR_RETURN(Connection* const connection, owned_->connection());
  return postgres::HasForgotten(*connection, owned_->map(), layer, robot);
}

absl::StatusOr<std::optional<FusionCheckpoint>> PostgresFusionLog::FindNextBase(
    const std::string& layer, absl::Time stored_before) {
  HYPERMAP_ASSIGN_OR_RETURN(Connection* const connection, owned_->connection());
  return postgres::FindNextBase(*connection, owned_->map(), layer, stored_before);
}

absl::Status PostgresFusionLog::MoveBase(const std::string& layer, const LogKey& checkpoint) {
  return owned_->WriteInSteps([&](Connection& connection) {
    return postgres::MoveBase(connection, owned_->map(), layer, checkpoint);
  });
}

}  // namespace hypermap::storage::postgres
