#include "wire/answer.h"

#include <gtest/gtest.h>

#include <memory>

#include "tests/support/random_map.h"
#include "wire/geometry.h"
#include "wire/layer.h"
#include "wire/object.h"

namespace hypermap::wire {
namespace {

LayerSpec GridSpec() {
  LayerSpec spec;
  spec.name = "grid";
  spec.kind = LayerKind::kScalar;
  spec.frame_id = "map";
  spec.grid = GridGeometry{PlanarTransform(1.0, 2.0, 0.5), 0.25};
  return spec;
}

PutObject CupAt(double x) {
  PutObject put{"things", {}, ""};
  put.object.label = "cup";
  put.object.shape = Polygon::FromBox({{x, 0}, {x + 0.1, 0.1}});
  return put;
}

// A grid of 2 x 3 cells, whose middle column is unknown, and five cups.
Snapshot Site() {
  EditBatch batch;
  batch.edits.push_back(CreateLayer{GridSpec()});
  batch.edits.push_back(
      WriteCells{"grid", {0, 2, 0, 3}, {1.0, std::nullopt, 2.0, 1.0, std::nullopt, 2.0}});
  LayerSpec things;
  things.name = "things";
  things.frame_id = "map";
  batch.edits.push_back(CreateLayer{things});
  for (int i = 0; i < 5; ++i) batch.edits.push_back(CupAt(i));
  return hypermap::testing::MakeSnapshot("site", batch);
}

// Returns the message as its receiver parses it.
template <typename Message>
Message Received(const Message& sent) {
  Message received;
  EXPECT_TRUE(received.ParseFromString(sent.SerializeAsString()));
  return received;
}

LayerAnswerPart PartWithObjects(const Snapshot& snapshot, int num_objects) {
  LayerAnswerPart part;
  part.layer = *snapshot.GetLayer("things");
  for (int i = 0; i < num_objects; ++i) {
    auto object = std::make_shared<SemanticObject>(CupAt(i).object);
    object->id = i + 1;
    part.part.objects.push_back(std::move(object));
  }
  return part;
}

void Encode(const LayerPointContent& content, v1::LayerContent* message) {
  EncodeLayerContent(*content.layer, content.caller_from_layer, content.content, message);
}

TEST(AnswerStatusOnTheWire, EveryOneComesBack) {
  for (const AnswerStatus status :
       {AnswerStatus::kValue, AnswerStatus::kUnknown, AnswerStatus::kOutside,
        AnswerStatus::kNoTransform, AnswerStatus::kUnsupportedValue}) {
    EXPECT_EQ(*DecodeAnswerStatus("status", EncodeAnswerStatus(status)), status);
  }
  EXPECT_FALSE(DecodeAnswerStatus("status", v1::ANSWER_STATUS_UNSPECIFIED).ok());
}

TEST(CellRunsOnTheWire, ComeBackEqual) {
  const GridGeometry geometry{PlanarTransform(1, -2, 3), 0.05};
  const std::vector<CellRun> runs = {{-5, -9, -2, 0.125}, {0, 0, 1, std::nullopt}, {7, 1, 9, 0.0}};
  v1::CellRuns sent;
  EncodeCellRuns(geometry, runs, &sent);
  v1::CellRuns received;
  ASSERT_TRUE(received.ParseFromString(sent.SerializeAsString()));
  const auto decoded = DecodeCellRuns("cells", received);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->grid, geometry);
  EXPECT_EQ(decoded->runs, runs);
}

TEST(CellRunsOnTheWire, OfDifferentLengthsAreRefused) {
  v1::CellRuns message;
  message.add_rows(1);
  EXPECT_EQ(DecodeCellRuns("cells", message).status(),
            absl::InvalidArgumentError("cells has columns of different lengths"));
}

TEST(LayerContentOnTheWire, SaysWhatTheLayersSay) {
  const Snapshot snapshot = Site();
  const auto contents = ContentAt(snapshot, {}, {1.0, 2.0});
  ASSERT_TRUE(contents.ok()) << contents.status();
  ASSERT_EQ(contents->size(), 2u);
  v1::LayerContent grid;
  Encode((*contents)[0], &grid);
  EXPECT_EQ(grid.layer(), "grid");
  EXPECT_EQ(grid.kind(), v1::LAYER_KIND_SCALAR);
  EXPECT_EQ(grid.status(), v1::ANSWER_STATUS_VALUE);
  EXPECT_EQ(grid.value(), 1.0);
  v1::LayerContent things;
  Encode((*contents)[1], &things);
  EXPECT_EQ(things.kind(), v1::LAYER_KIND_SEMANTIC);
  EXPECT_EQ(things.status(), v1::ANSWER_STATUS_VALUE);
  EXPECT_FALSE(things.has_value());
  EXPECT_EQ(things.objects_size(), 0);
}

TEST(LayerContentOnTheWire, HoldsTheObjectsAtThePoint) {
  const Snapshot snapshot = Site();
  const auto contents = ContentAt(snapshot, {{"things"}, ""}, {2.05, 0.05});
  ASSERT_TRUE(contents.ok()) << contents.status();
  v1::LayerContent things;
  Encode((*contents)[0], &things);
  things = Received(things);
  ASSERT_EQ(things.objects_size(), 1);
  EXPECT_EQ(things.objects(0).label(), "cup");
  EXPECT_EQ(things.objects(0).shape().polygon().outer().xs(0), 2);
}

TEST(PointAnswerOnTheWire, ComesBack) {
  const Snapshot snapshot = Site();
  const auto contents = ContentAt(snapshot, {}, {2.05, 0.05}, /*tolerance_m=*/2.0);
  ASSERT_TRUE(contents.ok()) << contents.status();
  v1::QueryPointResponse message;
  message.set_map("site");
  message.set_revision(3);
  message.set_incarnation(77);
  message.set_frame_id("map");
  EncodePoint({2.05, 0.05}, message.mutable_point());
  for (const LayerPointContent& content : *contents) Encode(content, message.add_layers());

  const auto answer = DecodePointAnswer(Received(message));
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->map, "site");
  EXPECT_EQ(answer->revision, 3);
  EXPECT_EQ(answer->incarnation, 77u);
  EXPECT_EQ(answer->frame_id, "map");
  EXPECT_EQ(answer->point, (Point{2.05, 0.05}));
  ASSERT_EQ(answer->layers.size(), contents->size());
  for (size_t i = 0; i < contents->size(); ++i) {
    const answers::LayerContent& decoded = answer->layers[i];
    const LayerPointContent& content = (*contents)[i];
    EXPECT_EQ(decoded.layer, content.layer->spec().name);
    EXPECT_EQ(decoded.kind, content.layer->spec().kind);
    EXPECT_EQ(decoded.status, content.content.status);
    EXPECT_EQ(decoded.value, content.content.value);
    ASSERT_EQ(decoded.objects.size(), content.content.objects.size());
    for (size_t k = 0; k < decoded.objects.size(); ++k) {
      EXPECT_EQ(decoded.objects[k], *content.content.objects[k]);
    }
  }

