#include "wire/edit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "base/limits/limits.h"
#include "tests/support/not_finite.h"

namespace hypermap::wire {
namespace {

using ::testing::HasSubstr;

using hypermap::testing::kNan;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Polygon Square() { return Polygon::FromBox({{0, 0}, {1, 1}}); }

template <typename EditType>
EditType RoundTrip(const EditType& edit) {
  v1::Edit message;
  EncodeEdit(edit, &message);
  const absl::StatusOr<Edit> decoded = DecodeEdit("edits[0]", message, Limits());
  EXPECT_TRUE(decoded.ok()) << decoded.status();
  return std::get<EditType>(*decoded);
}

TEST(EditOnTheWire, PutObjectComesBackEqual) {
  PutObject edit{"things", {}, "dock"};
  edit.object.id = 7;
  edit.object.label = "cup";
  edit.object.shape = Square();
  const PutObject decoded = RoundTrip(edit);
  EXPECT_EQ(decoded.layer, edit.layer);
  EXPECT_EQ(decoded.object, edit.object);
  EXPECT_EQ(decoded.frame_id, edit.frame_id);
}

TEST(EditOnTheWire, DeleteObjectComesBackEqual) {
  const DeleteObject decoded = RoundTrip(DeleteObject{"things", 12});
  EXPECT_EQ(decoded.layer, "things");
  EXPECT_EQ(decoded.id, 12);
}

TEST(EditOnTheWire, WantedVersionsAndTimeToLiveComeBackEqual) {
  PutObject put{"things", {}, ""};
  put.object.label = "cup";
  put.object.shape = Square();
  EXPECT_EQ(RoundTrip(put).if_version, std::nullopt);
  EXPECT_EQ(RoundTrip(put).time_to_live, std::nullopt);
  put.if_version = 0;
  put.time_to_live = absl::Milliseconds(2500);
  EXPECT_EQ(RoundTrip(put).if_version, 0);
  EXPECT_EQ(RoundTrip(put).time_to_live, absl::Milliseconds(2500));
  EXPECT_EQ(RoundTrip(DeleteObject{"things", 12, 9}).if_version, 9);
  EXPECT_EQ(RoundTrip(DeleteObject{"things", 12}).if_version, std::nullopt);
}

TEST(EditOnTheWire, LayerVersionsComeBackEqual) {
  google::protobuf::RepeatedPtrField<v1::LayerVersion> messages;
  EncodeLayerVersions({{"things", 4}, {"floor", 0}}, &messages);
  const auto decoded = DecodeLayerVersions("if_layers", messages);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  ASSERT_EQ(decoded->size(), 2u);
  EXPECT_EQ((*decoded)[0].layer, "things");
  EXPECT_EQ((*decoded)[0].version, 4);
  EXPECT_EQ((*decoded)[1].layer, "floor");
  EXPECT_EQ((*decoded)[1].version, 0);
  messages[1].clear_layer();
  EXPECT_EQ(DecodeLayerVersions("if_layers", messages).status(),
            absl::InvalidArgumentError("if_layers[1].layer is empty"));
}

TEST(EditOnTheWire, WriteCellsComesBackEqualUnknownIncluded) {
  const WriteCells edit{"grid", {-2, -1, -3, 0}, {0.5, std::nullopt, 0.0}};
  const WriteCells decoded = RoundTrip(edit);
  EXPECT_EQ(decoded.layer, edit.layer);
  EXPECT_EQ(decoded.box, edit.box);
  EXPECT_EQ(decoded.values, edit.values);
}

TEST(EditOnTheWire, FillPolygonComesBackEqualByEveryRule) {
  for (const CellRule rule : {CellRule::kCentre, CellRule::kCovered, CellRule::kTouched}) {
    for (const std::optional<double> value : {std::optional(0.0), std::optional<double>()}) {
      const FillPolygon decoded = RoundTrip(FillPolygon{"grid", Square(), "dock", rule, value});
      EXPECT_EQ(decoded.layer, "grid");
      EXPECT_EQ(decoded.area, Square());
      EXPECT_EQ(decoded.frame_id, "dock");
      EXPECT_EQ(decoded.rule, rule);
      EXPECT_EQ(decoded.value, value);
    }
  }
}

TEST(EditOnTheWire, SetAliasesComesBackEqual) {
  const SetAliases edit{"things", {{"furniture", {"chair", "couch"}}, {"tv", {}}}};
  const SetAliases decoded = RoundTrip(edit);
  EXPECT_EQ(decoded.layer, edit.layer);
  EXPECT_EQ(decoded.aliases, edit.aliases);
  EXPECT_EQ(DecodeEdit(
                "edits[0]",
                [] {
                  v1::Edit message;
                  message.mutable_set_aliases()->set_layer("things");
                  return message;
                }(),
                Limits())
                .status(),
            absl::InvalidArgumentError("edits[0].set_aliases.aliases is empty"));
}

TEST(EditOnTheWire, CreateLayerComesBackEqual) {
  LayerSpec grid;
  grid.name = "floor";
  grid.kind = LayerKind::kExploration;
  grid.frame_id = "dock";
  grid.grid = GridGeometry{PlanarTransform(1, 2, 0.5), 0.05};
  grid.explored_rule = CellRule::kTouched;
  EXPECT_EQ(RoundTrip(CreateLayer{grid}).spec, grid);
  LayerSpec lanes;
  lanes.name = "lanes";
  lanes.aliases = {{"way", {"lane"}}};
  lanes.shape_kinds = {ShapeKind::kLineString};
  EXPECT_EQ(RoundTrip(CreateLayer{lanes}).spec, lanes);
}

TEST(EditOnTheWire, DeleteLayerComesBackEqual) {
  EXPECT_EQ(RoundTrip(DeleteLayer{"things"}).layer, "things");
}

TEST(EditOnTheWire, SetTransformComesBackEqual) {
  const SetTransform edit{{"map", "dock", PlanarTransform(1.5, -2.25, 0.75)}};
  EXPECT_EQ(RoundTrip(edit).transform, edit.transform);
}

TEST(EditOnTheWire, RuleLeftOutSelectsByCentre) {
  v1::Edit message;
  EncodeEdit(FillPolygon{"grid", Square(), "", CellRule::kTouched, {}}, &message);
  message.mutable_fill_polygon()->clear_rule();
  EXPECT_EQ(std::get<FillPolygon>(*DecodeEdit("e", message, Limits())).rule, CellRule::kCentre);
}

v1::Edit FillMessage(double value) {
  v1::Edit message;
  EncodeEdit(FillPolygon{"grid", Square(), "", CellRule::kCentre, value}, &message);
  return message;
}

TEST(EditOnTheWire, BadOnesNameTheField) {
  v1::Edit no_object;
  no_object.mutable_put_object()->set_layer("things");
  v1::Edit no_shape = no_object;
  no_shape.mutable_put_object()->mutable_object()->set_label("cup");
  v1::Edit short_line = no_shape;
  v1::LineString* line =
      short_line.mutable_put_object()->mutable_object()->mutable_shape()->mutable_line_string();
  line->add_xs(1);
  line->add_ys(2);
  v1::Edit no_layer;
  no_layer.mutable_create_layer();
  v1::Edit no_kind;
  no_kind.mutable_create_layer()->mutable_layer()->set_name("things");
  v1::Edit no_transform;
  no_transform.mutable_set_transform();
  v1::Edit no_pose;
  no_pose.mutable_set_transform()->mutable_transform()->set_child_frame_id("dock");
  v1::Edit infinite_cell;
  infinite_cell.mutable_write_cells()->add_values(kNan);
  infinite_cell.mutable_write_cells()->add_values(-kInfinity);
  v1::Edit no_area;
  no_area.mutable_fill_polygon();
  v1::Edit unknown_rule = FillMessage(1.0);
  unknown_rule.mutable_fill_polygon()->set_rule(static_cast<v1::CellRule>(9));
  v1::Edit long_life;
  PutObject put{"things", {}, ""};
  put.object.shape = Square();
  EncodeEdit(put, &long_life);
  long_life.mutable_put_object()->mutable_time_to_live()->set_seconds(int64_t{1} << 60);
  const struct {
    const char* name;
    v1::Edit message;
    const char* error;
  } cases[] = {
      {"nothing", v1::Edit(), "edits[2] says nothing to do"},
      {"no object", no_object, "edits[2].put_object.object is missing"},
      {"no shape", no_shape, "edits[2].put_object.object.shape is missing"},
      {"short line", short_line,
       "edits[2].put_object.object.shape.line_string: line string has fewer than 2 distinct "
       "vertices"},
      {"no layer", no_layer, "edits[2].create_layer.layer is missing"},
      {"no kind", no_kind, "edits[2].create_layer.layer.kind is missing"},
      {"no transform", no_transform, "edits[2].set_transform.transform is missing"},
      {"no pose", no_pose, "edits[2].set_transform.transform.parent_from_child is missing"},
      {"infinite cell", infinite_cell, "edits[2].write_cells.values[1] is not finite"},
      {"no area", no_area, "edits[2].fill_polygon.area is missing"},
      {"unknown rule", unknown_rule, "edits[2].fill_polygon.rule is not a known rule: 9"},
      {"long life", long_life, "edits[2].put_object.time_to_live is longer than 100 years"},
      {"nan fill", FillMessage(kNan), "edits[2].fill_polygon.value is not finite"},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.name);
    EXPECT_EQ(DecodeEdit("edits[2]", c.message, Limits()).status(),
              absl::InvalidArgumentError(c.error));
  }
}

TEST(EditOnTheWire, CellsCountAgainstTheLimit) {
  v1::Edit message;
  EncodeEdit(WriteCells{"grid", {0, 1, 0, 3}, {1.0, 1.0, 1.0}}, &message);
  Limits limits;
  limits.max_cells = 3;
  EXPECT_TRUE(DecodeEdit("edits[0]", message, limits).ok());
  limits.max_cells = 2;
  const auto refused = DecodeEdit("edits[0]", message, limits);
  EXPECT_TRUE(absl::IsResourceExhausted(refused.status())) << refused.status();
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("--max_cells"));
}

