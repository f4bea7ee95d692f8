#include "tests/bench/server/questions.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "map/geometry/predicates.h"
#include "tests/bench/server/map_files.h"
#include "wire/geometry.h"

namespace hypermap::bench {
namespace {

using Rng = std::mt19937_64;

double Uniform(Rng& rng, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(rng);
}

// A square whose corners are `radius_m` from its centre.
Polygon Square(const Point& centre, double radius_m, double yaw_rad) {
  Ring ring;
  for (int i = 0; i < 4; ++i) {
    const double angle = yaw_rad + i * std::numbers::pi / 2;
    ring.push_back({centre.x + radius_m * std::cos(angle), centre.y + radius_m * std::sin(angle)});
  }
  return Polygon::MakeUnchecked({std::move(ring)});
}

template <typename Request>
Calls CallsOf(const char* method, bool streamed, std::vector<Request> requests) {
  std::vector<grpc::ByteBuffer> bytes;
  for (Request& request : requests) {
    request.mutable_scope()->set_map(kSiteMap);
    bytes.push_back(ToBytes(request));
  }
  return {absl::StrCat(kQueryService, method), streamed, InTurn(std::move(bytes))};
}

// Compares the objects of one answer with the expected ones.
class Checker {
 public:
  explicit Checker(const GeneratedSite& site) : site_(site) {}

  absl::Status Check(const std::string& what, const std::vector<v1::Object>& answered,
                     const std::vector<ObjectId>& right) const {
    if (answered.size() != right.size()) {
      return absl::InternalError(
          absl::StrCat(what, ": ", answered.size(), " objects, not ", right.size()));
    }
    for (size_t i = 0; i < right.size(); ++i) {
      if (!IsObject(answered[i], right[i])) {
        return absl::InternalError(
            absl::StrCat(what, ": object ", answered[i].id(), " is not object ", right[i]));
      }
    }
    return absl::OkStatus();
  }

 private:
  bool IsObject(const v1::Object& answered, ObjectId id) const {
    if (answered.id() != id) return false;
    const SemanticObject object = site_.Object(id - 1);
    const absl::StatusOr<Shape> shape = wire::DecodeShape("shape", answered.shape());
    return answered.label() == object.label && shape.ok() && *shape == object.shape;
  }

