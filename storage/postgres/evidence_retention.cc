#include "storage/postgres/evidence_retention.h"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/postgres/fusion_rows.h"

namespace hypermap::storage::postgres {
namespace {

constexpr char kBasesTable[] = "hypermap.fusion_bases";
constexpr char kForgottenTable[] = "hypermap.forgotten_sequences";

constexpr char kFindBase[] = R"sql(
SELECT stamp_ns, robot, sequence, number, num_facts, state_size, state
  FROM hypermap.fusion_bases WHERE map = $1 AND layer = $2
)sql";

// Of the observations of the robot, those up to the base are the oldest. The order of the first
// query leads to its index, which the planner would not use where most rows are of one robot.
constexpr char kHasForgotten[] = R"sql(
SELECT (SELECT first_sequence FROM hypermap.forgotten_sequences
      WHERE map = $1 AND layer = $2 AND robot = $3
      ORDER BY first_sequence LIMIT 1) IS NOT NULL
  OR EXISTS (SELECT 1 FROM hypermap.fusion_bases AS b
      CROSS JOIN LATERAL (SELECT stamp_ns, robot, sequence FROM hypermap.observations
        WHERE map = $1 AND layer = $2 AND robot = $3
        ORDER BY stamp_ns, sequence LIMIT 1) AS oldest
      WHERE b.map = $1 AND b.layer = $2
        AND (oldest.stamp_ns, oldest.robot, oldest.sequence)
          <= (b.stamp_ns, b.robot, b.sequence))
)sql";

// Follows kCheckpointColumns.
constexpr char kFindNextBase[] = R"sql(
  FROM hypermap.fusion_checkpoints AS c
  WHERE map = $1 AND layer = $2 AND stamp_ns > $3 AND stored_at_ns < $4
    AND NOT EXISTS (SELECT 1 FROM hypermap.fusion_bases AS b
      WHERE b.map = c.map AND b.layer = c.layer
        AND (b.stamp_ns, b.robot, b.sequence, b.number)
          >= (c.stamp_ns, c.robot, c.sequence, c.number))
  ORDER BY stamp_ns DESC, robot DESC, sequence DESC, number DESC LIMIT 1
)sql";

// The checkpoint that becomes the base, and the number of the newest fact up to it. Facts of before
// the former base may be removed by now.
constexpr char kMoveBase[] = R"sql(
INSERT INTO hypermap.fusion_bases AS base
    (map, layer, stamp_ns, robot, sequence, number, num_facts, state_size, state)
  SELECT map, layer, stamp_ns, robot, sequence, number,
      coalesce((SELECT max(f.number) FROM hypermap.operator_facts AS f
        WHERE f.map = c.map AND f.layer = c.layer
          AND (f.stamp_ns, f.robot, f.sequence, f.number)
            <= (c.stamp_ns, c.robot, c.sequence, c.number)), 0),
      state_size, state
    FROM hypermap.fusion_checkpoints AS c
    WHERE map = $1 AND layer = $2 AND stamp_ns = $3 AND robot = $4 AND sequence = $5
      AND number = $6
  ON CONFLICT (map, layer) DO UPDATE SET stamp_ns = excluded.stamp_ns, robot = excluded.robot,
    sequence = excluded.sequence, number = excluded.number,
    num_facts = greatest(excluded.num_facts, base.num_facts), state_size = excluded.state_size,
    state = excluded.state
)sql";
constexpr char kRemoveCheckpoints[] =
    "DELETE FROM hypermap.fusion_checkpoints WHERE map = $1 AND layer = $2 "
    "AND (stamp_ns, robot, sequence, number) <= ($3, $4, $5, $6)";

constexpr char kBaseKeys[] = R"sql(
SELECT layer, stamp_ns, robot, sequence, number FROM hypermap.fusion_bases
  WHERE map = $1 ORDER BY layer
)sql";
constexpr char kRemoveObservations[] = R"sql(
DELETE FROM hypermap.observations WHERE ctid = ANY (ARRAY(
    SELECT ctid FROM hypermap.observations
      WHERE map = $1 AND layer = $2 AND (stamp_ns, robot, sequence) <= ($3, $4, $5)
      ORDER BY stamp_ns, robot, sequence LIMIT $6))
  RETURNING robot, sequence
)sql";
constexpr char kRemoveFacts[] = R"sql(
DELETE FROM hypermap.operator_facts WHERE ctid = ANY (ARRAY(
    SELECT ctid FROM hypermap.operator_facts
      WHERE map = $1 AND layer = $2 AND (stamp_ns, robot, sequence, number) <= ($3, $4, $5, $6)
      ORDER BY stamp_ns, robot, sequence, number LIMIT $7))
)sql";

