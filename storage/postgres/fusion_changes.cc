#include "storage/postgres/fusion_changes.h"

#include <map>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/types/span.h"
#include "storage/encoding/packed_bytes.h"
#include "storage/postgres/row_parts.h"

namespace hypermap::storage::postgres {
namespace {

constexpr char kPutSettings[] = R"sql(
INSERT INTO hypermap.fusion (map, layer, strategy, parameters, exploration_layer)
  VALUES ($1, $2, $3, $4, $5)
  ON CONFLICT (map, layer) DO UPDATE SET strategy = excluded.strategy,
    parameters = excluded.parameters, exploration_layer = excluded.exploration_layer
)sql";
constexpr char kDropCheckpointsFrom[] =
    "DELETE FROM hypermap.fusion_checkpoints WHERE map = $1 AND layer = $2 "
    "AND (stamp_ns, robot, sequence, number) >= ($3, $4, $5, $6)";
constexpr char kInsertObservations[] = R"sql(
INSERT INTO hypermap.observations (map, layer, stamp_ns, robot, sequence, content_hash, retracted,
    received_at_ns, body_size, body)
  SELECT $1, $2, r.stamp_ns, r.robot, r.sequence, r.content_hash, false, r.received_at_ns,
      r.body_size, r.body
    FROM unnest($3::bigint[], $4::text[], $5::bigint[], $6::bigint[], $7::bigint[], $8::bigint[],
        $9::bytea[])
      AS r (stamp_ns, robot, sequence, content_hash, received_at_ns, body_size, body)
)sql";
// The statements of a pipeline are not answered one by one. A cast that fails ends the transaction
// when there is no row to update; its text is part of the error.
constexpr char kRetract[] = R"sql(
WITH named AS (
    SELECT DISTINCT robot, sequence FROM unnest($3::text[], $4::bigint[]) AS n (robot, sequence)),
  retracted AS (
    UPDATE hypermap.observations AS o SET retracted = true FROM named AS n
      WHERE o.map = $1 AND o.layer = $2 AND o.robot = n.robot AND o.sequence = n.sequence
      RETURNING 1)
SELECT CAST(CASE WHEN (SELECT count(*) FROM retracted) = (SELECT count(*) FROM named) THEN '0'
    ELSE 'retracts an observation that is not there' END AS integer)
)sql";
constexpr char kInsertFacts[] = R"sql(
INSERT INTO hypermap.operator_facts (map, layer, stamp_ns, robot, sequence, number, kind, track,
    body)
  SELECT $1, $2, r.stamp_ns, r.robot, r.sequence, r.number, r.kind, r.track, r.body
    FROM unnest($3::bigint[], $4::text[], $5::bigint[], $6::bigint[], $7::text[], $8::text[],
        $9::bytea[])
      AS r (stamp_ns, robot, sequence, number, kind, track, body)
)sql";
constexpr char kPutTracks[] = R"sql(
INSERT INTO hypermap.fusion_tracks (map, layer, track, object_id)
  SELECT $1, $2, r.track, r.object_id FROM unnest($3::text[], $4::bigint[]) AS r (track, object_id)
  ON CONFLICT (map, layer, track) DO UPDATE SET object_id = excluded.object_id
)sql";

constexpr char kPutBase[] = R"sql(
INSERT INTO hypermap.fusion_bases
    (map, layer, stamp_ns, robot, sequence, number, num_facts, state_size, state)
  VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9)
  ON CONFLICT (map, layer) DO UPDATE SET stamp_ns = excluded.stamp_ns, robot = excluded.robot,
    sequence = excluded.sequence, number = excluded.number, num_facts = excluded.num_facts,
    state_size = excluded.state_size, state = excluded.state
)sql";
constexpr char kInsertForgottenSequences[] = R"sql(
INSERT INTO hypermap.forgotten_sequences (map, layer, robot, first_sequence, last_sequence)
  SELECT $1, $2, r.robot, r.first_sequence, r.last_sequence
    FROM unnest($3::text[], $4::bigint[], $5::bigint[])
      AS r (robot, first_sequence, last_sequence)
)sql";

constexpr const char* kFusionTables[] = {
    "fusion",       "observations",       "operator_facts",     "fusion_tracks",
    "fusion_bases", "fusion_checkpoints", "forgotten_sequences"};

void AddObservations(Pipeline& pipeline, int64_t map, const FusionChange& change) {
  using Row = LoggedObservation;
  const auto send = [&](absl::Span<const Row> rows) {
    const auto integers = [&](auto get) { return Column<int64_t>(rows, get); };
    const auto packed = Column<std::string>(rows, [](auto& r) { return PackBytes(r.body); });
    pipeline.Add(
        kInsertObservations, map, change.layer,
        integers([](auto& r) { return absl::ToUnixNanos(r.key.stamp); }),
        Column<absl::string_view>(rows, [](auto& r) { return absl::string_view(r.key.robot); }),
        integers([](auto& r) { return r.key.sequence; }),
        integers([](auto& r) { return static_cast<int64_t>(r.content_hash); }),
        integers([](auto& r) { return absl::ToUnixNanos(r.received_at); }),
        integers([](auto& r) { return static_cast<int64_t>(r.body.size()); }),
        Column<BlobView>(absl::MakeConstSpan(packed), [](auto& body) { return BlobView{body}; }));
  };
  InParts(
      absl::MakeConstSpan(change.observations), [](const Row& row) { return row.body.size(); },
      send);
}