  const GeneratedSite& site_;
};

template <typename Response>
std::vector<v1::Object> ObjectsOf(const Response& response) {
  return {response.part().objects().begin(), response.part().objects().end()};
}
std::vector<v1::Object> ObjectsOf(const v1::QueryPointResponse& response) {
  if (response.layers_size() != 1) return {};
  return {response.layers(0).objects().begin(), response.layers(0).objects().end()};
}
std::vector<v1::Object> ObjectsOf(const v1::QueryNearestResponse& response) {
  std::vector<v1::Object> objects;
  for (const v1::NearestMatch& match : response.matches()) objects.push_back(match.object());
  return objects;
}

template <typename Response>
absl::Status CheckKind(const Channels& channels, const Checker& checker, const Calls& calls,
                       const std::vector<std::vector<ObjectId>>& right) {
  const absl::StatusOr<std::vector<std::string>> answers =
      Ask(channels, calls, static_cast<int64_t>(right.size()));
  HYPERMAP_RETURN_IF_ERROR(answers.status());
  for (size_t i = 0; i < right.size(); ++i) {
    const std::string what = absl::StrCat(calls.method, " ", i);
    // Parsing the concatenated messages of a stream as one message merges their parts.
    Response response;
    if (!response.ParseFromString((*answers)[i])) return absl::InternalError(what);
    HYPERMAP_RETURN_IF_ERROR(checker.Check(what, ObjectsOf(response), right[i]));
  }
  return absl::OkStatus();
}

}  // namespace

Questions DrawQuestions(const GeneratedSite& site, int count) {
  Rng rng(20'250'805);
  Questions questions;
  for (int i = 0; i < count; ++i) {
    const Point p{Uniform(rng, 0, site.side_m()), Uniform(rng, 0, site.side_m())};
    questions.points.push_back(p);
    questions.areas.push_back(Square(p, 2.5, Uniform(rng, 0, 2 * std::numbers::pi)));
    questions.value_areas.push_back(Polygon::FromBox({{p.x - 10, p.y - 10}, {p.x + 10, p.y + 10}}));
    questions.labels.push_back(static_cast<int>(rng() % kNumLabels));
  }
  return questions;
}

Calls PointCalls(const Questions& questions) {
  std::vector<v1::QueryPointRequest> requests(questions.points.size());
  for (size_t i = 0; i < requests.size(); ++i) {
    wire::EncodePoint(questions.points[i], requests[i].mutable_point());
  }
  return CallsOf("QueryPoint", false, std::move(requests));
}

Calls AreaCalls(const Questions& questions) {
  std::vector<v1::QueryAreaRequest> requests(questions.areas.size());
  for (size_t i = 0; i < requests.size(); ++i) {
    wire::EncodePolygon(questions.areas[i], requests[i].mutable_area());
  }
  return CallsOf("QueryArea", true, std::move(requests));
}

Calls ValueCalls(const Questions& questions) {
  std::vector<v1::QueryValueRequest> requests(questions.labels.size());
  for (size_t i = 0; i < requests.size(); ++i) {
    requests[i].set_value(LabelName(questions.labels[i]));
    wire::EncodePolygon(questions.value_areas[i], requests[i].mutable_area());
  }
  return CallsOf("QueryValue", true, std::move(requests));
}

Calls NearestCalls(const Questions& questions) {
  std::vector<v1::QueryNearestRequest> requests(questions.labels.size());
  for (size_t i = 0; i < requests.size(); ++i) {
    requests[i].set_value(LabelName(questions.labels[i]));
    requests[i].set_k(kNearest);
    wire::EncodePoint(questions.points[i], requests[i].mutable_point());
  }
  return CallsOf("QueryNearest", false, std::move(requests));
}

RightAnswers AnswerByBruteForce(const GeneratedSite& site, const Questions& questions, int count) {
  RightAnswers right;
  right.points.resize(count);
  right.areas.resize(count);
  right.values.resize(count);
  std::vector<std::vector<std::pair<double, ObjectId>>> nearest(count);
  std::vector<PreparedPolygon> areas;
  std::vector<std::string> labels;
  for (int q = 0; q < count; ++q) {
    areas.emplace_back(questions.areas[q]);
    labels.push_back(LabelName(questions.labels[q]));
  }
  for (int64_t i = 0; i < site.num_objects(); ++i) {
    const SemanticObject object = site.Object(i);
    const Box& box = object.shape.bounds();
    for (int q = 0; q < count; ++q) {
      const Point& p = questions.points[q];
      if (box.Covers(p) && Covers(object.shape, p)) right.points[q].push_back(object.id);
      if (box.Intersects(questions.areas[q].bounds()) && areas[q].Intersects(object.shape)) {
        right.areas[q].push_back(object.id);
      }
      if (object.label != labels[q]) continue;
      if (box.Intersects(questions.value_areas[q].bounds()) &&
          PreparedPolygon(questions.value_areas[q]).Intersects(object.shape)) {
        right.values[q].push_back(object.id);
      }
      auto& best = nearest[q];
      if (best.size() == kNearest && Distance(box, p) > best.back().first) continue;
      best.emplace_back(Distance(object.shape, p), object.id);
      std::sort(best.begin(), best.end());
      if (best.size() > kNearest) best.pop_back();
    }
  }
  for (const auto& best : nearest) {
    auto& ids = right.nearest.emplace_back();
    for (const auto& [distance, id] : best) ids.push_back(id);
  }
  return right;
}

absl::Status CheckAnswers(const Channels& channels, const GeneratedSite& site,
                          const Questions& questions, const RightAnswers& right) {
  const Checker checker(site);
  absl::Status status =
      CheckKind<v1::QueryPointResponse>(channels, checker, PointCalls(questions), right.points);
  if (status.ok()) {
    status = CheckKind<v1::QueryAreaResponse>(channels, checker, AreaCalls(questions), right.areas);
  }
  if (status.ok()) {
    status =
        CheckKind<v1::QueryValueResponse>(channels, checker, ValueCalls(questions), right.values);
  }
  if (status.ok()) {
    status = CheckKind<v1::QueryNearestResponse>(channels, checker, NearestCalls(questions),
                                                 right.nearest);
  }
  return status;
}

}  // namespace hypermap::bench