TEST(EditBatchOnTheWire, MustHoldOneEditAndAtMostTheLimit) {
  google::protobuf::RepeatedPtrField<v1::Edit> edits;
  EXPECT_EQ(DecodeEdits(edits, Limits()).status(), absl::InvalidArgumentError("edits is empty"));
  Limits limits;
  limits.max_edits = 2;
  for (int i = 0; i < 2; ++i) *edits.Add() = FillMessage(1.0);
  const auto batch = DecodeEdits(edits, limits);
  ASSERT_TRUE(batch.ok()) << batch.status();
  EXPECT_EQ(batch->edits.size(), 2u);
  *edits.Add() = FillMessage(1.0);
  const auto refused = DecodeEdits(edits, limits);
  EXPECT_TRUE(absl::IsResourceExhausted(refused.status())) << refused.status();
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("--max_edits"));
}

TEST(EditBatchOnTheWire, ComesBackFromItsBytes) {
  EditBatch batch;
  PutObject put{"things", {}, "dock"};
  put.object.label = "cup";
  put.object.shape = Square();
  batch.edits = {put, DeleteObject{"things", 12, 9}, DeleteLayer{"old"}};
  batch.if_layers = {{"things", 41}};
  const absl::StatusOr<EditBatch> back = EditsFromBytes(EditsToBytes(batch));
  ASSERT_TRUE(back.ok()) << back.status();
  ASSERT_EQ(back->edits.size(), 3u);
  EXPECT_EQ(std::get<PutObject>(back->edits[0]).object, put.object);
  EXPECT_EQ(std::get<DeleteObject>(back->edits[1]).if_version, 9);
  EXPECT_EQ(std::get<DeleteLayer>(back->edits[2]).layer, "old");
  ASSERT_EQ(back->if_layers.size(), 1u);
  EXPECT_EQ(back->if_layers[0].version, 41);
}

TEST(EditBatchOnTheWire, OtherBytesAreRefused) {
  EXPECT_TRUE(absl::IsDataLoss(EditsFromBytes("\xff\xff").status()));
  EXPECT_TRUE(absl::IsInvalidArgument(EditsFromBytes("").status()));
}

}  // namespace
}  // namespace hypermap::wire
