#include "wire/version_01.h"

#include <google/protobuf/unknown_field_set.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/escaping.h"
#include "tests/support/random_map.h"
#include "wire/edit.h"
#include "wire/geometry.h"
#include "wire/object.h"
#include "wire/observation.h"

namespace hypermap::wire {
namespace {

using google::protobuf::util::MessageDifferencer;

// Messages as serialized with the contract of version 0.1.

// An object "desk" with id 7, a polygon with a hole, existence 0.5, version 3 and the tag "old".
constexpr char kDesk[] =
    "080712046465736b21000000000000e03f2a6c0a2c0a000a090900000000000010400a12090000000000"
    "0010401100000000000000400a09110000000000000040123c0a1209000000000000f03f110000000000"
    "00e03f0a1209000000000000f03f11000000000000f03f0a1209000000000000004011000000000000f0"
    "3f321209000000000000f03f11000000000000f03f42036f6c645003";

// Frame 5 of robot "r1": a view hull, free space with a hole, and one detection.
constexpr char kObservation[] =
    "0a02723110051a060880e2cfaa0622036d61702a640a48000000000000f03f0000000000000000000000"
    "00000000000000000000000000000000000000f03f000000000000000000000000000000000000000000"
    "000000000000000000f03f121800000000000000000000000000000000000000000000f03f321a0a180a"
    "000a090900000000000008400a091100000000000008403a6c0a2c0a000a090900000000000000400a12"
    "0900000000000000401100000000000000400a09110000000000000040123c0a1209000000000000e03f"
    "11000000000000e03f0a1209000000000000e03f11000000000000f03f0a1209000000000000f03f1100"
    "0000000000f03f4a81010a0e0a0363757011000000000000e03f123e0a3c0a1209000000000000f03f11"
    "000000000000f03f0a1209000000000000f83f11000000000000f03f0a1209000000000000f43f110000"
    "00000000f83f1a100a00119a9999999999a93f1a03000004220911000000000000d03f28093100000000"
    "0000004041000000000000f03f";

// Puts the desk on "things" in the frame "dock", fills a triangle of "floor", and deletes object 4.
constexpr char kEdits[] =
    "1aae010aab010a067468696e6773129a01080712046465736b21000000000000e03f2a6c0a2c0a000a09"
    "0900000000000010400a120900000000000010401100000000000000400a09110000000000000040123c"
    "0a1209000000000000f03f11000000000000e03f0a1209000000000000f03f11000000000000f03f0a12"
    "09000000000000004011000000000000f03f321209000000000000f03f11000000000000f03f42036f6c"
    "6450031a04646f636b1a2e222c0a05666c6f6f72121a0a180a000a0909000000000000f03f0a09110000"
    "00000000f03f29000000000000f03f1a0c120a0a067468696e67731004";

// Returns a polygon without normalisation, with the vertices as stored.
Polygon PolygonOf(Ring outer, std::initializer_list<Ring> holes = {}) {
  Rings rings = {std::move(outer)};
  rings.insert(rings.end(), holes);
  return Polygon::MakeUnchecked(std::move(rings));
}

const Polygon& DeskPolygon() {
  static const auto* const kPolygon =
      new Polygon(PolygonOf({{0, 0}, {4, 0}, {4, 2}, {0, 2}}, {{{1, 0.5}, {1, 1}, {2, 1}}}));
  return *kPolygon;
}

std::string Bytes(const char* hex) { return absl::HexStringToBytes(hex); }

bool HasUnknownFields(const google::protobuf::Message& message) {
  return !message.GetReflection()->GetUnknownFields(message).empty();
}

TEST(Version01Test, StoredObjectKeepsItsPolygon) {
  const absl::StatusOr<SemanticObject> desk = ObjectFromBytes(Bytes(kDesk));
  ASSERT_TRUE(desk.ok()) << desk.status();
  EXPECT_EQ(desk->id, 7);
  EXPECT_EQ(desk->label, "desk");
  EXPECT_EQ(desk->existence, 0.5);
  EXPECT_EQ(desk->version, 3);
  EXPECT_EQ(desk->tags, std::vector<std::string>{"old"});
  EXPECT_EQ(desk->shape, Shape(DeskPolygon()));
}

TEST(Version01Test, StoredObservationKeepsItsPolygons) {
  const absl::StatusOr<Observation> seen = ObservationFromBytes(Bytes(kObservation));
  ASSERT_TRUE(seen.ok()) << seen.status();
  EXPECT_EQ(seen->robot, "r1");
  EXPECT_EQ(seen->sequence, 5);
  EXPECT_EQ(seen->view_hull, PolygonOf({{0, 0}, {3, 0}, {0, 3}}));
  EXPECT_EQ(seen->free_space,
            PolygonOf({{0, 0}, {2, 0}, {2, 2}, {0, 2}}, {{{0.5, 0.5}, {0.5, 1}, {1, 1}}}));
  ASSERT_EQ(seen->detections.size(), 1u);
  EXPECT_EQ(seen->detections[0].hull, PolygonOf({{1, 1}, {1.5, 1}, {1.25, 1.5}}));
  EXPECT_EQ(seen->detections[0].num_points, 9);
}

TEST(Version01Test, StoredEditsKeepTheirPolygons) {
  const absl::StatusOr<EditBatch> batch = EditsFromBytes(Bytes(kEdits));
  ASSERT_TRUE(batch.ok()) << batch.status();
  ASSERT_EQ(batch->edits.size(), 3u);
  const PutObject& put = std::get<PutObject>(batch->edits[0]);
  EXPECT_EQ(put.layer, "things");
  EXPECT_EQ(put.frame_id, "dock");
  EXPECT_EQ(put.object.label, "desk");
  EXPECT_EQ(put.object.shape, Shape(DeskPolygon()));
  const FillPolygon& fill = std::get<FillPolygon>(batch->edits[1]);
  EXPECT_EQ(fill.area, PolygonOf({{0, 0}, {1, 0}, {0, 1}}));
  EXPECT_EQ(fill.value, 1.0);
  EXPECT_EQ(std::get<DeleteObject>(batch->edits[2]).id, 4);
}

TEST(Version01Test, NothingOfTheOldFieldsIsLeft) {
  v1::Object desk;
  ASSERT_TRUE(desk.ParseFromString(Bytes(kDesk)));
  ASSERT_TRUE(HasUnknownFields(desk));
  UpgradeFrom01(&desk);
  EXPECT_FALSE(HasUnknownFields(desk));
  EXPECT_FALSE(HasUnknownFields(desk.shape().polygon().outer()));
  EXPECT_FALSE(HasUnknownFields(desk.shape().polygon().holes(0)));
  v1::Observation seen;
  ASSERT_TRUE(seen.ParseFromString(Bytes(kObservation)));
  ASSERT_TRUE(HasUnknownFields(seen.view_hull().outer()));
  UpgradeFrom01(&seen);
  EXPECT_FALSE(HasUnknownFields(seen.view_hull().outer()));
  EXPECT_FALSE(HasUnknownFields(seen.free_space().holes(0)));
  EXPECT_FALSE(HasUnknownFields(seen.detections(0).hull().outer()));
}

TEST(Version01Test, UpgradeOfAnUpgradedMessageChangesNothing) {
  v1::ApplyEditsRequest once;
  ASSERT_TRUE(once.ParseFromString(Bytes(kEdits)));
  UpgradeFrom01(&once);
  v1::ApplyEditsRequest twice = once;
  UpgradeFrom01(&twice);
  EXPECT_TRUE(MessageDifferencer::Equals(once, twice)) << twice.DebugString();
}

TEST(Version01Test, ObjectOfTodayIsLeftAsItIs) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  hypermap::testing::Rng rng(seed);
  for (int i = 0; i < 100; ++i) {
    v1::Object sent;
    EncodeObject(hypermap::testing::RandomObject(rng, {1, 2}, 3.0), PlanarTransform(), &sent);
    v1::Object received;
    ASSERT_TRUE(received.ParseFromString(sent.SerializeAsString()));
    UpgradeFrom01(&received);
    EXPECT_TRUE(MessageDifferencer::Equals(received, sent)) << received.DebugString();
  }
}

// Fields of a later version, which neither version knows, are kept.
TEST(Version01Test, OtherUnknownFieldsAreKept) {
  v1::Object desk;
  ASSERT_TRUE(desk.ParseFromString(Bytes(kDesk)));
  desk.GetReflection()->MutableUnknownFields(&desk)->AddVarint(1000, 42);
  UpgradeFrom01(&desk);
  const google::protobuf::UnknownFieldSet& unknown = desk.GetReflection()->GetUnknownFields(desk);
  ASSERT_EQ(unknown.field_count(), 1);
  EXPECT_EQ(unknown.field(0).number(), 1000);
  EXPECT_EQ(unknown.field(0).varint(), 42u);
  EXPECT_TRUE(desk.shape().has_polygon());
}

TEST(Version01Test, DamagedPolygonIsAnErrorOfTheObject) {
  v1::Object desk;
  desk.set_label("desk");
  desk.GetReflection()->MutableUnknownFields(&desk)->AddLengthDelimited(5, "\xff\xff");
  EXPECT_TRUE(absl::IsDataLoss(ObjectFromBytes(desk.SerializeAsString()).status()));
}

}  // namespace
}  // namespace hypermap::wire
