#include "storage/transfer/map_digest.h"

#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "map/digest/digest_writer.h"
#include "map/layers/layer_registry.h"
#include "storage/history.h"
#include "storage/transfer/history_digest.h"
#include "storage/transfer/paging.h"

namespace hypermap::storage {
namespace {

class Digester {
 public:
  explicit Digester(ReadableMap* map) : map_(*map) {}

  absl::StatusOr<MapDigest> Run();

 private:
  // Each adds one part, or one for each fused layer.
  absl::Status AddHeader();
  absl::Status AddContent(const std::string& part, Revision revision);
  absl::Status AddRevisions();
  absl::Status AddCommits();
  absl::Status AddReceipts();
  absl::Status AddTimeMarks();
  absl::Status AddEvidence();

  absl::Status AddLayer(PastMap& past, const LayerStructure& layer, DigestWriter* writer);
  absl::Status AddEvidenceOf(const std::string& layer, const FusionSettings& settings);
  // Adds the entries after the base, and notes the robots of all.
  absl::Status AddEntries(const std::string& layer, const LogKey& base, DigestWriter* writer,
                          std::set<std::string>* robots);
  absl::Status AddNames(const std::string& layer, const std::set<std::string>& robots,
                        DigestWriter* writer);
  absl::Status AddCheckpoints(const std::string& layer, DigestWriter* writer);

  ReadableMap& map_;
  MapPosition position_;
  std::unique_ptr<HistoryReader> history_;
  MapDigest digest_;
};

absl::StatusOr<MapDigest> Digester::Run() {
  HYPERMAP_ASSIGN_OR_RETURN(position_, map_.Position());
  HYPERMAP_ASSIGN_OR_RETURN(history_, map_.OpenHistory());
  digest_.newest = position_.kept.newest;
  HYPERMAP_RETURN_IF_ERROR(AddHeader());
  HYPERMAP_RETURN_IF_ERROR(AddContent("oldest", position_.kept.oldest));
  HYPERMAP_RETURN_IF_ERROR(AddContent("newest", position_.kept.newest));
  HYPERMAP_RETURN_IF_ERROR(AddRevisions());
  HYPERMAP_RETURN_IF_ERROR(AddCommits());
  HYPERMAP_RETURN_IF_ERROR(AddReceipts());
  HYPERMAP_RETURN_IF_ERROR(AddTimeMarks());
  HYPERMAP_RETURN_IF_ERROR(AddEvidence());
  return std::move(digest_);
}

absl::Status Digester::AddHeader() {
  const MapHeader& header = map_.header();
  DigestWriter writer;
  writer.Add(header.frame_id);
  writer.Add(header.created_at);
  writer.Add(header.request_id);
  writer.Add(position_.kept.oldest);
  writer.Add(position_.kept.newest);
  writer.Add(position_.next_object_id);
  digest_.parts["header"] = std::move(writer).Finish();
  return absl::OkStatus();
}

absl::Status Digester::AddContent(const std::string& part, Revision revision) {
  absl::StatusOr<std::unique_ptr<PastMap>> past = history_->At(revision);
  if (!past.ok()) return AsCompacted(past.status());
  const MapStructure& structure = *(*past)->structure();
  DigestWriter writer;
  digest_.num_objects = 0;
  writer.Add(structure.frames);
  for (const auto& [name, layer] : structure.layers) {
    HYPERMAP_RETURN_IF_ERROR(AddLayer(**past, layer, &writer));
  }
  digest_.parts[part] = std::move(writer).Finish();
  return absl::OkStatus();
}

absl::Status Digester::AddLayer(PastMap& past, const LayerStructure& layer, DigestWriter* writer) {
  AddTo(writer, layer);
  if (!IsGridKind(layer.spec.kind)) {
    HYPERMAP_ASSIGN_OR_RETURN(const std::vector<ObjectPtr> objects, past.Objects(layer.spec.name));
    for (const ObjectPtr& object : objects) writer->Add(object.get());
    writer->Add(objects.size());
    digest_.num_objects += static_cast<int64_t>(objects.size());
    return absl::OkStatus();
  }
  HYPERMAP_ASSIGN_OR_RETURN(const TileMap tiles, past.Tiles(layer.spec.name, layer.extent));
  for (const auto& [index, tile] : tiles) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    writer->Add(index.row);
    writer->Add(index.col);
    writer->Add(tile.get());
  }
  writer->Add(tiles.size());
  return absl::OkStatus();
}

absl::Status Digester::AddRevisions() {
  DigestWriter writer;
  Revision after = position_.kept.oldest - 1;
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(
        const std::vector<RevisionRecord> records,
        history_->Revisions(after, position_.kept.newest + 1, /*newest_first=*/false, kPageRows));
    if (records.empty()) break;
    for (const RevisionRecord& record : records) {
      writer.Add(record.revision);
      writer.Add(record.time);
      writer.Add(record.author);
      writer.Add(record.num_changes);
    }
    digest_.num_revisions += static_cast<int64_t>(records.size());
    after = records.back().revision;
  }
  digest_.parts["revisions"] = std::move(writer).Finish();
  return absl::OkStatus();
}

