// Batches of edits change a map as they change a plain list: after each batch, the objects and the
// cells in an area, at a point and with a label are those that a look at every one of them finds.
// A refused batch changes nothing, snapshots of earlier revisions stay as they were, and the
// difference of two snapshots turns the first into the second.
//
// The bytes of an input are choices: which edit, which object, which place.
#include <fuzzer/FuzzedDataProvider.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "map/edits/apply.h"
#include "map/edits/difference.h"
#include "map/query/query.h"
#include "tests/fuzz/require.h"
#include "tests/prove/model.h"

namespace {

using namespace hypermap;  // NOLINT(google-build-using-namespace)
using prove::kFloor;
using prove::kThings;
using prove::Selection;
using prove::State;
using prove::Thing;
using prove::Written;

constexpr const char* kLabels[] = {"chair", "desk", "shelf"};
constexpr int kMaxBatches = 40;
constexpr int kMaxEdits = 8;

// Quarters of a metre, so that boxes often touch each other and the centres of cells.
double AnyCoordinate(FuzzedDataProvider& choices) {
  return 0.25 * choices.ConsumeIntegralInRange(-20, 20);
}

Box AnyBox(FuzzedDataProvider& choices) {
  const Point low{AnyCoordinate(choices), AnyCoordinate(choices)};
  const auto side = [&] { return 0.25 * choices.ConsumeIntegralInRange(1, 12); };
  return {low, {low.x + side(), low.y + side()}};
}

// The map under test beside the list of all batches that it has accepted.
class EditedMap {
 public:
  EditedMap() {
    LayerSpec things;
    things.name = kThings;
    LayerSpec floor;
    floor.name = kFloor;
    floor.kind = LayerKind::kScalar;
    floor.grid = prove::FloorGeometry();
    Submit({{CreateLayer{things}, CreateLayer{floor}}}, {});
  }

  void ApplyAnyBatch(FuzzedDataProvider& choices) {
    EditBatch batch;
    Written written;
    std::map<ObjectId, std::optional<Thing>> things;
    std::map<CellIndex, std::optional<double>> cells;
    ObjectId next_id = now().next_object_id;
    for (int n = choices.ConsumeIntegralInRange(1, kMaxEdits); n > 0; --n) {
      AddAnyEdit(choices, next_id, batch, things, cells);
    }
    if (choices.ConsumeIntegralInRange(0, 7) == 0) {
      batch.edits.push_back(DeleteLayer{"nowhere"});
      const auto refused = Apply(now(), batch);
      REQUIRE(absl::IsNotFound(refused.status()));
      return;
    }
    written.things.assign(things.begin(), things.end());
    written.cells.assign(cells.begin(), cells.end());
    Submit(batch, std::move(written));
  }

  void CheckQueries(FuzzedDataProvider& choices) const {
    CheckAt(*snapshots_.back(), AnyBox(choices), choices.PickValueInArray(kLabels));
    CheckNearest({AnyCoordinate(choices), AnyCoordinate(choices)},
                 choices.PickValueInArray(kLabels), choices.ConsumeIntegralInRange(1, 5));
  }

  // Compares the whole of every kept snapshot.
  void CheckPast() {
    const Box everywhere{{-100, -100}, {100, 100}};
    for (const SnapshotPtr& snapshot : snapshots_) CheckAt(*snapshot, everywhere, kLabels[0]);
    const std::vector<Change> changes = Difference(*snapshots_.front(), *snapshots_.back());
    REQUIRE(Difference(*snapshots_.back(), *snapshots_.back()).empty());
    CheckDifference(changes);
  }

 private:
  const Snapshot& now() const { return *snapshots_.back(); }

  void Submit(const EditBatch& batch, Written written) {
    const auto applied = Apply(snapshots_.empty() ? Snapshot() : now(), batch);
    REQUIRE(applied.ok());
    snapshots_.push_back(applied->snapshot);
    written.revision = applied->snapshot->revision;
    model_.Add(std::move(written));
  }

  void AddAnyEdit(FuzzedDataProvider& choices, ObjectId& next_id, EditBatch& batch,
                  std::map<ObjectId, std::optional<Thing>>& things,
                  std::map<CellIndex, std::optional<double>>& cells) const {
    const auto existing = [&](ObjectId id) {
      const auto it = things.find(id);
      if (it != things.end()) return it->second.has_value();
      return id < now().next_object_id && now().FindSemantic(kThings)->Find(id) != nullptr;
    };
    switch (choices.ConsumeIntegralInRange(0, 3)) {
      case 0:
      case 1: {
        const Thing thing{choices.PickValueInArray(kLabels), AnyBox(choices)};
        ObjectId id = choices.ConsumeIntegralInRange<ObjectId>(0, next_id - 1);
        PutObject put{kThings, {.label = thing.label, .shape = Polygon::FromBox(thing.box)}};
        if (id > 0) {
          put.object.id = id;
          put.revive = !existing(id);
        } else {
          id = next_id++;
        }
        batch.edits.push_back(std::move(put));
        things[id] = thing;
        return;
      }
      case 2: {
        const ObjectId id = choices.ConsumeIntegralInRange<ObjectId>(0, next_id - 1);
        if (!existing(id)) return AddAnyCells(choices, batch, cells);
        batch.edits.push_back(DeleteObject{kThings, id});
        things[id] = std::nullopt;
        return;
      }
      default:
        return AddAnyCells(choices, batch, cells);
    }
  }

