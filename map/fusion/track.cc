#include "map/fusion/track.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "map/geometry/convex_hull.h"

namespace hypermap::fusion {
namespace {

// Distance over which a height's influence on a soft extreme changes by a factor of e.
constexpr double kHeightScale_m = 0.15;
// Heights beyond this have the influence of this one, so that exp() stays within the range of a
// double.
constexpr double kMaxHeight_m = 10.0;
// Two tracks are two things if at least this many frames, and this share of the detections of the
// one with fewer, show them side by side: a detector sometimes splits one thing in two. Balances
// such halves against neighbours. Depends on the detector, so both could be parameters.
constexpr int kMinApartFrames = 2;
constexpr double kMinApartShare = 0.2;

}  // namespace

Polygon Moved(const Polygon& polygon, double dx, double dy) {
  return PlanarTransform(dx, dy, 0.0) * polygon;
}

std::shared_ptr<Track> CopyToChange(const Track& track) {
  auto copy = std::make_shared<Track>(track);
  copy->but_for_odds = nullptr;
  return copy;
}

std::string Track::label() const {
  const auto best =
      std::max_element(class_mass.begin(), class_mass.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  return best == class_mass.end() ? std::string() : best->first;
}

double Track::ClassShare(const std::string& label) const {
  double sum = 0.0;
  double own = 0.0;
  for (const auto& [name, mass] : class_mass) {
    sum += mass;
    if (name == label) own = mass;
  }
  return sum > 0.0 ? own / sum : 0.0;
}

HeightRange Track::height() const {
  return {std::min(low.value(), high.value()), std::max(low.value(), high.value())};
}

void SoftExtreme::Add(double value, double w, double sign) {
  const double share =
      w * std::exp(sign * std::clamp(value, -kMaxHeight_m, kMaxHeight_m) / kHeightScale_m);
  sum += share * value;
  weight += share;
}

bool Track::IsApartFrom(const Track& other) const {
  const auto found = apart.find(other.key);
  if (found == apart.end()) return false;
  return found->second >= kMinApartFrames &&
         found->second >= kMinApartShare * std::min(hits, other.hits);
}

double Track::existence() const { return 1.0 / (1.0 + std::exp(-log_odds)); }

Point Track::shift() const {
  if (moved_weight <= 0.0) return {};
  return {-moved_sum.x / moved_weight, -moved_sum.y / moved_weight};
}

void Track::Refresh(const EvidenceParameters& parameters) {
  hull = shape.Hull(parameters.shape_threshold, parameters.shape_doubt);
  if (!hull.empty()) outline = hull;
  RefreshObject(parameters);
}

void Track::RefreshObject(const EvidenceParameters& parameters) {
  object = pinned;
  if (pinned) {
    const Polygon shown = FootprintOf(pinned->shape, kPinHalfWidth_m);
    outline = IsConvex(shown) ? shown : ConvexHull(shown.outer());
    return;
  }
  if (removed || log_odds < parameters.publish_log_odds || hits < parameters.publish_hits ||
      hull.empty()) {
    return;
  }
  auto shown = std::make_shared<SemanticObject>();
  shown->label = label();
  double sum = 0.0;
  for (const auto& [name, mass] : class_mass) sum += mass;
  for (const auto& [name, mass] : class_mass) shown->classes[name] = mass / sum;
  shown->existence = existence();
  const Point at = shift();
  shown->shape = Moved(hull, at.x, at.y);
  shown->height = height();
  shown->attributes["observations"] = static_cast<int64_t>(hits);
  object = std::move(shown);
}

double AbsorbedLogOdds(double log_odds, double other, const EvidenceParameters& parameters) {
  return std::min(parameters.max_log_odds, std::max(log_odds, other));
}

void Track::Absorb(const Track& other, const EvidenceParameters& parameters) {
  log_odds = AbsorbedLogOdds(log_odds, other.log_odds, parameters);
  hits += other.hits;
  last_hit = std::max(last_hit, other.last_hit);
  for (const auto& [name, mass] : other.class_mass) class_mass[name] += mass;
  low.sum += other.low.sum;
  low.weight += other.low.weight;
  high.sum += other.high.sum;
  high.weight += other.high.weight;
  for (const auto& [name, frames] : other.apart) {
    if (name != key) apart[name] = std::max(apart[name], frames);
  }
  apart.erase(other.key);
  shape.Absorb(other.shape);
  moved_sum.x += other.moved_sum.x;
  moved_sum.y += other.moved_sum.y;
  moved_weight += other.moved_weight;
  // The larger, not the sum: both tracks have counted much of the same frames.
  looks = std::max(looks, other.looks);
  found = std::max(found, other.found);
  clarity += other.clarity;
  if (!pinned) pinned = other.pinned;
  removed = removed || other.removed;
}

int64_t ByteSize(const Track& track) {
  // Size of a node of a map with a short string.
  constexpr size_t kBytesOfEntry = 112;
  size_t bytes = sizeof(track) + track.key.size();
  bytes += static_cast<size_t>(track.shape.bytes());
  for (const auto& [label, mass] : track.class_mass) bytes += kBytesOfEntry + label.size();
  for (const auto& [key, frames] : track.apart) bytes += kBytesOfEntry + key.size();
  const int vertices = track.hull.num_vertices() + track.outline.num_vertices();
  bytes += static_cast<size_t>(vertices) * sizeof(Point);
  for (const ObjectPtr& object : {track.pinned, track.object}) {
    if (object) bytes += static_cast<size_t>(hypermap::ByteSize(*object));
  }
  return static_cast<int64_t>(bytes);
}

}  // namespace hypermap::fusion