void AddRetractions(Pipeline& pipeline, int64_t map, const FusionChange& change) {
  if (change.retracted.empty()) return;
  const auto rows = absl::MakeConstSpan(change.retracted);
  pipeline.Add(kRetract, map, change.layer,
               Column<absl::string_view>(rows, [](auto& r) { return absl::string_view(r.robot); }),
               Column<int64_t>(rows, [](auto& r) { return r.sequence; }));
}

void AddFacts(Pipeline& pipeline, int64_t map, const FusionChange& change) {
  using Row = LoggedFact;
  const auto send = [&](absl::Span<const Row> rows) {
    const auto integers = [&](auto get) { return Column<int64_t>(rows, get); };
    const auto texts = [&](auto get) { return Column<absl::string_view>(rows, get); };
    pipeline.Add(kInsertFacts, map, change.layer,
                 integers([](auto& r) { return absl::ToUnixNanos(r.key.after.stamp); }),
                 texts([](auto& r) { return absl::string_view(r.key.after.robot); }),
                 integers([](auto& r) { return r.key.after.sequence; }),
                 integers([](auto& r) { return r.key.number; }),
                 texts([](auto& r) { return absl::string_view(r.kind); }),
                 texts([](auto& r) { return absl::string_view(r.track); }),
                 Column<BlobView>(rows, [](auto& r) { return BlobView{r.body}; }));
  };
  InParts(
      absl::MakeConstSpan(change.facts), [](const Row& row) { return row.body.size(); }, send);
}

void AddTracks(Pipeline& pipeline, int64_t map, const FusionChange& change) {
  if (change.tracks.empty()) return;
  // A statement may put each row only once. The last value counts.
  std::map<absl::string_view, ObjectId> ids;
  for (const auto& [track, id] : change.tracks) ids[track] = id;
  std::vector<absl::string_view> tracks;
  std::vector<int64_t> object_ids;
  for (const auto& [track, id] : ids) {
    tracks.push_back(track);
    object_ids.push_back(id);
  }
  pipeline.Add(kPutTracks, map, change.layer, tracks, object_ids);
}

void PutBase(Pipeline& pipeline, int64_t map, const std::string& layer, const FusionBase& base) {
  const ObservationKey& after = base.key.after;
  const std::string state = PackBytes(base.state);
  pipeline.Add(kPutBase, map, layer, absl::ToUnixNanos(after.stamp), after.robot, after.sequence,
               base.key.number, base.num_facts, static_cast<int64_t>(base.state.size()),
               BlobView{state});
}

void AddForgotten(Pipeline& pipeline, int64_t map, const FusionChange& change) {
  if (change.forgotten.empty()) return;
  const auto rows = absl::MakeConstSpan(change.forgotten);
  pipeline.Add(kInsertForgottenSequences, map, change.layer,
               Column<absl::string_view>(rows, [](auto& r) { return absl::string_view(r.robot); }),
               Column<int64_t>(rows, [](auto& r) { return r.sequences.first; }),
               Column<int64_t>(rows, [](auto& r) { return r.sequences.last; }));
}

}  // namespace

void AddFusionChange(Pipeline& pipeline, int64_t map, const FusionChange& change) {
  const std::string& layer = change.layer;
  if (change.settings) {
    pipeline.Add(kPutSettings, map, layer, change.settings->strategy, change.settings->parameters,
                 change.settings->exploration_layer);
  }
  if (change.stale_from) {
    const ObservationKey& after = change.stale_from->after;
    pipeline.Add(kDropCheckpointsFrom, map, layer, absl::ToUnixNanos(after.stamp), after.robot,
                 after.sequence, change.stale_from->number);
  }
  AddObservations(pipeline, map, change);
  AddRetractions(pipeline, map, change);
  AddFacts(pipeline, map, change);
  AddTracks(pipeline, map, change);
  if (change.base) PutBase(pipeline, map, layer, *change.base);
  AddForgotten(pipeline, map, change);
}

void DropAllFusion(Pipeline& pipeline, int64_t map) {
  for (const char* const table : kFusionTables) {
    pipeline.Add(absl::StrCat("DELETE FROM hypermap.", table, " WHERE map = $1"), map);
  }
}

void DropFusion(Pipeline& pipeline, int64_t map, const std::string& layer) {
  for (const char* const table : kFusionTables) {
    pipeline.Add(absl::StrCat("DELETE FROM hypermap.", table, " WHERE map = $1 AND layer = $2"),
                 map, layer);
  }
}

}  // namespace hypermap::storage::postgres
