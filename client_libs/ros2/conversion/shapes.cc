#include "client_libs/ros2/conversion/shapes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "client_libs/ros2/conversion/grids.h"

namespace hypermap::ros2 {
namespace {

using visualization_msgs::Marker;

constexpr double kLineWidth_m = 0.03;
constexpr double kPointSize_m = 0.15;
constexpr double kTextHeight_m = 0.2;

std::vector<Point> VerticesOf(const Shape& shape) {
  switch (shape.kind()) {
    case ShapeKind::kPolygon:
      return shape.polygon().empty() ? Ring() : shape.polygon().outer();
    case ShapeKind::kLineString:
      return shape.line_string().vertices();
    case ShapeKind::kPoint:
      break;
  }
  return {shape.point()};
}

geometry_msgs::Point At(const Point& p, double z = 0.0) { return {p.x, p.y, z}; }

float Srgb(double linear) {
  const double x = std::clamp(linear, 0.0, 1.0);
  const double value = x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
  return static_cast<float>(std::lround(255 * value) / 255.0);
}

// From OKLCH, where equal steps look equal: https://bottosson.github.io/posts/oklab/.
std_msgs::ColorRGBA Oklch(double lightness, double chroma, double hue_deg) {
  const double hue = hue_deg * std::numbers::pi / 180;
  const double a = chroma * std::cos(hue);
  const double b = chroma * std::sin(hue);
  const double l = std::pow(lightness + 0.3963377774 * a + 0.2158037573 * b, 3);
  const double m = std::pow(lightness - 0.1055613458 * a - 0.0638541728 * b, 3);
  const double s = std::pow(lightness - 0.0894841775 * a - 1.291485548 * b, 3);
  return {Srgb(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
          Srgb(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
          Srgb(-0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s), 1.0F};
}

// Appends the segments of a ring.
void AddRing(const Ring& ring, std::vector<geometry_msgs::Point>* segments) {
  for (size_t i = 0; i < ring.size(); ++i) {
    segments->push_back(At(ring[i]));
    segments->push_back(At(ring[(i + 1) % ring.size()]));
  }
}

// Draws an object with the common parts of `marker`.
Marker DrawShape(const Shape& shape, Marker marker) {
  marker.scale = {kLineWidth_m, 0.0, 0.0};
  switch (shape.kind()) {
    case ShapeKind::kPolygon:
      marker.type = Marker::kLineList;
      for (const Ring& ring : shape.polygon().rings()) AddRing(ring, &marker.points);
      break;
    case ShapeKind::kLineString:
      marker.type = Marker::kLineStrip;
      for (const Point& p : shape.line_string().vertices()) marker.points.push_back(At(p));
      break;
    case ShapeKind::kPoint:
      marker.type = Marker::kSphere;
      marker.scale = {kPointSize_m, kPointSize_m, kPointSize_m};
      marker.pose.position = At(shape.point());
      break;
  }
  return marker;
}

Marker DrawLabel(const SemanticObject& object, Marker marker) {
  marker.type = Marker::kTextViewFacing;
  marker.scale = {0.0, 0.0, kTextHeight_m};
  const double height = object.height ? object.height->high_m : 0.0;
  marker.pose.position = At(Centroid(object.shape), height + kTextHeight_m);
  marker.text = object.label;
  return marker;
}

}  // namespace

geometry_msgs::Polygon ToPolygon(const Shape& shape, const PlanarTransform& transform) {
  geometry_msgs::Polygon polygon;
  for (const Point& vertex : VerticesOf(shape)) {
    const Point p = transform * vertex;
    polygon.points.push_back({static_cast<float>(p.x), static_cast<float>(p.y), 0.0F});
  }
  return polygon;
}

absl::StatusOr<Polygon> FromPolygon(const geometry_msgs::Polygon& polygon) {
  Ring ring;
  for (const geometry_msgs::Point32& p : polygon.points) ring.push_back({p.x, p.y});
  return Polygon::Make(std::move(ring));
}

hypermap_msgs::SemanticObject ToSemanticObject(const SemanticObject& object,
                                               const PlanarTransform& transform) {
  hypermap_msgs::SemanticObject message;
  message.id = static_cast<uint32_t>(object.id);
  message.shape = ToPolygon(object.shape, transform);
  message.name = object.label;
  for (const auto& [name, score] : object.classes) {
    message.tags.push_back(name);
    message.confidence.push_back(score);
  }
  return message;
}

hypermap_msgs::SemanticMap ToSemanticMap(const Snapshot& snapshot, const SemanticLayer& layer) {
  hypermap_msgs::SemanticMap message;
  const auto transform = snapshot.frames.Lookup(snapshot.frame_id, layer.spec().frame_id);
  if (!transform.ok()) return message;
  for (const ObjectPtr& object : layer.Objects()) {
    message.objects.push_back(ToSemanticObject(*object, *transform));
  }
  return message;
}

std_msgs::ColorRGBA ClassColour(const std::string& label) {
  uint32_t hash = 0x811c9dc5;  // FNV-1a
  for (const char c : absl::AsciiStrToLower(absl::StripAsciiWhitespace(label))) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x01000193;
  }
  constexpr uint32_t kHues = 24;
  return Oklch(0.5 + (hash >> 8) % 3 * 0.06, 0.15, hash % kHues * (360.0 / kHues));
}

visualization_msgs::MarkerArray ToMarkers(const Snapshot& snapshot, absl::Time stamp) {
  visualization_msgs::MarkerArray array;
  Marker deletion;
  deletion.header = {ToTime(stamp), snapshot.frame_id};
  deletion.action = Marker::kDeleteAll;
  array.markers.push_back(std::move(deletion));
  for (const auto& [name, layer] : snapshot.layers) {
    const SemanticLayer* const semantic = AsSemantic(layer.get());
    if (semantic == nullptr) continue;
    int32_t id = 0;
    for (const ObjectPtr& object : semantic->Objects()) {
      Marker marker;
      marker.header = {ToTime(stamp), layer->spec().frame_id};
      marker.ns = name;
      marker.color = ClassColour(object->label);
      marker.id = id++;
      array.markers.push_back(DrawShape(object->shape, marker));
      marker.id = id++;
      array.markers.push_back(DrawLabel(*object, marker));
    }
  }
  return array;
}

tf2_msgs::TFMessage ToTransforms(const FrameTree& frames, absl::Time stamp) {
  tf2_msgs::TFMessage message;
  for (const FrameTransform& edge : frames.transforms()) {
    const PlanarTransform& t = edge.parent_from_child;
    geometry_msgs::TransformStamped stamped;
    stamped.header = {ToTime(stamp), edge.parent_frame_id};
    stamped.child_frame_id = edge.child_frame_id;
    stamped.transform.translation = {t.x(), t.y(), 0.0};
    stamped.transform.rotation = {0.0, 0.0, std::sin(t.yaw() / 2), std::cos(t.yaw() / 2)};
    message.transforms.push_back(std::move(stamped));
  }
  return message;
}

}  // namespace hypermap::ros2
