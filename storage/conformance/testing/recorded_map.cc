#include "storage/conformance/testing/recorded_map.h"

#include <string>
#include <utility>
#include <variant>

#include "gtest/gtest.h"
#include "map/edits/difference.h"
#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"

namespace hypermap::storage {

using ::hypermap::testing::RandomCells;
using ::hypermap::testing::RandomObject;
using ::hypermap::testing::RandomTransform;
using ::hypermap::testing::Rng;
using ::hypermap::testing::Uniform;
using ::hypermap::testing::UniformInt;

bool SameTile(const TilePtr& a, const TilePtr& b) {
  if (a == nullptr || b == nullptr) return a == b;
  return a->Holds(b->codes());
}

bool SameObject(const ObjectPtr& a, const ObjectPtr& b) {
  if (a == nullptr || b == nullptr) return a == b;
  return *a == *b && a->version == b->version;
}

namespace {

// Compares two changes of one kind.
struct Same {
  bool operator()(const LayerCreated& a, const LayerCreated& b) { return a.spec == b.spec; }
  bool operator()(const LayerDeleted& a, const LayerDeleted& b) { return a.spec == b.spec; }
  bool operator()(const TransformSet& a, const TransformSet& b) {
    return a.transform == b.transform;
  }
  bool operator()(const AliasesSet& a, const AliasesSet& b) {
    return a.layer == b.layer && a.before == b.before && a.after == b.after;
  }
  bool operator()(const ObjectPut& a, const ObjectPut& b) {
    return a.layer == b.layer && SameObject(a.before, b.before) && SameObject(a.after, b.after);
  }
  bool operator()(const ObjectRemoved& a, const ObjectRemoved& b) {
    return a.layer == b.layer && SameObject(a.before, b.before);
  }
  bool operator()(const TileWritten& a, const TileWritten& b) {
    return a.layer == b.layer && a.index == b.index && SameTile(a.before, b.before) &&
           SameTile(a.after, b.after);
  }
  bool operator()(const ExtentGrown& a, const ExtentGrown& b) {
    return a.layer == b.layer && a.extent == b.extent;
  }
  template <typename A, typename B>
  bool operator()(const A&, const B&) {
    return false;
  }
};

std::vector<Edit> RandomObjectEdits(Rng& rng, const Snapshot& now, const std::string& name) {
  std::vector<Edit> edits;
  const auto& layer = dynamic_cast<const SemanticLayer&>(*now.FindLayer(name));
  for (int i = UniformInt(rng, 0, 4); i > 0; --i) {
    SemanticObject object =
        RandomObject(rng, {Uniform(rng, -9, 9), Uniform(rng, -9, 9)}, Uniform(rng, 0.1, 2));
    if (UniformInt(rng, 0, 50) == 0) object.shape = PlanarTransform(3e6, -5e6, 0) * object.shape;
    PutObject put{name, object, ""};
    if (UniformInt(rng, 0, 2) > 0) put.object.id = UniformInt(rng, 1, 20);
    put.revive = true;
    if (put.object.id >= now.next_object_id) put.object.id = 0;
    if (UniformInt(rng, 0, 3) == 0) put.time_to_live = absl::Milliseconds(UniformInt(rng, 1, 9999));
    edits.push_back(put);
  }
  const std::vector<ObjectPtr> objects = layer.Objects();
  if (!objects.empty() && UniformInt(rng, 0, 2) == 0) {
    const ObjectId id = objects[UniformInt(rng, 0, static_cast<int>(objects.size()) - 1)]->id;
    edits.push_back(DeleteObject{name, id});
  }
  if (UniformInt(rng, 0, 9) == 0) {
    const std::string word = UniformInt(rng, 0, 1) == 0 ? "möbel" : "thing";
    edits.push_back(SetAliases{name, {{word, {"chair", std::to_string(UniformInt(rng, 0, 9))}}}});
  }
  return edits;
}

std::vector<Edit> RandomCellEdits(Rng& rng, const LayerSpec& spec) {
  if (UniformInt(rng, 0, 2) > 0) return {};
  const int32_t row = UniformInt(rng, -300, 300);
  const int32_t col = UniformInt(rng, -300, 300);
  const CellBox box{row, row + UniformInt(rng, 1, 40), col, col + UniformInt(rng, 1, 150)};
  return {WriteCells{spec.name, box, RandomCells(rng, spec.kind, box)}};
}

}  // namespace

bool SameChange(const Change& a, const Change& b) { return std::visit(Same(), a, b); }

void RecordedMap::Reopen(MapStore& store) {
  Close();
  Open(store);
}

void RecordedMap::Open(MapStore& store) {
  auto opened = store.Open(map_.snapshot->map_name);
  ASSERT_TRUE(opened.ok()) << opened.status();
  map_.stored = *std::move(opened);
  auto loaded = map_.stored->Load();
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  ExpectSame(**loaded, *map_.snapshot);
  EXPECT_EQ((*loaded)->layer_versions, map_.snapshot->layer_versions);
}

void RecordedMap::Write(const std::vector<EditBatch>& batches) {
  std::vector<Commit> commits;
  for (const EditBatch& batch : batches) {
    const Snapshot& before = commits.empty() ? now() : *commits.back().applied.snapshot;
    commits.push_back(MakeCommit(before, batch));
  }
  WriteCommits(commits);
}

void RecordedMap::WriteCommits(const std::vector<Commit>& commits) {
  for (const Commit& commit : commits) {
    map_.snapshot = commit.applied.snapshot;
    snapshots_.push_back(map_.snapshot);
    commits_.push_back(commit);
  }
  const absl::Status status = map_.stored->Write(commits);
  ASSERT_TRUE(status.ok()) << status;
}

std::vector<Change> RecordedMap::WriteSquashed(const std::vector<EditBatch>& batches) {
  const SnapshotPtr before = map_.snapshot;
  Commit commit;
  for (const EditBatch& batch : batches) {
    commit = MakeCommit(*map_.snapshot, batch);
    map_.snapshot = commit.applied.snapshot;
    snapshots_.push_back(map_.snapshot);
    commits_.push_back(commit);
  }
  commit.applied.changes = Difference(*before, *map_.snapshot);
  commit.applied.object_ids.clear();
  commits_.back() = commit;
  const absl::Status status = map_.stored->Write({commit});
  EXPECT_TRUE(status.ok()) << status;
  return commit.applied.changes;
}

void RecordedMap::Compact(Revision oldest, int max_rows, absl::Time receipts_before) {
  absl::StatusOr<bool> more = true;
  for (int i = 0; i < 10000 && more.ok() && *more; ++i) {
    more = map_.stored->Compact(oldest, receipts_before, max_rows);
  }
  ASSERT_TRUE(more.ok()) << more.status();
  EXPECT_FALSE(*more);
}

std::unique_ptr<HistoryReader> RecordedMap::Reader() const {
  auto reader = map_.stored->OpenHistory();
  EXPECT_TRUE(reader.ok()) << reader.status();
  return reader.ok() ? *std::move(reader) : nullptr;
}

EditBatch RandomBatch(Rng& rng, const Snapshot& now) {
  EditBatch batch;
  batch.time = absl::FromUnixSeconds(1'700'000'000 + now.revision);
  std::string deleted;
  for (const auto& [name, layer] : now.layers) {
    if (deleted.empty() && UniformInt(rng, 0, 40) == 0) {
      deleted = name;
      batch.edits.push_back(DeleteLayer{name});
      if (UniformInt(rng, 0, 1) == 0) continue;
      LayerSpec again = layer->spec();
      again.unit = std::to_string(now.revision);
      batch.edits.push_back(CreateLayer{again});
      continue;
    }
    const std::vector<Edit> edits = layer->spec().grid ? RandomCellEdits(rng, layer->spec())
                                                       : RandomObjectEdits(rng, now, name);
    batch.edits.insert(batch.edits.end(), edits.begin(), edits.end());
  }
  for (const LayerKind kind :
       {LayerKind::kOccupancy, LayerKind::kExploration, LayerKind::kScalar, LayerKind::kSemantic}) {
    const std::string name(LayerKindName(kind));
    if (now.FindLayer(name) != nullptr || UniformInt(rng, 0, 3) > 0) continue;
    batch.edits.push_back(CreateLayer{kind == LayerKind::kSemantic
                                          ? SemanticSpec(name)
                                          : GridSpec(name, kind, RandomTransform(rng, 5), 0.05)});
  }
  if (batch.edits.empty() || UniformInt(rng, 0, 4) == 0) {
    const std::string child = UniformInt(rng, 0, 1) == 0 ? "dock" : "robot/base";
    batch.edits.push_back(SetTransform{{"map", child, RandomTransform(rng, 9)}});
  }
  return batch;
}

}  // namespace hypermap::storage