absl::Status Digester::AddCommits() {
  DigestWriter writer;
  const absl::Status status =
      ForEachPage(*history_, position_.kept, [&](absl::Span<PastCommit> commits) -> absl::Status {
        for (const PastCommit& commit : commits) {
          writer.Add(commit.record.revision);
          for (const Change& change : commit.changes) {
            HYPERMAP_RETURN_IF_ERROR(AddTo(&writer, change));
          }
        }
        return absl::OkStatus();
      });
  HYPERMAP_RETURN_IF_ERROR(status);
  digest_.parts["commits"] = std::move(writer).Finish();
  return absl::OkStatus();
}

absl::Status Digester::AddReceipts() {
  DigestWriter writer;
  const absl::Status status = ForEachReceipts(map_, [&](absl::Span<TimedReceipt> receipts) {
    for (const TimedReceipt& timed : receipts) {
      writer.Add(timed.receipt.request_id);
      writer.Add(timed.receipt.revision);
      writer.Add(timed.receipt.request_digest);
      writer.Add(timed.time);
      for (const ObjectId id : timed.receipt.object_ids) writer.Add(id);
      writer.Add(timed.receipt.object_ids.size());
    }
    return absl::OkStatus();
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  digest_.parts["receipts"] = std::move(writer).Finish();
  return absl::OkStatus();
}

absl::Status Digester::AddTimeMarks() {
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<TimeMark> marks, map_.TimeMarks());
  DigestWriter writer;
  for (const TimeMark& mark : marks) {
    writer.Add(mark.revision);
    writer.Add(mark.commit_time);
    writer.Add(absl::ToInt64Nanoseconds(mark.passed));
    writer.Add(absl::ToInt64Nanoseconds(mark.lived));
    writer.Add(mark.server_time);
    writer.Add(mark.boot_id);
    writer.Add(absl::ToInt64Nanoseconds(mark.since_boot));
  }
  digest_.parts["time marks"] = std::move(writer).Finish();
  return absl::OkStatus();
}

absl::Status Digester::AddEvidence() {
  HYPERMAP_ASSIGN_OR_RETURN(const auto layers, map_.fusion_log().FusedLayers());
  for (const auto& [layer, settings] : layers) {
    HYPERMAP_RETURN_IF_ERROR(AddEvidenceOf(layer, settings));
  }
  return absl::OkStatus();
}

absl::Status Digester::AddEvidenceOf(const std::string& layer, const FusionSettings& settings) {
  FusionLog& log = map_.fusion_log();
  DigestWriter writer;
  writer.Add(settings.strategy);
  writer.Add(settings.parameters);
  writer.Add(settings.exploration_layer);
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<TrackId> tracks, log.Tracks(layer));
  for (const auto& [track, id] : tracks) {
    writer.Add(track);
    writer.Add(id);
  }
  writer.Add(tracks.size());
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<FusionBase> base, log.FindBase(layer));
  writer.Add(base.has_value());
  if (base) {
    AddTo(&writer, base->key);
    writer.Add(base->num_facts);
    writer.Add(base->state);
  }
  std::set<std::string> robots;
  const LogKey after = base ? base->key : BeforeAll();
  HYPERMAP_RETURN_IF_ERROR(AddEntries(layer, after, &writer, &robots));
  HYPERMAP_RETURN_IF_ERROR(AddNames(layer, robots, &writer));
  HYPERMAP_RETURN_IF_ERROR(AddCheckpoints(layer, &writer));
  digest_.parts[absl::StrCat("evidence of ", layer)] = std::move(writer).Finish();
  return absl::OkStatus();
}

