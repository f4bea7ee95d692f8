#include "tests/robustness/description.h"

#include <bit>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/time.h"
#include "base/digest/sha256.h"
#include "base/status/status_macros.h"
#include "map/edits/apply.h"
#include "map/edits/change.h"
#include "storage/geopackage/geopackage_store.h"
#include "storage/incarnation.h"
#include "tests/robustness/recorder.h"
#include "wire/layer.h"
#include "wire/observation.h"

namespace hypermap::robustness {
namespace {

std::string DigestOf(absl::string_view bytes) {
  Sha256 digest;
  digest.Add(bytes);
  return absl::BytesToHexString(std::move(digest).Finish().substr(0, 8));
}

std::string TextOf(const ObjectPtr& object) {
  if (object == nullptr) return "none";
  return absl::StrCat("object ", object->id, " of version ", object->version, " ",
                      DigestOf(wire::ObjectToBytes(*object)), "\n");
}

std::string TextOf(const TilePtr& tile) {
  if (tile == nullptr) return "none";
  // Quicker than a digest, of which a description would need thousands.
  uint64_t hash = 0;
  for (const CellCode code : tile->codes()) {
    const auto bits = std::bit_cast<uint32_t>(IsUnknown(code) ? kUnknownCode : code);
    hash = (hash ^ bits) * 0x9e3779b97f4a7c15;
    hash ^= hash >> 32;
  }
  return absl::StrCat(absl::Hex(hash, absl::kZeroPad16));
}

std::string TextOf(const CellBox& box) {
  return absl::StrCat(box.row_begin, "-", box.row_end, " x ", box.col_begin, "-", box.col_end);
}

std::string TextOf(const TileMap& tiles) {
  std::string text;
  for (const auto& [index, tile] : std::map(tiles.begin(), tiles.end())) {
    absl::StrAppend(&text, "tile ", index.row, ", ", index.col, " ", TextOf(tile), "\n");
  }
  return text;
}

std::string TextOf(const FrameTransform& frame) {
  const PlanarTransform& pose = frame.parent_from_child;
  return absl::StrFormat("frame %s in %s: %.17g %.17g %.17g\n", frame.child_frame_id,
                         frame.parent_frame_id, pose.x(), pose.y(), pose.yaw());
}

std::string TextOf(const LayerStructure& layer) {
  v1::Layer message;
  wire::EncodeLayer(layer, &message);
  return absl::StrCat("layer ", layer.spec.name, " ", DigestOf(message.ShortDebugString()), "\n");
}

std::string TextOf(const LayerSpec& spec) {
  LayerStructure layer;
  layer.spec = spec;
  return TextOf(layer);
}

std::string TextOf(const MapStructure& structure) {
  std::string text = absl::StrCat("map ", structure.map_name, " in ", structure.frame_id, "\n");
  for (const FrameTransform& frame : structure.frames.transforms()) {
    absl::StrAppend(&text, TextOf(frame));
  }
  for (const auto& [name, layer] : structure.layers) absl::StrAppend(&text, TextOf(layer));
  return text;
}

std::string TextOf(const ValueAliases& aliases) {
  LayerSpec spec;
  spec.aliases = aliases;
  return TextOf(spec);
}

struct ChangeText {
  std::string operator()(const LayerCreated& change) { return "created " + TextOf(change.spec); }
  std::string operator()(const LayerDeleted& change) { return "deleted " + TextOf(change.spec); }
  std::string operator()(const TransformSet& change) { return TextOf(change.transform); }
  std::string operator()(const AliasesSet& change) {
    return absl::StrCat(change.layer, " aliases ", TextOf(change.before), TextOf(change.after));
  }
  std::string operator()(const ObjectPut& change) {
    return absl::StrCat(change.layer, " put ", TextOf(change.before), TextOf(change.after));
  }
  std::string operator()(const ObjectRemoved& change) {
    return absl::StrCat(change.layer, " removed ", TextOf(change.before));
  }
  std::string operator()(const TileWritten& change) {
    return absl::StrCat(change.layer, " tile ", change.index.row, ", ", change.index.col, " ",
                        TextOf(change.before), " ", TextOf(change.after));
  }
  std::string operator()(const ExtentGrown& change) {
    return absl::StrCat(change.layer, " extent ", TextOf(change.extent));
  }
};

absl::Status DescribePast(storage::HistoryReader& reader, Revision revision, std::string* text) {
  HYPERMAP_ASSIGN_OR_RETURN(const auto past, reader.At(revision));
  absl::StrAppend(text, TextOf(*past->structure()));
  for (const auto& [name, layer] : past->structure()->layers) {
    absl::StrAppend(text, name, ":\n");
    if (layer.spec.grid) {
      HYPERMAP_ASSIGN_OR_RETURN(const TileMap tiles, past->Tiles(name, kAllCells));
      absl::StrAppend(text, TextOf(tiles));
      continue;
    }
    HYPERMAP_ASSIGN_OR_RETURN(const std::vector<ObjectPtr> objects, past->Objects(name));
    for (const ObjectPtr& object : objects) absl::StrAppend(text, TextOf(object));
  }
  return absl::OkStatus();
}

std::string TextOf(absl::Time time, bool is_known) {
  return is_known ? absl::FormatTime(time, absl::UTCTimeZone()) : "some time";
}

absl::Status DescribeHistory(storage::StoredMap& map, const DescriptionOptions& options,
                             const std::string& prefix, Description* description) {
  HYPERMAP_ASSIGN_OR_RETURN(const auto reader, map.OpenHistory());
  HYPERMAP_ASSIGN_OR_RETURN(const storage::KeptRevisions kept, reader->Kept());
  (*description)[prefix + "kept"] = absl::StrCat(kept.oldest, " to ", kept.newest);
  for (Revision revision = kept.oldest; revision <= kept.newest; ++revision) {
    std::string& text = (*description)[absl::StrCat(prefix, "revision ", revision)];
    HYPERMAP_RETURN_IF_ERROR(DescribePast(*reader, revision, &text));
  }
  HYPERMAP_ASSIGN_OR_RETURN(const auto commits, reader->Commits(kept.oldest, 1 << 30));
  for (const storage::PastCommit& commit : commits) {
    const storage::RevisionRecord& record = commit.record;
    std::string& text = (*description)[absl::StrCat(prefix, "commit ", record.revision)];
    absl::StrAppend(&text, record.author, " at ", TextOf(record.time, options.has_known_times),
                    ": ", record.num_changes, "\n");
    for (const Change& change : commit.changes) {
      absl::StrAppend(&text, std::visit(ChangeText(), change), "\n");
    }
  }
  return absl::OkStatus();
}

absl::Status DescribeReceipts(storage::StoredMap& map, const DescriptionOptions& options,
                              std::string* text) {
  for (const std::string& request : options.requests) {
    HYPERMAP_ASSIGN_OR_RETURN(const auto receipt, map.FindReceipt(request));
    if (!receipt) continue;
    absl::StrAppend(text, request, " made revision ", receipt->revision, ":");
    for (const ObjectId id : receipt->object_ids) absl::StrAppend(text, " ", id);
    absl::StrAppend(text, "\n");
  }
  return absl::OkStatus();
}

absl::Status DescribeEvidence(storage::StoredMap& map, std::string* text) {
  storage::FusionLog& log = map.fusion_log();
  HYPERMAP_ASSIGN_OR_RETURN(const auto layers, log.FusedLayers());
  for (const auto& [layer, settings] : layers) {
    absl::StrAppend(text, layer, " by ", settings.strategy, " ", DigestOf(settings.parameters), " ",
                    settings.exploration_layer, "\n");
    HYPERMAP_ASSIGN_OR_RETURN(const auto tracks, log.Tracks(layer));
    for (const auto& [track, id] : tracks) absl::StrAppend(text, track, " is ", id, "\n");
    HYPERMAP_ASSIGN_OR_RETURN(const auto entries, log.Read(layer, storage::BeforeAll(), 1 << 20));
    for (const storage::LogEntry& entry : entries) {
      absl::StrAppend(text, entry.key.after.robot, " ", entry.key.after.sequence, " at ",
                      absl::ToUnixNanos(entry.key.after.stamp), " ", entry.key.number, " ",
                      entry.kind, " ", entry.track, " ", DigestOf(entry.body), "\n");
    }
  }
  return absl::OkStatus();
}

// The maps in the trash, each opened in a store of its own. They are there to be brought back.
absl::Status DescribeTrash(const std::string& folder, const DescriptionOptions& options,
                           Description* description) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder + "/trash", error)) {
    const std::string elsewhere = folder + ".trash";
    WriteTree(ReadTree(entry.path()), elsewhere);
    HYPERMAP_ASSIGN_OR_RETURN(const Description parts,
                              DescribeFolder(elsewhere, StoreOptions(), options));
    for (const auto& [part, text] : parts) {
      // The number of the deletion differs if it was tried again.
      (*description)[absl::StrCat("trash/", entry.path().stem().string(), "/", part)] = text;
    }
    std::filesystem::remove_all(elsewhere, error);
  }
  return absl::OkStatus();
}

