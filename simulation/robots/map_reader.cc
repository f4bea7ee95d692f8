#include "simulation/robots/map_reader.h"

#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_registry.h"

namespace hypermap::robots {
namespace {

// Returns an area that contains all positions of a map.
Polygon Everywhere() {
  constexpr double kFar_m = 5e8;
  return Polygon::FromBox({{-kFar_m, -kFar_m}, {kFar_m, kFar_m}});
}

// Builds a grid from the parts of an answer. The first part gives the grid's geometry.
class GridBuilder {
 public:
  explicit GridBuilder(LayerSpec spec) : spec_(std::move(spec)) {}

  absl::Status Add(const client::LayerPart& part) {
    if (part.status != AnswerStatus::kValue || !part.grid) {
      return absl::FailedPreconditionError(
          absl::StrCat("layer \"", spec_.name, "\" has ", "no transform to the frame of the map"));
    }
    if (!writer_) {
      spec_.grid = part.grid;
      writer_.emplace(std::make_shared<GridLayer>(spec_, MakeCellDomain(spec_)));
    }
    for (const CellRun& run : part.runs) {
      const std::vector<std::optional<double>> values(
          static_cast<size_t>(run.col_end - run.col_begin), run.value);
      const CellBox box{run.row, run.row + 1, run.col_begin, run.col_end};
      HYPERMAP_RETURN_IF_ERROR(writer_->Write(box, values));
    }
    return absl::OkStatus();
  }

  absl::StatusOr<std::shared_ptr<const GridLayer>> Finish() {
    if (!writer_) {
      return absl::FailedPreconditionError(absl::StrCat("layer \"", spec_.name, "\" is empty"));
    }
    return std::move(*writer_).Finish().layer;
  }

 private:
  LayerSpec spec_;
  std::optional<GridWriter> writer_;
};

}  // namespace

absl::StatusOr<std::shared_ptr<const GridLayer>> ReadGrid(client::Client& client,
                                                          const std::string& map,
                                                          const std::string& layer,
                                                          LayerKind kind) {
  HYPERMAP_ASSIGN_OR_RETURN(const client::LayerEntry entry, client.GetLayer(map, layer));
  if (entry.spec.kind != kind) {
    return absl::FailedPreconditionError(absl::StrCat("layer \"", layer, "\" is of the kind ",
                                                      LayerKindName(entry.spec.kind), ", not ",
                                                      LayerKindName(kind)));
  }
  GridBuilder builder(entry.spec);
  client::AnswerReader reader = client.QueryArea(map, Everywhere(), {.layers = {layer}});
  while (const std::optional<client::LayerPart> part = reader.Next()) {
    HYPERMAP_RETURN_IF_ERROR(builder.Add(*part));
  }
  HYPERMAP_RETURN_IF_ERROR(reader.status());
  return builder.Finish();
}

absl::StatusOr<std::vector<SemanticObject>> ReadObjects(client::Client& client,
                                                        const std::string& map,
                                                        const std::vector<std::string>& layers) {
  std::vector<SemanticObject> objects;
  if (layers.empty()) return objects;
  client::AnswerReader reader = client.QueryArea(map, Everywhere(), {.layers = layers});
  while (std::optional<client::LayerPart> part = reader.Next()) {
    if (part->kind != LayerKind::kSemantic) {
      return absl::FailedPreconditionError(
          absl::StrCat("layer \"", part->layer, "\" holds no objects"));
    }
    for (SemanticObject& object : part->objects) objects.push_back(std::move(object));
  }
  HYPERMAP_RETURN_IF_ERROR(reader.status());
  return objects;
}

absl::StatusOr<bool> IsFused(client::Client& client, const std::string& map,
                             const std::string& layer) {
  // No object has id 0. A fused layer answers NOT_FOUND; another layer has no evidence to explain
  // and answers FAILED_PRECONDITION.
  const absl::Status status = client.ExplainObject(map, layer, 0).status();
  if (absl::IsFailedPrecondition(status)) return false;
  if (status.ok() || absl::IsNotFound(status)) return true;
  return status;
}

}  // namespace hypermap::robots