absl::Status Digester::AddEntries(const std::string& layer, const LogKey& base,
                                  DigestWriter* writer, std::set<std::string>* robots) {
  const auto add = [&](absl::Span<FusionLog::StoredEntry> entries) {
    for (const FusionLog::StoredEntry& stored : entries) {
      const LogEntry& entry = stored.entry;
      if (entry.key.number == 0) robots->insert(entry.key.after.robot);
      if (entry.key <= base) continue;
      if (entry.key.number == 0) ++digest_.num_observations;
      AddTo(writer, entry.key);
      writer->Add(entry.kind);
      writer->Add(entry.track);
      writer->Add(entry.body);
      writer->Add(stored.content_hash);
      writer->Add(stored.received_at);
      writer->Add(stored.retracted);
    }
    return absl::OkStatus();
  };
  return ForEachEntries(map_.fusion_log(), layer, add);
}

absl::Status Digester::AddNames(const std::string& layer, const std::set<std::string>& robots,
                                DigestWriter* writer) {
  std::set<std::string> all = robots;
  const auto note = [&](absl::Span<ForgottenNames> names) {
    for (const ForgottenNames& of_robot : names) all.insert(of_robot.robot);
    return absl::OkStatus();
  };
  HYPERMAP_RETURN_IF_ERROR(ForEachForgotten(map_.fusion_log(), layer, note));
  for (const std::string& robot : all) {
    HYPERMAP_ASSIGN_OR_RETURN(const std::vector<SequenceRange> ranges,
                              map_.fusion_log().Sequences(layer, robot));
    writer->Add(robot);
    for (const SequenceRange& range : ranges) {
      writer->Add(range.first);
      writer->Add(range.last);
    }
    writer->Add(ranges.size());
  }
  return absl::OkStatus();
}

absl::Status Digester::AddCheckpoints(const std::string& layer, DigestWriter* writer) {
  return ForEachCheckpoint(map_.fusion_log(), layer, [&](const FusionCheckpoint& checkpoint) {
    AddTo(writer, checkpoint.key);
    writer->Add(checkpoint.stored_at);
    writer->Add(checkpoint.state);
    return absl::OkStatus();
  });
}

}  // namespace

absl::StatusOr<MapDigest> DigestOf(ReadableMap& map) { return Digester(&map).Run(); }

std::vector<std::string> DifferingParts(const MapDigest& a, const MapDigest& b) {
  std::set<std::string> names;
  for (const MapDigest* digest : {&a, &b}) {
    for (const auto& [name, unused] : digest->parts) names.insert(name);
  }
  std::vector<std::string> differing;
  for (const std::string& name : names) {
    const auto in_a = a.parts.find(name);
    const auto in_b = b.parts.find(name);
    const bool is_same =
        in_a != a.parts.end() && in_b != b.parts.end() && in_a->second == in_b->second;
    if (!is_same) differing.push_back(name);
  }
  return differing;
}

}  // namespace hypermap::storage
