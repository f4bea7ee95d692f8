#include "map/fusion/evidence_codec.h"

#include <stdexcept>
#include <utility>
#include <vector>

#include "map/fusion/state_codec.h"
#include "map/geometry/coordinates.h"

namespace hypermap::fusion {
namespace {

using nlohmann::json;

constexpr int kVersion = 1;

json EncodeShape(const ShapeGrid& shape) {
  const CellBox& box = shape.box();
  return {{"resolution", shape.resolution_m()},
          {"box", {box.row_begin, box.row_end, box.col_begin, box.col_end}},
          {"hits", EncodeFloats(shape.hits())},
          {"misses", EncodeFloats(shape.misses())}};
}

// The corners of cells are vertices of outlines, so that they must be valid ones.
void CheckPlace(double resolution_m, const CellBox& cells) {
  const std::vector<Point> corners = {
      {cells.col_begin * resolution_m, cells.row_begin * resolution_m},
      {cells.col_end * resolution_m, cells.row_end * resolution_m}};
  if (!(resolution_m > 0.0 && resolution_m <= kMaxCoordinate_m) ||
      !CheckVertices("corners", corners).ok()) {
    throw std::runtime_error("a shape whose cells are nowhere");
  }
}

ShapeGrid DecodeShape(const json& encoded) {
  const json& box = encoded.at("box");
  const CellBox cells{box.at(0).get<int32_t>(), box.at(1).get<int32_t>(), box.at(2).get<int32_t>(),
                      box.at(3).get<int32_t>()};
  auto hits = DecodeFloats(encoded.at("hits"));
  auto misses = DecodeFloats(encoded.at("misses"));
  if (hits.size() != static_cast<size_t>(cells.num_cells()) || misses.size() != hits.size()) {
    throw std::runtime_error("a shape whose cells are not its box's");
  }
  const auto resolution_m = encoded.at("resolution").get<double>();
  CheckPlace(resolution_m, cells);
  return ShapeGrid::FromRaw(resolution_m, cells, std::move(hits), std::move(misses));
}

json EncodeExtreme(const SoftExtreme& extreme) { return {extreme.sum, extreme.weight}; }

SoftExtreme DecodeExtreme(const json& encoded) {
  return {encoded.at(0).get<double>(), encoded.at(1).get<double>()};
}

json EncodeView(const View& view) {
  return {{"robot", view.robot},
          {"stamp_ns", absl::ToUnixNanos(view.stamp)},
          {"position", {view.position.x(), view.position.y(), view.position.z()}},
          {"axis", {view.axis.x(), view.axis.y(), view.axis.z()}},
          {"detections", view.num_detections},
          {"centre", {view.centre.x, view.centre.y}}};
}

Eigen::Vector3d DecodeVector(const json& encoded) {
  return {encoded.at(0).get<double>(), encoded.at(1).get<double>(), encoded.at(2).get<double>()};
}

// States of earlier versions have no views.
RecentViews DecodeViews(const json& content) {
  std::vector<View> views;
  for (const json& encoded : content.value("views", json::array())) {
    if (views.size() == RecentViews::kMost) throw std::runtime_error("too many views");
    views.push_back(
        {encoded.at("robot").get<std::string>(),
         absl::FromUnixNanos(encoded.at("stamp_ns").get<int64_t>()),
         DecodeVector(encoded.at("position")),
         DecodeVector(encoded.at("axis")),
         encoded.at("detections").get<int32_t>(),
         {encoded.at("centre").at(0).get<double>(), encoded.at("centre").at(1).get<double>()}});
  }
  return RecentViews(std::move(views));
}

json EncodeTrack(const Track& track) {
  json encoded = {{"key", track.key},
                  {"log_odds", track.log_odds},
                  {"hits", track.hits},
                  {"last_hit_ns", absl::ToUnixNanos(track.last_hit)},
                  {"classes", track.class_mass},
                  {"low", EncodeExtreme(track.low)},
                  {"high", EncodeExtreme(track.high)},
                  {"shape", EncodeShape(track.shape)},
                  {"moved", {track.moved_sum.x, track.moved_sum.y, track.moved_weight}},
                  {"looks", track.looks},
                  {"found", track.found},
                  {"clarity", track.clarity},
                  {"apart", track.apart},
                  {"removed", track.removed},
                  // Its hull may be gone, so that it can't be recomputed as the other derived
                  // members are.
                  {"outline", EncodePolygon(track.outline)}};
  if (track.pinned) encoded["pinned"] = EncodeObject(*track.pinned);
  return encoded;
}

Track DecodeTrack(const json& encoded) {
  Track track;
  encoded.at("key").get_to(track.key);
  encoded.at("log_odds").get_to(track.log_odds);
  encoded.at("hits").get_to(track.hits);
  track.last_hit = absl::FromUnixNanos(encoded.at("last_hit_ns").get<int64_t>());
  encoded.at("classes").get_to(track.class_mass);
  track.low = DecodeExtreme(encoded.at("low"));
  track.high = DecodeExtreme(encoded.at("high"));
  track.shape = DecodeShape(encoded.at("shape"));
  const json& moved = encoded.at("moved");
  track.moved_sum = {moved.at(0).get<double>(), moved.at(1).get<double>()};
  track.moved_weight = moved.at(2).get<double>();
  encoded.at("looks").get_to(track.looks);
  encoded.at("found").get_to(track.found);
  encoded.at("clarity").get_to(track.clarity);
  encoded.at("apart").get_to(track.apart);
  encoded.at("removed").get_to(track.removed);
  track.outline = DecodePolygon(encoded.at("outline"));
  if (encoded.contains("pinned")) {
    track.pinned = std::make_shared<SemanticObject>(DecodeObject(encoded["pinned"]));
  }
  return track;
}

}  // namespace

std::string EncodeEvidence(const EvidenceState& state) {
  json tracks = json::array();
  state.tracks.ForEach([&](const TrackPtr& track) { tracks.push_back(EncodeTrack(*track)); });
  json views = json::array();
  for (const View& view : state.views.views()) views.push_back(EncodeView(view));
  return EncodeState("evidence", kVersion,
                     {{"tracks", std::move(tracks)},
                      {"scores", state.ranks.counts()},
                      {"views", std::move(views)}});
}

absl::StatusOr<std::shared_ptr<const EvidenceState>> DecodeEvidence(
    absl::string_view bytes, const EvidenceParameters& parameters) {
  auto state = std::make_shared<EvidenceState>();
  const auto status = DecodeState("evidence", kVersion, bytes, [&](const json& content) {
    state->ranks = ScoreRanks(content.at("scores").get<ScoreRanks::Counts>());
    state->views = DecodeViews(content);
    for (const json& encoded : content.at("tracks")) {
      auto track = std::make_shared<Track>(DecodeTrack(encoded));
      track->Refresh(parameters);
      state->tracks.push_back(std::move(track));
    }
  });
  if (!status.ok()) return status;
  return state;
}

}  // namespace hypermap::fusion