// Removes the ranges that an added one continues, or that continue it. Ranges do not overlap, so
// that only the last of those that begin before the added one can touch it.
constexpr char kTakeTouching[] = R"sql(
DELETE FROM hypermap.forgotten_sequences AS f
  USING unnest($3::text[], $4::bigint[], $5::bigint[])
    AS added (robot, touches_from, touches_to)
  WHERE f.map = $1 AND f.layer = $2 AND f.robot = added.robot
    AND f.first_sequence <= added.touches_to
    AND f.first_sequence >= coalesce(
      (SELECT max(before.first_sequence) FROM hypermap.forgotten_sequences AS before
        WHERE before.map = $1 AND before.layer = $2 AND before.robot = added.robot
          AND before.first_sequence <= added.touches_from), added.touches_from)
    AND f.last_sequence >= added.touches_from
  RETURNING f.robot, f.first_sequence, f.last_sequence
)sql";
constexpr char kInsertForgotten[] = R"sql(
INSERT INTO hypermap.forgotten_sequences (map, layer, robot, first_sequence, last_sequence)
  SELECT $1, $2, r.robot, r.first_sequence, r.last_sequence
    FROM unnest($3::text[], $4::bigint[], $5::bigint[])
      AS r (robot, first_sequence, last_sequence)
)sql";

constexpr char kReadForgotten[] = R"sql(
SELECT robot, first_sequence, last_sequence FROM hypermap.forgotten_sequences
  WHERE map = $1 AND layer = $2 AND (robot, first_sequence) > ($3, $4)
  ORDER BY robot, first_sequence LIMIT $5
)sql";

// Ranges of sequences by robot.
using Ranges = std::map<std::string, std::vector<SequenceRange>>;

// The ranges as columns.
struct RangeColumns {
  std::vector<absl::string_view> robots;
  std::vector<int64_t> first;
  std::vector<int64_t> last;
};

RangeColumns RangeColumnsOf(const Ranges& ranges) {
  RangeColumns columns;
  for (const auto& [robot, of_robot] : ranges) {
    for (const SequenceRange& range : of_robot) {
      columns.robots.push_back(robot);
      columns.first.push_back(range.first);
      columns.last.push_back(range.last);
    }
  }
  return columns;
}

// Sorts the ranges, and joins those that continue or overlap one another.
void JoinRanges(std::vector<SequenceRange>* ranges) {
  std::sort(ranges->begin(), ranges->end(),
            [](const SequenceRange& a, const SequenceRange& b) { return a.first < b.first; });
  std::vector<SequenceRange> joined;
  for (const SequenceRange& range : *ranges) {
    if (joined.empty() ||
        (range.first > joined.back().last && range.first - 1 > joined.back().last)) {
      joined.push_back(range);
    } else {
      joined.back().last = std::max(joined.back().last, range.last);
    }
  }
  *ranges = std::move(joined);
}

// Adds forgotten sequences of a layer, and joins them with those that they continue.
absl::Status AddForgotten(Connection& connection, int64_t map, const std::string& layer,
                          Ranges ranges) {
  for (auto& [robot, of_robot] : ranges) JoinRanges(&of_robot);
  RangeColumns touched = RangeColumnsOf(ranges);
  for (int64_t& first : touched.first) {
    first = std::max(first, std::numeric_limits<int64_t>::min() + 1) - 1;
  }
  for (int64_t& last : touched.last) {
    last = std::min(last, std::numeric_limits<int64_t>::max() - 1) + 1;
  }
  HYPERMAP_ASSIGN_OR_RETURN(Rows taken, connection.Query(kTakeTouching, map, layer, touched.robots,
                                                         touched.first, touched.last));
  while (taken.Next()) {
    ranges[std::string(taken.Text(0))].push_back({taken.Int64(1), taken.Int64(2)});
  }
  HYPERMAP_RETURN_IF_ERROR(InTable(kForgottenTable, layer, taken.row_status()));
  for (auto& [robot, of_robot] : ranges) JoinRanges(&of_robot);
  const RangeColumns joined = RangeColumnsOf(ranges);
  return connection.Query(kInsertForgotten, map, layer, joined.robots, joined.first, joined.last)
      .status();
}

