#include "map/fusion/evidence_fold.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "map/fusion/alignment.h"
#include "map/fusion/lookout.h"
#include "map/geometry/convex_hull.h"
#include "map/geometry/overlap.h"
#include "map/matching/assignment.h"

namespace hypermap::fusion {
namespace {

// Alignment compares at most about this many cells of each detection, which bounds the cost of
// large ones.
constexpr size_t kMaxAlignmentCells = 64;
// Most cells along a side of a new shape; larger things get larger cells. A shape that grows may
// have twice as many.
constexpr double kMaxCellsAside = 400.0;
// Detections farther than this from the frame's origin are left out: the rows and columns of their
// cells would exceed the range of ShapeGrid.
constexpr double kFarthest_m = 5e6;

// Tracks this close to the view are candidates, because alignment may move detections onto them; it
// moves at most 45 cm along an axis (alignment.cc).
constexpr double kViewMargin_m = 0.5;
// Shorter ranges of heights are widened to this, as depth noise would otherwise separate views of a
// thin thing. Depends on the sensor, so it could be a parameter.
constexpr double kMinHeightRange_m = 0.10;

// Widens outlines for alignment: small things that the pose error moved off their track overlap it
// only then. Balances them against neighbours of the same class.
constexpr double kAlignmentMargin_m = 0.08;
// Least IoU of outlines for alignment. Balances wrong neighbours against fewer references.
constexpr double kMinAlignmentIou = 0.25;
// Only tracks that probably exist (62 %) are references: others may be errors of earlier frames.
constexpr double kMinReferenceLogOdds = 0.5;
// Added to the covariance of a pose, since one that claims to be exact has no inverse: standard
// deviations of 1 mm and 0.1 mrad, well below the steps of the search.
constexpr double kAddedPositionVariance_m2 = 1e-6;
constexpr double kAddedYawVariance_rad2 = 1e-8;
// Most that outlines are widened for association. Balances poor poses against distinct neighbours.
// It caps EvidenceParameters::buffer_m, so it could be a parameter beside that.
constexpr double kMaxBuffer_m = 0.05;

// A class with a smaller share of a track's evidence counts as another class. Balances things whose
// class the detector confuses against neighbours of another class.
constexpr double kMinClassShare = 0.25;
// Factor of a score for another class; for the track's own, it rises with the class's share to 1.
// Balances the class against the overlap.
constexpr double kOtherClassFactor = 0.5;
// Factor of containment where it stands in for IoU: it wins over a poor overlap, not a good one.
constexpr double kContainmentFactor = 0.5;
// Assignment takes integers as costs, so scores are rounded down to a millionth.
constexpr double kCostPerScore = 1e6;

// Below even odds (27 %): a single detection may be clutter. With hit_gain, it decides how soon an
// object is shown, so it could be a parameter.
constexpr double kFoundingLogOdds = -1.0;
// Added to a detection's weight as evidence for its class: the weight is about position and shape,
// and even a detection of low weight is evidence for its class.
constexpr double kAddedClassWeight = 0.2;
// Added to the novelty of each view, which is little, as a view from a moment later has the same
// localisation error. Balances the number of views against the time that they span.
constexpr double kAddedNovelty = 0.05;

// A shape gets coarse cells when its extent exceeds fine_extent_m by this factor, which keeps
// shapes near the limit from being resampled for a little noise.
constexpr double kCoarsenFactor = 1.3;
// Shares of a track's range of heights at which a footprint's places are looked up. Balances things
// that are only there at some heights against the cost; the ends of the range are estimates.
constexpr std::array<double, 3> kShapeHeights = {0.25, 0.5, 0.85};

// Visibility is looked up at about 12 x 12 places, at these shares of the range of heights. They
// suffice, and bound the cost of large things.
constexpr double kVisibilityPlacesAside = 12.0;
constexpr std::array<double, 3> kVisibilityHeights = {0.3, 0.6, 0.9};
// Least distance between these places, so that small things get fewer.
constexpr double kMinVisibilityStep_m = 0.02;
// If a smaller share of a track is visible, it is mostly hidden, and the frame says nothing about
// it. Balances forgetting things at the border of the view against losing hidden ones.
constexpr double kMinVisible = 0.3;
// If a larger share of a track's visible part is empty, so is its place. Balances things that one
// can partly look past against things that are gone.
constexpr double kMinEmptyShare = 0.75;
// Range at which perception's weight is a half (docs/fusion.md). Must be that of
// ingest/perception/weight.cc, since Miss compares views with the weights of detections.
constexpr double kHalfWeightRange_m = 1.8;
// Least clarity to compare a view with: tracks that an operator founded have none. Also reduces the
// effect of misses on things that were only detected from farther than about 5.7 m.
constexpr double kMinClarity = 0.01;
// Bounds of a track's detection rate, which bound the loss of a miss. With the default parameters
// they have no effect: the loss is max_miss_loss from a rate of 0.71 on, and none below 0.2.
constexpr double kMinDetectionRate = 0.1;
constexpr double kMaxDetectionRate = 0.9;

// Detections within this distance are side by side (Track::apart). Balances the number of entries
// against things so large that they overlap all the same; for these it could be a parameter.
constexpr double kSideBySide_m = 0.5;
// Least detections of two tracks together to take them for parts of one thing. Balances merging
// parts soon against neighbours not yet detected in one frame. Depends on the detector, so it could
// be a parameter.
constexpr int kMinPartsHits = 6;

// Returns the index of the lowest (then leftmost) vertex. From there, the edges of a
// counter-clockwise convex ring come in the order of their directions, as Widened needs them.
size_t LowestVertex(const Ring& ring) {
  const auto lower = [](const Point& a, const Point& b) {
    return std::pair(a.y, a.x) < std::pair(b.y, b.x);
  };
  return static_cast<size_t>(std::min_element(ring.begin(), ring.end(), lower) - ring.begin());
}

// Widens a convex polygon by `margin_m` on all sides: its Minkowski sum with an octagon. The edges
// of the sum are those of both polygons, merged by direction; the octagon begins at its lowest
// vertex, too.
Polygon Widened(const Polygon& convex, double margin_m) {
  const double diagonal = margin_m * std::sqrt(0.5);
  const Ring octagon = {{0.0, -margin_m},     {diagonal, -diagonal}, {margin_m, 0.0},
                        {diagonal, diagonal}, {0.0, margin_m},       {-diagonal, diagonal},
                        {-margin_m, 0.0},     {-diagonal, -diagonal}};
  if (convex.empty() || margin_m <= 0.0) return convex;
  const Ring& ring = convex.outer();
  const size_t n = ring.size();
  const size_t first = LowestVertex(ring);
  const auto at = [&](size_t i) { return ring[(first + i) % n]; };
  const auto turn = [&](size_t i) { return octagon[i % octagon.size()]; };
  Ring sum;
  sum.reserve(n + octagon.size());
  for (size_t i = 0, k = 0; i < n || k < octagon.size();) {
    sum.push_back({at(i).x + turn(k).x, at(i).y + turn(k).y});
    const Point a{at(i + 1).x - at(i).x, at(i + 1).y - at(i).y};
    const Point b{turn(k + 1).x - turn(k).x, turn(k + 1).y - turn(k).y};
    const double cross = a.x * b.y - a.y * b.x;
    const bool take_a = k == octagon.size() || (i < n && cross >= 0.0);
    const bool take_b = i == n || (k < octagon.size() && cross <= 0.0);
    if (take_a) ++i;
    if (take_b) ++k;
  }
  return Polygon::MakeUnchecked({std::move(sum)});
}

std::string BestLabel(const Detection& detection, double* score) {
  std::string best;
  *score = 0.0;
  for (const auto& [label, value] : detection.scores) {
    if (value > *score) {
      best = label;
      *score = value;
    }
  }
  return best;
}

double Extent(const Box& box) { return std::max(box.max.x - box.min.x, box.max.y - box.min.y); }

// Returns the share of the shorter range of heights that both have in common, with ranges of at
// least kMinHeightRange_m.
double HeightOverlap(HeightRange a, HeightRange b) {
  const auto thicken = [](HeightRange* h) {
    const double lack = kMinHeightRange_m - (h->high_m - h->low_m);
    if (lack <= 0.0) return;
    h->low_m -= 0.5 * lack;
    h->high_m += 0.5 * lack;
  };
  thicken(&a);
  thicken(&b);
  const double common = std::min(a.high_m, b.high_m) - std::max(a.low_m, b.low_m);
  return std::max(0.0, common) / std::min(a.high_m - a.low_m, b.high_m - b.low_m);
}

// A detection, moved by the frame's alignment.
struct Sighting {
  const Detection* detection = nullptr;
  int index = 0;
  std::string label;
  double score = 0.0;
  Polygon hull;
  Polygon widened;
};

// A track near enough to the frame's view to be affected by it.
struct Candidate {
  size_t index = 0;  // In the state; SIZE_MAX for a new track.
  std::shared_ptr<Track> track;
  Polygon widened;
  bool hit = false;
  int sighting = -1;  // Index of the sighting that hit it; -1 if none.
};

// Folds one observation. Changes copies of the tracks near the view; the state shares all others.
class Folding {
 public:
  Folding(const EvidenceState& before, const Observation& observation,
          const EvidenceParameters& parameters, FoldReport* report)
      : before_(before), observation_(observation), p_(parameters), report_(report) {}