  message.mutable_layers(0)->clear_kind();
  EXPECT_EQ(DecodePointAnswer(message).status(),
            absl::InvalidArgumentError("grid.kind is missing"));
}

TEST(LayerPartOnTheWire, ComesBack) {
  const Snapshot snapshot = Site();
  const LayerAnswerPart things = PartWithObjects(snapshot, 2);
  v1::LayerPart message;
  EncodeLayerPart(things, 0, 1000, &message);
  const auto objects = DecodeLayerPart(Received(message));
  ASSERT_TRUE(objects.ok()) << objects.status();
  EXPECT_EQ(objects->layer, "things");
  EXPECT_EQ(objects->kind, LayerKind::kSemantic);
  ASSERT_EQ(objects->objects.size(), 2u);
  EXPECT_EQ(objects->objects[1], *things.part.objects[1]);
  EXPECT_EQ(objects->grid, std::nullopt);

  LayerAnswerPart grid;
  grid.layer = *snapshot.GetLayer("grid");
  grid.part.runs = {{0, 0, 1, 1.0}, {1, 1, 2, std::nullopt}};
  message.Clear();
  EncodeLayerPart(grid, 0, 1000, &message);
  const auto cells = DecodeLayerPart(Received(message));
  ASSERT_TRUE(cells.ok()) << cells.status();
  EXPECT_EQ(cells->kind, LayerKind::kScalar);
  EXPECT_EQ(cells->status, AnswerStatus::kValue);
  EXPECT_EQ(cells->grid, GridSpec().grid);
  EXPECT_EQ(cells->runs, grid.part.runs);
}

TEST(LayerPartOnTheWire, LargeObjectsSpreadOverMessages) {
  const Snapshot snapshot = Site();
  const LayerAnswerPart part = PartWithObjects(snapshot, 5);
  v1::Object one;
  EncodeObject(*part.part.objects[0], PlanarTransform(), &one);
  const auto max_bytes = static_cast<int64_t>(2 * one.ByteSizeLong() - 1);

  std::vector<int64_t> ids;
  std::vector<int> sizes;
  for (size_t next = 0; next < part.part.objects.size();) {
    v1::LayerPart message;
    next = EncodeLayerPart(part, next, max_bytes, &message);
    message = Received(message);
    sizes.push_back(message.objects_size());
    for (const v1::Object& object : message.objects()) ids.push_back(object.id());
  }
  EXPECT_EQ(sizes, (std::vector<int>{2, 2, 1}));
  EXPECT_EQ(ids, (std::vector<int64_t>{1, 2, 3, 4, 5}));
}

