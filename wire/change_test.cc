#include "wire/change.h"

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "map/layers/layer_registry.h"
#include "wire/answer.h"
#include "wire/object.h"

namespace hypermap::wire {
namespace {

const PlanarTransform kCallerFromLayer(10.0, 20.0, 1.25);

ObjectPtr Chair(Revision version) {
  auto object = std::make_shared<SemanticObject>();
  object->id = 4;
  object->label = "chair";
  object->shape = Polygon::FromBox({{0, 0}, {1, 2}});
  object->version = version;
  return object;
}

v1::Change Encoded(const MapChange& change) {
  v1::Change message;
  EncodeChange(change, &message);
  return message;
}

TEST(ChangeOnTheWire, EveryKindComesBack) {
  for (int i = 0; i <= static_cast<int>(ChangeKind::kTransform); ++i) {
    const auto kind = static_cast<ChangeKind>(i);
    const auto decoded = DecodeChangeKind("kind", EncodeChangeKind(kind));
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(*decoded, kind);
  }
  EXPECT_EQ(DecodeChangeKind("kind", v1::CHANGE_KIND_UNSPECIFIED).status(),
            absl::InvalidArgumentError("kind is not a known kind: 0"));
}

TEST(ChangeOnTheWire, ObjectsAreInTheCallersFrame) {
  const v1::Change message = Encoded({.kind = ChangeKind::kPut,
                                      .layer = "things",
                                      .caller_from_layer = kCallerFromLayer,
                                      .object_id = 4,
                                      .object = Chair(9),
                                      .object_before = Chair(7)});
  EXPECT_EQ(message.kind(), v1::CHANGE_KIND_PUT);
  EXPECT_EQ(message.layer(), "things");
  EXPECT_EQ(message.object_id(), 4);
  const auto now = DecodeObject("object", message.object());
  ASSERT_TRUE(now.ok()) << now.status();
  EXPECT_EQ(now->shape, kCallerFromLayer * Chair(9)->shape);
  EXPECT_EQ(now->version, 9);
  EXPECT_EQ(message.object_before().version(), 7);
  EXPECT_FALSE(message.has_cells());
  EXPECT_FALSE(message.has_layer_now());
  EXPECT_FALSE(message.has_transform());
}

TEST(ChangeOnTheWire, CellsAreOfAGridInTheCallersFrame) {
  const GridGeometry grid{PlanarTransform(1, 2, 0.5), 0.05};
  const std::vector<CellRun> now = {{-1, 3, 5, 0.25}, {2, 0, 1, std::nullopt}};
  const std::vector<CellRun> before = {{-1, 3, 5, std::nullopt}, {2, 0, 1, 1.0}};
  const v1::Change message = Encoded({.kind = ChangeKind::kCells,
                                      .layer = "floor",
                                      .caller_from_layer = kCallerFromLayer,
                                      .grid = grid,
                                      .cells = now,
                                      .cells_before = before});
  EXPECT_EQ(message.kind(), v1::CHANGE_KIND_CELLS);
  const auto cells = DecodeCellRuns("cells", message.cells());
  ASSERT_TRUE(cells.ok()) << cells.status();
  EXPECT_EQ(cells->grid, GeometryInFrame(grid, kCallerFromLayer));
  EXPECT_EQ(cells->runs, now);
  EXPECT_EQ(DecodeCellRuns("cells_before", message.cells_before())->runs, before);
}

TEST(ChangeOnTheWire, LayersTellTheirVersionAndTransformsTheirPose) {
  LayerSpec spec;
  spec.name = "things";
  spec.kind = LayerKind::kSemantic;
  spec.frame_id = "map";
  const v1::Change layer = Encoded({.kind = ChangeKind::kLayerCreated,
                                    .layer = "things",
                                    .layer_now = LayerStructure{spec, {}, 3}});
  EXPECT_EQ(layer.kind(), v1::CHANGE_KIND_LAYER_CREATED);
  EXPECT_EQ(layer.layer_now().name(), "things");
  EXPECT_EQ(layer.layer_now().version(), 3);

  const v1::Change transform =
      Encoded({.kind = ChangeKind::kTransform,
               .transform = FrameTransform{"map", "dock", kCallerFromLayer}});
  EXPECT_EQ(transform.transform().child_frame_id(), "dock");
  EXPECT_EQ(transform.transform().parent_from_child().x(), 10.0);
}

TEST(ChangeOnTheWire, ChangesOfMessagesAreAppended) {
  v1::ListChangesResponse message;
  const MapChange removal{.kind = ChangeKind::kRemove, .layer = "things", .object_id = 4};
  EncodeChange(removal, message.add_changes());
  std::vector<MapChange> changes;
  ASSERT_TRUE(AppendChanges(message.changes(), changes).ok());
  ASSERT_TRUE(AppendChanges(message.changes(), changes).ok());
  ASSERT_EQ(changes.size(), 2u);
  EXPECT_EQ(changes[1].object_id, 4);
  message.add_changes();  // It has no kind.
  EXPECT_TRUE(absl::IsInvalidArgument(AppendChanges(message.changes(), changes)));
}

}  // namespace
}  // namespace hypermap::wire
