#include "wire/version_01.h"

#include <google/protobuf/unknown_field_set.h>

#include "hypermap/v1/geometry.pb.h"

namespace hypermap::wire {
namespace {

using google::protobuf::UnknownField;
using google::protobuf::UnknownFieldSet;

constexpr int kRingPoints = 1;
constexpr int kObjectPolygon = 5;

void UpgradeRing(v1::Ring* ring) {
  UnknownFieldSet* unknown = ring->GetReflection()->MutableUnknownFields(ring);
  if (unknown->empty()) return;
  for (int i = 0; i < unknown->field_count(); ++i) {
    const UnknownField& field = unknown->field(i);
    if (field.number() != kRingPoints || field.type() != UnknownField::TYPE_LENGTH_DELIMITED) {
      continue;
    }
    v1::Point point;
    if (!point.ParseFromString(field.length_delimited())) continue;
    ring->add_xs(point.x());
    ring->add_ys(point.y());
  }
  unknown->DeleteByNumber(kRingPoints);
}

void DowngradeRing(v1::Ring* ring) {
  UnknownFieldSet* unknown = ring->GetReflection()->MutableUnknownFields(ring);
  for (int i = 0; i < ring->xs_size(); ++i) {
    v1::Point point;
    point.set_x(ring->xs(i));
    point.set_y(ring->ys(i));
    unknown->AddLengthDelimited(kRingPoints, point.SerializeAsString());
  }
  ring->clear_xs();
  ring->clear_ys();
}

template <typename ChangeRing>
void ForEachRing(v1::Polygon* polygon, ChangeRing change) {
  if (polygon->has_outer()) change(polygon->mutable_outer());
  for (v1::Ring& hole : *polygon->mutable_holes()) change(&hole);
}

template <typename ChangeRing>
void ForEachRing(v1::Observation* message, ChangeRing change) {
  if (message->has_view_hull()) ForEachRing(message->mutable_view_hull(), change);
  if (message->has_free_space()) ForEachRing(message->mutable_free_space(), change);
  for (v1::Detection& detection : *message->mutable_detections()) {
    if (detection.has_hull()) ForEachRing(detection.mutable_hull(), change);
  }
}

void UpgradePolygon(v1::Polygon* polygon) { ForEachRing(polygon, &UpgradeRing); }

}  // namespace

void UpgradeFrom01(v1::Object* message) {
  if (message->has_shape()) return;
  UnknownFieldSet* unknown = message->GetReflection()->MutableUnknownFields(message);
  for (int i = 0; i < unknown->field_count(); ++i) {
    const UnknownField& field = unknown->field(i);
    if (field.number() != kObjectPolygon || field.type() != UnknownField::TYPE_LENGTH_DELIMITED) {
      continue;
    }
    v1::Polygon* polygon = message->mutable_shape()->mutable_polygon();
    if (polygon->ParseFromString(field.length_delimited())) UpgradePolygon(polygon);
  }
  unknown->DeleteByNumber(kObjectPolygon);
}

void UpgradeFrom01(v1::ApplyEditsRequest* message) {
  for (v1::Edit& edit : *message->mutable_edits()) {
    if (edit.has_put_object()) UpgradeFrom01(edit.mutable_put_object()->mutable_object());
    if (edit.has_fill_polygon()) UpgradePolygon(edit.mutable_fill_polygon()->mutable_area());
  }
}

void UpgradeFrom01(v1::Observation* message) { ForEachRing(message, &UpgradeRing); }

void DowngradeTo01(v1::Observation* message) { ForEachRing(message, &DowngradeRing); }

}  // namespace hypermap::wire