absl::Status CheckWhole(storage::StoredMap& map, std::string* text) {
  HYPERMAP_ASSIGN_OR_RETURN(const auto check, map.OpenCheck());
  HYPERMAP_ASSIGN_OR_RETURN(const CheckReport report, check->Run(nullptr));
  for (const Finding& finding : report.findings) absl::StrAppend(text, Describe(finding), "\n");
  return absl::OkStatus();
}

}  // namespace

storage::GeoPackageOptions StoreOptions() {
  storage::GeoPackageOptions options;
  options.busy_timeout = absl::Milliseconds(100);
  return options;
}

std::string DescribeSnapshot(const Snapshot& snapshot) {
  std::string text = absl::StrCat("revision ", snapshot.revision, " with the next object ",
                                  snapshot.next_object_id, "\n");
  absl::StrAppend(&text, TextOf(*StructureOf(snapshot)));
  for (const auto& [name, version] : snapshot.layer_versions) {
    absl::StrAppend(&text, name, " is of version ", version, "\n");
  }
  for (const auto& [name, layer] : snapshot.layers) {
    absl::StrAppend(&text, name, ":\n");
    if (const auto* grid = AsGrid(layer.get())) {
      absl::StrAppend(&text, TextOf(grid->extent()), "\n", TextOf(grid->tiles()));
      continue;
    }
    for (const ObjectPtr& object : AsSemantic(layer.get())->Objects()) {
      absl::StrAppend(&text, TextOf(object));
    }
  }
  return text;
}