  // The steps are those of docs/fusion.md. CountApart precedes Merge, which must not join tracks
  // that this frame detected side by side.
  std::shared_ptr<const EvidenceState> Run() {
    Look();
    AlignFrame();
    Associate();
    Miss();
    CountApart();
    Merge();
    return Result();
  }

 private:
  // Collects the frame's detections, and copies of the tracks near its view.
  void Look();
  // Finds the motion that aligns the frame with the tracks, and moves the detections by it.
  void AlignFrame();
  // Assigns detections to tracks one to one, founds tracks for the others, and adds the evidence.
  void Associate();
  // Takes existence from tracks that the frame should have detected.
  void Miss();
  // Whether this frame detected the two tracks separately, with the same class.
  bool BesideEachOther(const Candidate& a, const Candidate& b) const;
  void CountApart();
  // Merges tracks that overlap too much to be two things.
  void Merge();
  std::shared_ptr<const EvidenceState> Result();

  // Returns how well the two agree, in [0, 1]; 0 if they can't be the same thing.
  double Score(const Sighting& sighting, const Candidate& candidate) const;
  void Hit(const Sighting& sighting, Candidate* candidate, double agreement);
  void AddShape(const Sighting& sighting, Track* track);
  // Returns a new track without evidence, whose key names the detection.
  std::shared_ptr<Track> Found(const Sighting& sighting) const;
  // Shares in [0, 1]: how much of the track would be visible if it were there, and how much was
  // seen to be empty.
  struct Visibility {
    double visible = 0.0;
    double empty = 0.0;
  };
  Visibility VisibilityOf(const Track& track) const;