// Removes at most `max_rows` observations up to the base.
absl::StatusOr<int64_t> RemoveObservations(Connection& connection, int64_t map,
                                           const std::string& layer, const ObservationKey& base,
                                           int64_t max_rows) {
  HYPERMAP_ASSIGN_OR_RETURN(
      Rows removed, connection.Query(kRemoveObservations, map, layer, absl::ToUnixNanos(base.stamp),
                                     base.robot, base.sequence, max_rows));
  Ranges ranges;
  while (removed.Next()) {
    ranges[std::string(removed.Text(0))].push_back({removed.Int64(1), removed.Int64(1)});
  }
  HYPERMAP_RETURN_IF_ERROR(InTable(kObservationsTable, layer, removed.row_status()));
  if (ranges.empty()) return 0;
  HYPERMAP_RETURN_IF_ERROR(AddForgotten(connection, map, layer, std::move(ranges)));
  return removed.size();
}

}  // namespace

absl::StatusOr<std::optional<FusionBase>> FindBase(Connection& connection, int64_t map,
                                                   const std::string& layer) {
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows, connection.Query(kFindBase, map, layer));
  if (!rows.Next()) return std::nullopt;
  FusionBase base{LogKeyAt(&rows, 0), rows.Int64(4), ""};
  absl::StatusOr<std::string> state = UnpackedAt(&rows, 6);
  if (!state.ok()) return InRow(kBasesTable, layer, base.key, state.status());
  base.state = *std::move(state);
  return base;
}

absl::StatusOr<bool> HasForgotten(Connection& connection, int64_t map, const std::string& layer,
                                  const std::string& robot) {
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows, connection.Query(kHasForgotten, map, layer, robot));
  return rows.Next() && rows.Bool(0);
}

absl::StatusOr<std::optional<FusionCheckpoint>> FindNextBase(Connection& connection, int64_t map,
                                                             const std::string& layer,
                                                             absl::Time stored_before) {
  // A state before all observations is no base: nothing would be forgotten.
  HYPERMAP_ASSIGN_OR_RETURN(
      Rows rows, connection.Query(absl::StrCat("SELECT ", kCheckpointColumns, kFindNextBase), map,
                                  layer, absl::ToUnixNanos(BeforeAll().after.stamp),
                                  absl::ToUnixNanos(stored_before)));
  if (!rows.Next()) return std::nullopt;
  HYPERMAP_ASSIGN_OR_RETURN(FusionCheckpoint checkpoint, CheckpointAt(&rows, layer));
  return checkpoint;
}

absl::StatusOr<std::vector<ForgottenNames>> ReadForgotten(
    Connection& connection, int64_t map, const std::string& layer,
    const std::optional<ForgottenNames>& after, int max_count) {
  // No robot has an empty name.
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows,
                            connection.Query(kReadForgotten, map, layer, after ? after->robot : "",
                                             after ? after->sequences.first : 0, max_count));
  std::vector<ForgottenNames> names;
  while (rows.Next()) {
    names.push_back({std::string(rows.Text(0)), {rows.Int64(1), rows.Int64(2)}});
  }
  HYPERMAP_RETURN_IF_ERROR(InTable(kForgottenTable, layer, rows.row_status()));
  return names;
}

absl::Status MoveBase(Connection& connection, int64_t map, const std::string& layer,
                      const LogKey& checkpoint) {
  const ObservationKey& after = checkpoint.after;
  const int64_t stamp_ns = absl::ToUnixNanos(after.stamp);
  HYPERMAP_ASSIGN_OR_RETURN(const Rows moved,
                            connection.Query(kMoveBase, map, layer, stamp_ns, after.robot,
                                             after.sequence, checkpoint.number));
  if (moved.changed_rows() != 1) {
    return absl::InternalError("moves the base of a log to a checkpoint that is not there");
  }
  return connection
      .Query(kRemoveCheckpoints, map, layer, stamp_ns, after.robot, after.sequence,
             checkpoint.number)
      .status();
}

absl::StatusOr<int64_t> RemoveForgottenEvidence(Connection& connection, int64_t map,
                                                int64_t max_rows) {
  HYPERMAP_ASSIGN_OR_RETURN(Rows bases, connection.Query(kBaseKeys, map));
  int64_t removed = 0;
  while (removed < max_rows && bases.Next()) {
    const std::string layer(bases.Text(0));
    const LogKey base = LogKeyAt(&bases, 1);
    HYPERMAP_RETURN_IF_ERROR(InTable(kBasesTable, layer, bases.row_status()));
    HYPERMAP_ASSIGN_OR_RETURN(
        const int64_t observations,
        RemoveObservations(connection, map, layer, base.after, max_rows - removed));
    removed += observations;
    HYPERMAP_ASSIGN_OR_RETURN(
        const Rows facts,
        connection.Query(kRemoveFacts, map, layer, absl::ToUnixNanos(base.after.stamp),
                         base.after.robot, base.after.sequence, base.number, max_rows - removed));
    removed += facts.changed_rows();
  }
  return removed;
}

}  // namespace hypermap::storage::postgres