absl::Status DescribeMap(storage::StoredMap& map, const DescriptionOptions& options,
                         Description* description) {
  const storage::MapHeader& header = map.header();
  const std::string prefix = absl::StrCat("map ", header.name, "/");
  (*description)[prefix + "header"] =
      absl::StrCat(header.frame_id, " of ", TextOf(header.created_at, options.has_known_times),
                   " by ", header.request_id, header.provisional ? ", provisional" : "");
  for (const std::string& note : map.opening_notes()) {
    constexpr absl::string_view kRenewed = "the map is another incarnation now (";
    // The incarnation of a map is told together with its creation, so that nobody knew the one of a
    // map whose creation was interrupted.
    const bool is_empty = absl::EndsWith(note, "is at revision 0");
    if (!absl::StrContains(note, kRenewed) || is_empty) continue;
    absl::StrAppend(&(*description)[prefix + "notes"], note.substr(note.find("): ") + 3), "\n");
  }
  HYPERMAP_ASSIGN_OR_RETURN(const SnapshotPtr snapshot, map.Load());
  (*description)[prefix + "newest"] = DescribeSnapshot(*snapshot);
  HYPERMAP_RETURN_IF_ERROR(DescribeHistory(map, options, prefix, description));
  HYPERMAP_RETURN_IF_ERROR(DescribeReceipts(map, options, &(*description)[prefix + "receipts"]));
  HYPERMAP_RETURN_IF_ERROR(DescribeEvidence(map, &(*description)[prefix + "evidence"]));
  if (!options.has_known_times) return absl::OkStatus();
  HYPERMAP_ASSIGN_OR_RETURN(const auto marks, map.TimeMarks());
  for (const storage::TimeMark& mark : marks) {
    absl::StrAppend(&(*description)[prefix + "marks"], mark.revision, " ",
                    absl::FormatDuration(mark.passed), "\n");
  }
  return absl::OkStatus();
}