TEST(LayerPartOnTheWire, HoldsAnObjectLargerThanTheBound) {
  const Snapshot snapshot = Site();
  const LayerAnswerPart part = PartWithObjects(snapshot, 2);
  v1::LayerPart message;
  EXPECT_EQ(EncodeLayerPart(part, 0, 1, &message), 1u);
  EXPECT_EQ(Received(message).objects_size(), 1);
}

TEST(LayerPartOnTheWire, RefusalHasAStatusAndNoCells) {
  const Snapshot snapshot = Site();
  LayerAnswerPart part;
  part.layer = *snapshot.GetLayer("grid");
  part.status = AnswerStatus::kUnsupportedValue;
  v1::LayerPart message;
  EXPECT_EQ(EncodeLayerPart(part, 0, 1000, &message), 0u);
  EXPECT_EQ(message.status(), v1::ANSWER_STATUS_UNSUPPORTED_VALUE);
  EXPECT_FALSE(message.has_cells());
}

TEST(LayerPartOnTheWire, CellsLieInTheCallersFrame) {
  const Snapshot snapshot = Site();
  LayerAnswerPart part;
  part.layer = *snapshot.GetLayer("grid");
  part.caller_from_layer = PlanarTransform(5, 5, 1);
  part.part.runs = {{0, 0, 1, 1.0}};
  v1::LayerPart message;
  EncodeLayerPart(part, 0, 1000, &message);
  const auto decoded = DecodeCellRuns("cells", message.cells());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->grid, GeometryInFrame(*GridSpec().grid, part.caller_from_layer));
  EXPECT_EQ(decoded->runs, part.part.runs);
}

TEST(NearestAnswerOnTheWire, HoldsMatchesAndRefusals) {
  const Snapshot snapshot = Site();
  const auto answer = Nearest(snapshot, {}, {0.5, 0.05}, *ParseValueQuery("cup"), 2);
  ASSERT_TRUE(answer.ok()) << answer.status();
  v1::QueryNearestResponse message;
  EncodeNearestAnswer(*answer, &message);
  message = Received(message);
  ASSERT_EQ(message.matches_size(), 2);
  EXPECT_EQ(message.matches(0).layer(), "things");
  EXPECT_NEAR(message.matches(0).distance_m(), 0.4, 1e-12);
  EXPECT_EQ(message.matches(0).object().label(), "cup");
  EXPECT_FALSE(message.matches(0).has_cells());
  ASSERT_EQ(message.refusals_size(), 1);
  EXPECT_EQ(message.refusals(0).layer(), "grid");
  EXPECT_EQ(message.refusals(0).status(), v1::ANSWER_STATUS_UNSUPPORTED_VALUE);

  const auto decoded = DecodeNearestAnswer(message);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  ASSERT_EQ(decoded->matches.size(), 2u);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(decoded->matches[i].layer, "things");
    EXPECT_EQ(decoded->matches[i].kind, LayerKind::kSemantic);
    EXPECT_EQ(decoded->matches[i].distance_m, answer->entries[i].neighbour.distance_m);
    EXPECT_EQ(decoded->matches[i].object, *answer->entries[i].neighbour.object);
  }
  ASSERT_EQ(decoded->refusals.size(), 1u);
  EXPECT_EQ(decoded->refusals[0].layer, "grid");
  EXPECT_EQ(decoded->refusals[0].status, AnswerStatus::kUnsupportedValue);
}

TEST(NearestAnswerOnTheWire, CellIsARunOfOne) {
  const Snapshot snapshot = Site();
  const auto answer = Nearest(snapshot, {{"grid"}, ""}, {1.0, 2.0}, *ParseValueQuery("=2"), 1);
  ASSERT_TRUE(answer.ok()) << answer.status();
  v1::QueryNearestResponse message;
  EncodeNearestAnswer(*answer, &message);
  message = Received(message);
  ASSERT_EQ(message.matches_size(), 1);
  const auto cells = DecodeCellRuns("cells", message.matches(0).cells());
  ASSERT_TRUE(cells.ok()) << cells.status();
  EXPECT_EQ(cells->runs, (std::vector<CellRun>{{0, 2, 3, 2.0}}));

  const auto decoded = DecodeNearestAnswer(message);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  ASSERT_EQ(decoded->matches.size(), 1u);
  EXPECT_EQ(decoded->matches[0].grid, GridSpec().grid);
  EXPECT_EQ(decoded->matches[0].cell, (CellRun{0, 2, 3, 2.0}));
  EXPECT_EQ(decoded->matches[0].object, std::nullopt);
  message.mutable_matches(0)->clear_cells();
  message.mutable_matches(0)->mutable_cells();
  EXPECT_FALSE(DecodeNearestAnswer(message).ok());
}

}  // namespace
}  // namespace hypermap::wire
