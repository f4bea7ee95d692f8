#include "tests/prove/writer.h"

#include <algorithm>
#include <utility>

#include "base/status/status_macros.h"

namespace hypermap::prove {
namespace {

constexpr double kThingSize = 0.6;

SemanticObject ObjectOf(ObjectId id, const Thing& thing) {
  SemanticObject object;
  object.id = id;
  object.label = thing.label;
  object.shape = Polygon::FromBox(thing.box);
  return object;
}

}  // namespace

const std::vector<std::string>& Labels() {
  static const std::vector<std::string> labels = {"chair", "cup", "pallet", "person"};
  return labels;
}

double Uniform(Rng& rng, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(rng);
}

Box RandomArea(Rng& rng, double low, double high) {
  const double width = Uniform(rng, low, high), height = Uniform(rng, low, high);
  const double x = Uniform(rng, 0.0, kSiteSize - width), y = Uniform(rng, 0.0, kSiteSize - height);
  return {{x, y}, {x + width, y + height}};
}

absl::Status MakeSite(client::Client& client, Model& model) {
  if (auto map = client.CreateMap(kMap); !map.ok()) return map.status();
  LayerSpec things;
  things.name = kThings;
  things.kind = LayerKind::kSemantic;
  if (auto made = client.CreateLayer(kMap, things); !made.ok()) return made.status();
  LayerSpec floor;
  floor.name = kFloor;
  floor.kind = LayerKind::kOccupancy;
  floor.grid = FloorGeometry();
  if (auto made = client.CreateLayer(kMap, floor); !made.ok()) return made.status();
  // Writes two opposite corners, so that the extent does not grow later.
  EditBatch corners;
  Written written;
  for (const int at : {0, kSiteCells - 1}) {
    corners.edits.push_back(WriteCells{kFloor, {at, at + 1, at, at + 1}, {1.0}});
    written.cells.push_back({{at, at}, 1.0});
  }
  const auto answer = client.ApplyEdits(kMap, corners);
  HYPERMAP_RETURN_IF_ERROR(answer.status());
  written.revision = answer->revision;
  written.num_edits = static_cast<int>(corners.edits.size());
  model.Add(std::move(written));
  return absl::OkStatus();
}

absl::Status Writer::Run(const std::atomic<bool>& stop) {
  while (edits_ < load_.edits && !stop) {
    HYPERMAP_RETURN_IF_ERROR(Send(RandomBatch()));
  }
  return absl::OkStatus();
}

Writer::Batch Writer::RandomBatch() {
  Batch batch;
  const int size =
      std::min<int>(1 + static_cast<int>(rng_() % load_.max_batch), load_.edits - edits_);
  for (int i = 0; i < size; ++i) AddEdit(batch);
  return batch;
}

void Writer::AddEdit(Batch& batch) {
  const double dice = Uniform(rng_, 0.0, 1.0);
  if (load_.cells && dice < 0.15) return AddCells(batch);
  const ObjectId id = mine_.empty() ? 0 : mine_[rng_() % mine_.size()];
  if (id == 0 || batch.used.count(id) > 0) return AddPut(0, batch);
  if (dice < 0.5 || mine_.size() >= load_.max_things) {
    if (dice < 0.25 && mine_.size() > load_.max_things / 2) {
      batch.used.insert(id);
      batch.edits.edits.push_back(DeleteObject{kThings, id});
      batch.written.things.push_back({id, std::nullopt});
      return;
    }
    return AddPut(id, batch);
  }
  AddPut(0, batch);
}

void Writer::AddPut(ObjectId id, Batch& batch) {
  if (id != 0) batch.used.insert(id);
  const Thing thing{Labels()[rng_() % Labels().size()], RandomArea(rng_, 0.1, kThingSize)};
  batch.edits.edits.push_back(PutObject{kThings, ObjectOf(id, thing), ""});
  batch.written.things.push_back({id, thing});
}

void Writer::AddCells(Batch& batch) {
  const int row = static_cast<int>(rng_() % (kSiteCells - 8));
  const int col = static_cast<int>(rng_() % (kSiteCells - 8));
  WriteCells write{kFloor, {row, row + 1 + static_cast<int>(rng_() % 8), col, col + 4}, {}};
  std::vector<std::pair<CellIndex, std::optional<double>>> cells;
  for (int r = write.box.row_begin; r < write.box.row_end; ++r) {
    for (int c = write.box.col_begin; c < write.box.col_end; ++c) {
      const int level = static_cast<int>(rng_() % 6);
      const std::optional<double> value =
          level == 5 ? std::nullopt : std::optional<double>(level / 4.0);
      write.values.push_back(value);
      cells.push_back({{r, c}, value});
    }
  }
  // The model has each cell of a batch only once.
  for (const auto& [cell, value] : cells) {
    if (batch.cells.count(cell) > 0) return AddPut(0, batch);
  }
  for (const auto& entry : cells) batch.cells.insert(entry.first);
  batch.written.cells.insert(batch.written.cells.end(), cells.begin(), cells.end());
  batch.edits.edits.push_back(std::move(write));
}

absl::Status Writer::Send(Batch batch) {
  const absl::StatusOr<client::EditAnswer> answer = client_.ApplyEdits(kMap, batch.edits);
  HYPERMAP_RETURN_IF_ERROR(answer.status());
  std::vector<ObjectId> put;
  for (const ObjectId id : answer->object_ids) {
    if (id != 0) put.push_back(id);
  }
  size_t next = 0;
  for (auto& [id, thing] : batch.written.things) {
    if (!thing) {
      mine_.erase(std::find(mine_.begin(), mine_.end(), id));
      continue;
    }
    if (next == put.size()) return absl::InternalError("an object was put without an id");
    if (id == 0) mine_.push_back(put[next]);
    id = put[next++];
  }
  batch.written.revision = answer->revision;
  batch.written.num_edits = static_cast<int>(batch.edits.edits.size());
  edits_ += static_cast<int>(batch.edits.edits.size());
  ++batches_;
  model_.Add(std::move(batch.written));
  return absl::OkStatus();
}

}  // namespace hypermap::prove