absl::StatusOr<Description> DescribeStore(storage::MapStore& store, const std::string& folder,
                                          const DescriptionOptions& options) {
  Description description;
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<std::string> maps, store.List());
  for (const std::string& name : maps) {
    auto map = store.Open(name);
    if (absl::IsNotFound(map.status())) continue;  // its creation was not completed
    HYPERMAP_RETURN_IF_ERROR(map.status());
    absl::StrAppend(&description["maps"], name, "\n");
    HYPERMAP_RETURN_IF_ERROR(DescribeMap(**map, options, &description));
    const std::string prefix = absl::StrCat("map ", name, "/");
    HYPERMAP_RETURN_IF_ERROR(CheckWhole(**map, &description[prefix + "findings"]));
  }
  for (const std::string& request : options.requests) {
    HYPERMAP_ASSIGN_OR_RETURN(const auto deleted, store.FindDeletion(request));
    if (deleted) absl::StrAppend(&description["deletions"], request, " of ", *deleted, "\n");
  }
  HYPERMAP_RETURN_IF_ERROR(DescribeTrash(folder, options, &description));
  return description;
}

absl::StatusOr<Description> DescribeFolder(const std::string& folder,
                                           const storage::GeoPackageOptions& store_options,
                                           const DescriptionOptions& options) {
  HYPERMAP_ASSIGN_OR_RETURN(const auto store, storage::OpenGeoPackageStore(folder, store_options));
  return DescribeStore(*store, folder, options);
}

namespace {

constexpr char kLastLayer[] = "last";

absl::Status AddLayer(storage::StoredMap& map) {
  HYPERMAP_ASSIGN_OR_RETURN(const SnapshotPtr before, map.Load());
  LayerSpec spec;
  spec.name = kLastLayer;
  spec.frame_id = before->frame_id;
  EditBatch batch;
  batch.edits.push_back(CreateLayer{spec});
  HYPERMAP_ASSIGN_OR_RETURN(AppliedBatch applied, Apply(*before, batch));
  auto next = std::make_shared<Snapshot>(*applied.snapshot);
  next->revision = before->revision + 1;
  applied.snapshot = std::move(next);
  storage::Commit commit;
  commit.applied = std::move(applied);
  commit.author = "the next edit";
  commit.time = absl::FromUnixSeconds(4'000'000'000);
  return map.Write({&commit, 1});
}

}  // namespace

absl::Status EditAllMaps(const std::string& folder,
                         const storage::GeoPackageOptions& store_options) {
  for (const bool again : {false, true}) {
    HYPERMAP_ASSIGN_OR_RETURN(const auto store,
                              storage::OpenGeoPackageStore(folder, store_options));
    HYPERMAP_ASSIGN_OR_RETURN(std::vector<std::string> maps, store->List());
    if (maps.empty()) {
      const storage::MapHeader header{"site", "map", absl::UnixEpoch(), "created at the end"};
      HYPERMAP_RETURN_IF_ERROR(store->Create(header).status());
      maps.push_back(header.name);
    }
    for (const std::string& name : maps) {
      HYPERMAP_ASSIGN_OR_RETURN(const auto map, store->Open(name));
      if (!again) {
        HYPERMAP_RETURN_IF_ERROR(AddLayer(*map));
        continue;
      }
      HYPERMAP_ASSIGN_OR_RETURN(const SnapshotPtr snapshot, map->Load());
      if (snapshot->FindLayer(kLastLayer) == nullptr) {
        return absl::DataLossError(absl::StrCat("the next edit of ", name, " is lost"));
      }
    }
  }
  return absl::OkStatus();
}

}  // namespace hypermap::robustness