  const EvidenceState& before_;
  const Observation& observation_;
  const EvidenceParameters& p_;
  FoldReport* const report_;

  double buffer_m_ = 0.0;
  Observation aligned_;  // Only pose and depth are set.
  Eigen::Vector3d motion_ = Eigen::Vector3d::Zero();
  Point pivot_;
  std::vector<Sighting> sightings_;
  std::vector<Candidate> candidates_;
  std::optional<Lookout> lookout_;
  std::vector<TrackKey> gone_;
};

void Folding::Look() {
  Box box = observation_.view_hull.bounds();
  for (const Detection& detection : observation_.detections) box.Extend(detection.hull.bounds());
  if (box.empty()) return;
  box.Extend(Point{box.min.x - kViewMargin_m, box.min.y - kViewMargin_m});
  box.Extend(Point{box.max.x + kViewMargin_m, box.max.y + kViewMargin_m});
  for (size_t i = 0; i < before_.tracks.size(); ++i) {
    if (!before_.tracks[i]->outline.bounds().Intersects(box)) continue;
    candidates_.push_back({i, std::make_shared<Track>(*before_.tracks[i]), {}, false, -1});
  }
  for (size_t i = 0; i < observation_.detections.size(); ++i) {
    const Box& bounds = observation_.detections[i].hull.bounds();
    if (Distance(Box{{0.0, 0.0}, {0.0, 0.0}}, bounds.min) > kFarthest_m ||
        Distance(Box{{0.0, 0.0}, {0.0, 0.0}}, bounds.max) > kFarthest_m) {
      continue;
    }
    Sighting sighting;
    sighting.detection = &observation_.detections[i];
    sighting.index = static_cast<int>(i);
    sighting.label = BestLabel(*sighting.detection, &sighting.score);
    const Polygon& hull = sighting.detection->hull;
    sighting.hull = IsConvex(hull) ? hull : ConvexHull(hull.outer());
    sightings_.push_back(std::move(sighting));
  }
}

void Folding::AlignFrame() {
  const Eigen::Vector3d camera = observation_.pose.frame_from_camera.translation();
  pivot_ = {camera.x(), camera.y()};
  std::vector<AlignmentPair> pairs;
  for (const Sighting& sighting : sightings_) {
    const Polygon wide = Widened(sighting.hull, kAlignmentMargin_m);
    const Candidate* best = nullptr;
    double best_iou = kMinAlignmentIou;
    for (const Candidate& candidate : candidates_) {
      if (candidate.track->log_odds < kMinReferenceLogOdds ||
          candidate.track->label() != sighting.label) {
        continue;
      }
      if (!wide.bounds().Intersects(candidate.track->outline.bounds())) continue;
      const double iou = Iou(wide, Widened(candidate.track->outline, kAlignmentMargin_m));
      if (iou > best_iou) {
        best_iou = iou;
        best = &candidate;
      }
    }
    if (!best) continue;
    AlignmentPair pair;
    pair.track = best->track.get();
    pair.weight = sighting.detection->weight;
    const CellPatch& patch = sighting.detection->cells;
    size_t total = 0;
    for (const CellSpan& span : patch.spans) {
      total += static_cast<size_t>(span.col_end - span.col_begin);
    }
    const size_t every = total / kMaxAlignmentCells + 1;
    size_t count = 0;
    for (const CellSpan& span : patch.spans) {
      const auto length = static_cast<size_t>(span.col_end - span.col_begin);
      const size_t skipped = (every - count % every) % every;
      count += length;
      for (size_t k = skipped; k < length; k += every) {
        const int32_t col = span.col_begin + static_cast<int32_t>(k);
        pair.cells.push_back(patch.frame_from_cells * Point{(col + 0.5) * patch.resolution_m,
                                                            (span.row + 0.5) * patch.resolution_m});
      }
    }
    if (!pair.cells.empty()) pairs.push_back(std::move(pair));
  }
  if (!pairs.empty() && p_.align_gain > 0.0) {
    Eigen::Matrix3d prior = observation_.pose.covariance;
    prior(0, 0) += kAddedPositionVariance_m2;
    prior(1, 1) += kAddedPositionVariance_m2;
    prior(2, 2) += kAddedYawVariance_rad2;
    motion_ = Align(pairs, pivot_, prior, p_);
  }
  // Alignment removes most of the pose's error; outlines are widened by the rest.
  const double sigma =
      std::sqrt(0.5 * (observation_.pose.covariance(0, 0) + observation_.pose.covariance(1, 1)));
  buffer_m_ = std::min(kMaxBuffer_m, p_.buffer_m + p_.buffer_share * sigma);
  for (Sighting& sighting : sightings_) {
    Ring ring;
    for (const Point& p : sighting.hull.outer()) ring.push_back(Apply(motion_, pivot_, p));
    sighting.hull = Polygon::MakeUnchecked({std::move(ring)});
    sighting.widened = Widened(sighting.hull, buffer_m_);
  }
  for (Candidate& candidate : candidates_) {
    const Box& bounds = candidate.track->outline.bounds();
    const bool near = std::any_of(sightings_.begin(), sightings_.end(), [&](const Sighting& s) {
      return s.widened.bounds().Intersects(
          Box{{bounds.min.x - buffer_m_, bounds.min.y - buffer_m_},
              {bounds.max.x + buffer_m_, bounds.max.y + buffer_m_}});
    });
    if (near) candidate.widened = Widened(candidate.track->outline, buffer_m_);
  }
  aligned_.pose = observation_.pose;
  aligned_.pose.frame_from_camera.linear() =
      Eigen::AngleAxisd(motion_.z(), Eigen::Vector3d::UnitZ()) *
      observation_.pose.frame_from_camera.linear();
  aligned_.pose.frame_from_camera.translation() += Eigen::Vector3d(motion_.x(), motion_.y(), 0.0);
  aligned_.depth = observation_.depth;
  if (aligned_.depth) lookout_.emplace(aligned_, p_.margin_m);
}

double Folding::Score(const Sighting& sighting, const Candidate& candidate) const {
  const Track& track = *candidate.track;
  if (!sighting.widened.bounds().Intersects(candidate.widened.bounds())) return 0.0;
  if (HeightOverlap(sighting.detection->height, track.height()) < p_.height_overlap) return 0.0;
  const double common = IntersectionArea(sighting.widened, candidate.widened);
  if (common <= 0.0) return 0.0;
  const double a = Area(sighting.widened);
  const double b = Area(candidate.widened);
  const double iou = common / (a + b - common);
  const double share = track.ClassShare(sighting.label);
  if (share > kMinClassShare) {
    const double contained = common / std::min(a, b);
    double overlap = iou;
    if (contained > p_.containment) overlap = std::max(overlap, kContainmentFactor * contained);
    const double factor = kOtherClassFactor + (1.0 - kOtherClassFactor) * share;
    return overlap >= p_.gate ? overlap * factor : 0.0;
  }
  return iou >= p_.other_class_gate ? kOtherClassFactor * iou : 0.0;
}

void Folding::Associate() {
  const size_t rows = sightings_.size();
  const size_t columns = candidates_.size();
  if (rows == 0) return;
  // A column for each candidate, and a column "new track" for each sighting. A pair that fails the
  // gates costs 1, more than the 0 of a new track, so that it is never chosen.
  std::vector<double> scores(rows * columns, 0.0);
  std::vector<evaluation::Cost> costs(rows * (columns + rows));
  for (size_t r = 0; r < rows; ++r) {
    for (size_t c = 0; c < columns; ++c) {
      const double score = Score(sightings_[r], candidates_[c]);
      scores[r * columns + c] = score;
      costs[r * (columns + rows) + c].first =
          score > 0.0 ? -static_cast<int64_t>(score * kCostPerScore) : int64_t{1};
    }
  }
  const auto columns_of = evaluation::CheapestAssignment(rows, columns + rows, costs);
  const size_t existing = candidates_.size();
  for (size_t r = 0; r < rows; ++r) {
    const size_t c = columns_of[r];
    if (c < existing && scores[r * columns + c] > 0.0) {
      Hit(sightings_[r], &candidates_[c], scores[r * columns + c]);
    }
  }
  for (size_t r = 0; r < rows; ++r) {
    const size_t c = columns_of[r];
    if (c < existing && scores[r * columns + c] > 0.0) continue;
    Candidate founded;
    founded.index = SIZE_MAX;
    founded.track = Found(sightings_[r]);
    candidates_.push_back(std::move(founded));
    Hit(sightings_[r], &candidates_.back(), 1.0);
  }
}

std::shared_ptr<Track> Folding::Found(const Sighting& sighting) const {
  auto track = std::make_shared<Track>();
  track->key = absl::StrCat(observation_.robot, "/", observation_.sequence, "/", sighting.index);
  const double extent = Extent(sighting.hull.bounds());
  track->shape =
      ShapeGrid(extent < p_.fine_extent_m ? p_.fine_cell_m
                                          : std::max(p_.coarse_cell_m, extent / kMaxCellsAside));
  track->log_odds = kFoundingLogOdds;
  return track;
}

void Folding::Hit(const Sighting& sighting, Candidate* candidate, double agreement) {
  Track& track = *candidate->track;
  candidate->hit = true;
  candidate->sighting = static_cast<int>(&sighting - sightings_.data());
  const double gain = p_.hit_gain + p_.score_gain * (before_.ranks.Rank(sighting.score) - 0.5);
  track.log_odds = std::min(p_.max_log_odds, track.log_odds + gain);
  ++track.hits;
  track.looks += 1.0;
  track.found += 1.0;
  track.clarity += sighting.detection->weight;
  for (const auto& [label, score] : sighting.detection->scores) {
    track.class_mass[label] += score * (kAddedClassWeight + sighting.detection->weight);
  }
  const double weight = sighting.detection->weight;
  track.low.Add(sighting.detection->height.low_m, weight, -1.0);
  track.high.Add(sighting.detection->height.high_m, weight, 1.0);
  const double since = absl::ToDoubleSeconds(observation_.stamp - track.last_hit);
  const double novelty =
      weight * (kAddedNovelty + std::min(1.0, std::max(0.0, since) / p_.correlation_s));
  const Point middle = Centroid(sighting.detection->hull);
  const Point moved = Apply(motion_, pivot_, middle);
  track.moved_sum.x += novelty * (moved.x - middle.x);
  track.moved_sum.y += novelty * (moved.y - middle.y);
  track.moved_weight += novelty;
  track.last_hit = observation_.stamp;
  AddShape(sighting, &track);
  track.Refresh(p_);
  if (report_) {
    report_->associations.push_back({sighting.index, track.key, agreement});
    report_->existence[track.key] = track.existence();
  }
}

void Folding::AddShape(const Sighting& sighting, Track* track) {
  ShapeGrid& shape = track->shape;
  Box extent = sighting.hull.bounds();
  extent.Extend(track->outline.bounds());
  if (shape.resolution_m() < p_.coarse_cell_m &&
      Extent(extent) > kCoarsenFactor * p_.fine_extent_m) {
    // A track founded on a glimpse may turn out to be of a large thing. Coarser cells bound its
    // cost.
    shape = shape.Resampled(p_.coarse_cell_m);
  }
  while (Extent(extent) > 2.0 * kMaxCellsAside * shape.resolution_m()) {
    shape = shape.Resampled(2.0 * shape.resolution_m());
  }
  const auto weight = static_cast<float>(sighting.detection->weight);
  const double res = shape.resolution_m();
  std::vector<CellSpan> spans;
  CellBox box;
  ForEachSpan(sighting.hull, res, [&](int32_t row, int32_t begin, int32_t end) {
    spans.push_back({row, begin, end});
    box = box.Union({row, row + 1, begin, end});
  });
  if (spans.empty()) return;
  shape.Reserve(box);
  const CellBox whole = shape.box();
  size_t next = 0;
  const HeightRange band = track->height();
  // A place is part of the footprint if the thing is there at any height of its range, so several
  // heights are looked up.
  std::array<double, kShapeHeights.size()> heights;
  for (size_t i = 0; i < heights.size(); ++i) {
    heights[i] = band.low_m + kShapeHeights[i] * (band.high_m - band.low_m);
  }
  for (int32_t row = whole.row_begin; row < whole.row_end; ++row) {
    int32_t begin = 0;
    int32_t end = 0;
    if (next < spans.size() && spans[next].row == row) {
      begin = spans[next].col_begin;
      end = spans[next].col_end;
      ++next;
    }
    for (int32_t col = whole.col_begin; col < whole.col_end; ++col) {
      const CellIndex cell{row, col};
      if (col >= begin && col < end) {
        shape.AddHit(cell, weight);
        continue;
      }
      // Cells without a hit have an occupancy of 0 anyway.
      if (!lookout_ || shape.hit(cell) <= 0.0f) continue;
      const Point at = shape.CentreOf(cell);
      int seen = 0;
      int against = 0;
      for (const double height : heights) {
        uint8_t owner = 0;
        const Sight sight = lookout_->At(at.x, at.y, height, &owner);
        if (sight == Sight::kEmpty) ++against;
        // A surface outside of the detection's mask belongs to something else.
        if (sight == Sight::kSurface && owner != sighting.index + 1) ++against;
        if (sight == Sight::kEmpty || sight == Sight::kSurface) ++seen;
      }
      if (seen > 0) {
        shape.AddMiss(cell, static_cast<float>(p_.miss_weight * against / seen) * weight);
      }
    }
  }
}

Folding::Visibility Folding::VisibilityOf(const Track& track) const {
  Visibility visibility;
  const double step =
      std::max(kMinVisibilityStep_m, Extent(track.outline.bounds()) / kVisibilityPlacesAside);
  const HeightRange band = track.height();
  int total = 0;
  int visible = 0;
  int empty = 0;
  ForEachSpan(track.outline, step, [&](int32_t row, int32_t begin, int32_t end) {
    for (int32_t col = begin; col < end; ++col) {
      for (const double share : kVisibilityHeights) {
        const double height = band.low_m + share * (band.high_m - band.low_m);
        const Sight sight = lookout_->At((col + 0.5) * step, (row + 0.5) * step, height, nullptr);
        ++total;
        visible += sight == Sight::kEmpty || sight == Sight::kSurface;
        empty += sight == Sight::kEmpty;
      }
    }
  });
  if (total > 0) {
    visibility.visible = static_cast<double>(visible) / total;
    visibility.empty = static_cast<double>(empty) / total;
  }
  return visibility;
}

void Folding::Miss() {
  if (!lookout_) return;
  for (Candidate& candidate : candidates_) {
    Track& track = *candidate.track;
    if (candidate.hit || track.pinned) continue;
    const Visibility visibility = VisibilityOf(track);
    if (visibility.visible < kMinVisible) continue;
    // Weigh the view by how clear it is (perception's weight for this range, times the visible
    // part) compared with the usual view that detected the thing: a cup missed from 6 m means
    // little.
    const Point middle = Centroid(track.outline);
    const Eigen::Vector3d eye = aligned_.pose.frame_from_camera.translation();
    const HeightRange band = track.height();
    const double range = std::hypot(middle.x - eye.x(), middle.y - eye.y(),
                                    0.5 * (band.low_m + band.high_m) - eye.z());
    const double r = range / kHalfWeightRange_m;
    const double usual = track.clarity / std::max(1, track.hits);
    const double clear =
        std::min(1.0, visibility.visible / (1.0 + r * r * r * r) / std::max(kMinClarity, usual));
    // Log-odds of a missed detection (Thrun et al. 2005, section 9.2), with the track's own
    // detection rate so far (Laplace's rule of succession).
    const double found =
        std::clamp((track.found + 1.0) / (track.looks + 2.0), kMinDetectionRate, kMaxDetectionRate);
    const double missed = std::min(p_.max_miss_loss, std::log((1.0 - p_.clutter) / (1.0 - found)));
    const bool empty = visibility.empty > kMinEmptyShare * visibility.visible;
    track.log_odds -= clear * std::max(missed, empty ? p_.empty_loss : 0.0);
    track.looks += clear;
    if (track.log_odds < p_.delete_log_odds) gone_.push_back(track.key);
    track.RefreshObject(p_);
    if (report_) {
      report_->missed.push_back(track.key);
      report_->existence[track.key] = track.existence();
    }
  }
}

bool Folding::BesideEachOther(const Candidate& a, const Candidate& b) const {
  if (a.sighting < 0 || b.sighting < 0 || a.sighting == b.sighting) return false;
  return sightings_[a.sighting].label == sightings_[b.sighting].label;
}

void Folding::CountApart() {
  for (Candidate& a : candidates_) {
    if (a.sighting < 0) continue;
    for (const Candidate& b : candidates_) {
      if (b.sighting < 0 || a.sighting == b.sighting) continue;
      const Polygon& hull_b = sightings_[b.sighting].hull;
      const Box& bounds_a = sightings_[a.sighting].hull.bounds();
      if (Distance(bounds_a, Centroid(hull_b)) > kSideBySide_m) continue;
      if (BesideEachOther(a, b)) ++a.track->apart[b.track->key];
    }
  }
}

void Folding::Merge() {
  const double margin_m = p_.merge_buffer_share * buffer_m_;
  for (size_t i = 0; i < candidates_.size(); ++i) {
    Candidate& a = candidates_[i];
    if (!a.track || !a.hit || a.track->outline.empty()) continue;
    Polygon wide_a;
    for (size_t j = 0; j < candidates_.size(); ++j) {
      Candidate& b = candidates_[j];
      if (i == j || !b.track || b.track->outline.empty()) continue;
      if (!a.track->outline.bounds().Intersects(b.track->outline.bounds())) continue;
      if (HeightOverlap(a.track->height(), b.track->height()) < p_.height_overlap) continue;
      if (a.track->IsApartFrom(*b.track) || BesideEachOther(a, b)) continue;
      if (wide_a.empty()) wide_a = Widened(a.track->outline, margin_m);
      const Polygon wide_b = Widened(b.track->outline, margin_m);
      const double common = IntersectionArea(wide_a, wide_b);
      if (common <= 0.0) continue;
      const double area_a = Area(wide_a);
      const double area_b = Area(wide_b);
      const double iou = common / (area_a + area_b - common);
      const double contained = common / std::min(area_a, area_b);
      const bool same = a.track->label() == b.track->label();
      // Never side by side in enough detections: parts of one thing.
      const bool parts = same && !a.track->apart.count(b.track->key) &&
                         a.track->hits + b.track->hits >= kMinPartsHits &&
                         (iou > p_.merge_parts_iou || contained > p_.merge_parts_containment);
      if (!(same && (iou > p_.merge_iou || contained > p_.merge_containment)) && !parts &&
          !(iou > p_.merge_any_class_iou)) {
        continue;
      }
      // Keep the track with more detections.
      Candidate& from = a.track->hits > b.track->hits ? b : a;
      Candidate& into = a.track->hits > b.track->hits ? a : b;
      if (report_) report_->merged.emplace_back(from.track->key, into.track->key);
      gone_.push_back(from.track->key);
      into.track->Absorb(*from.track, p_);
      into.track->Refresh(p_);
      into.hit = true;
      from.track = nullptr;
      wide_a = {};
      if (&from == &a) break;
    }
  }
}

std::shared_ptr<const EvidenceState> Folding::Result() {
  auto after = std::make_shared<EvidenceState>();
  after->tracks = before_.tracks;
  after->ranks = before_.ranks;
  // Only now, so that all detections of the frame are ranked against the same scores.
  for (const Sighting& sighting : sightings_) after->ranks.Add(sighting.score);
  for (const Candidate& candidate : candidates_) {
    const bool gone = !candidate.track || candidate.track->log_odds < p_.delete_log_odds;
    if (candidate.index == SIZE_MAX) {
      if (!gone) after->tracks.push_back(candidate.track);
    } else if (gone) {
      after->tracks[candidate.index] = nullptr;
    } else {
      after->tracks[candidate.index] = candidate.track;
    }
  }
  std::erase(after->tracks, nullptr);
  if (report_) {
    for (const TrackKey& key : gone_) report_->existence[key] = 0.0;
  }
  return after;
}

}  // namespace

std::shared_ptr<const EvidenceState> FoldEvidence(const EvidenceState& before,
                                                  const Observation& observation,
                                                  const EvidenceParameters& parameters,
                                                  FoldReport* report) {
  return Folding(before, observation, parameters, report).Run();
}

}  // namespace hypermap::fusion