  static void AddAnyCells(FuzzedDataProvider& choices, EditBatch& batch,
                          std::map<CellIndex, std::optional<double>>& cells) {
    const int row = choices.ConsumeIntegralInRange(-70, 70);
    const int col = choices.ConsumeIntegralInRange(-70, 70);
    const CellBox box{row, row + choices.ConsumeIntegralInRange(1, 6), col,
                      col + choices.ConsumeIntegralInRange(1, 6)};
    WriteCells write{kFloor, box, {}};
    for (int r = box.row_begin; r < box.row_end; ++r) {
      for (int c = box.col_begin; c < box.col_end; ++c) {
        std::optional<double> value;
        if (choices.ConsumeIntegralInRange(0, 4) > 0) value = choices.ConsumeIntegralInRange(0, 3);
        write.values.push_back(value);
        cells[{r, c}] = value;
      }
    }
    batch.edits.push_back(std::move(write));
  }

  // What ContentIn answers for the area.
  static State ContentOf(const SnapshotPtr& snapshot, const Box& area) {
    State state;
    const auto reader = ContentIn(snapshot, {}, Polygon::FromBox(area));
    REQUIRE(reader.ok());
    while (!(*reader)->done()) {
      const LayerAnswerPart part = (*reader)->Next(5);
      for (const ObjectPtr& object : part.part.objects) {
        const bool is_new =
            state.things.emplace(object->id, Thing{object->label, object->shape.bounds()}).second;
        REQUIRE(is_new);
      }
      for (const CellRun& run : part.part.runs) {
        for (int32_t col = run.col_begin; col < run.col_end; ++col) {
          if (run.value) state.cells.emplace(CellIndex{run.row, col}, *run.value);
        }
      }
    }
    return state;
  }

  void CheckAt(const Snapshot& snapshot, const Box& area, const std::string& label) const {
    const auto shared = std::make_shared<Snapshot>(snapshot);
    REQUIRE(ContentOf(shared, area) == model_.At(snapshot.revision, {area, {}}));
    std::map<ObjectId, Thing> found;
    const Polygon polygon = Polygon::FromBox(area);
    const auto cursor = snapshot.FindSemantic(kThings)->Find(ValueLabel{label}, &polygon);
    while (!cursor->done()) {
      for (const ObjectPtr& object : cursor->Next(3).objects) {
        found.emplace(object->id, Thing{object->label, object->shape.bounds()});
      }
    }
    REQUIRE(found == model_.At(snapshot.revision, {area, {label}}).things);
    CheckPoint(snapshot, area.min);
  }

  void CheckPoint(const Snapshot& snapshot, const Point& p) const {
    const State state = model_.At(snapshot.revision, {Box{p, p}, {}});
    const PointContent content = snapshot.FindSemantic(kThings)->ContentAt(p);
    REQUIRE(content.objects.size() == state.things.size());
    for (const ObjectPtr& object : content.objects) REQUIRE(state.things.count(object->id) == 1);
    if (const auto cell = prove::FloorGeometry().CellAt(p)) {
      const State all = model_.At(snapshot.revision, {});
      const auto it = all.cells.find(*cell);
      const PointContent at = snapshot.FindGrid(kFloor)->ContentAt(p);
      REQUIRE(at.value == (it == all.cells.end() ? std::nullopt : std::optional(it->second)));
    }
  }

  void CheckNearest(const Point& p, const std::string& label, int k) const {
    const auto distance = [&](const Box& box) {
      const double dx = std::max({box.min.x - p.x, 0.0, p.x - box.max.x});
      const double dy = std::max({box.min.y - p.y, 0.0, p.y - box.max.y});
      return std::hypot(dx, dy);
    };
    std::vector<double> all;
    for (const auto& [id, thing] : model_.At(now().revision, {std::nullopt, {label}}).things) {
      all.push_back(distance(thing.box));
    }
    std::sort(all.begin(), all.end());
    const auto nearest = now().FindSemantic(kThings)->Nearest(p, ValueLabel{label}, k);
    REQUIRE(nearest && nearest->size() == std::min(all.size(), static_cast<size_t>(k)));
    for (size_t i = 0; i < nearest->size(); ++i) {
      REQUIRE(std::abs((*nearest)[i].distance_m - all[i]) < 1e-9);
    }
  }

  // Carries the changes out on the first snapshot's objects, and compares with the newest.
  void CheckDifference(const std::vector<Change>& changes) const {
    std::map<ObjectId, ObjectPtr> objects;
    for (const ObjectPtr& object : snapshots_.front()->FindSemantic(kThings)->Objects()) {
      objects[object->id] = object;
    }
    for (const Change& change : changes) {
      if (const auto* put = std::get_if<ObjectPut>(&change)) objects[put->after->id] = put->after;
      if (const auto* removed = std::get_if<ObjectRemoved>(&change)) {
        objects.erase(removed->before->id);
      }
    }
    std::vector<ObjectPtr> expected;
    for (const auto& [id, object] : objects) expected.push_back(object);
    const std::vector<ObjectPtr> actual = now().FindSemantic(kThings)->Objects();
    REQUIRE(actual.size() == expected.size());
    for (size_t i = 0; i < actual.size(); ++i) REQUIRE(*actual[i] == *expected[i]);
  }

  std::vector<SnapshotPtr> snapshots_;
  prove::Model model_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  FuzzedDataProvider choices(data, size);
  EditedMap map;
  for (int n = 0; n < kMaxBatches && choices.remaining_bytes() > 0; ++n) {
    map.ApplyAnyBatch(choices);
    map.CheckQueries(choices);
  }
  map.CheckPast();
  return 0;
}
