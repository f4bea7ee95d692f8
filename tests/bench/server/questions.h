// Queries to a generated site, and their answers by brute force.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_QUESTIONS_H_
#define HYPERMAP_TESTS_BENCH_SERVER_QUESTIONS_H_

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "hypermap/v1/query_service.pb.h"
#include "map/geometry/polygon.h"
#include "tests/bench/server/generated_site.h"
#include "tests/bench/server/load.h"

namespace hypermap::bench {

inline constexpr char kQueryService[] = "/hypermap.v1.QueryService/";
inline constexpr int kNearest = 5;

// Random queries all over the site, the same for every run. Query i of each kind is at index i.
struct Questions {
  std::vector<Point> points;
  std::vector<Polygon> areas;        // rotated squares with a diagonal of 5 m
  std::vector<Polygon> value_areas;  // squares of 20 m
  std::vector<int> labels;           // wanted in value_areas, and nearest to points
};
Questions DrawQuestions(const GeneratedSite& site, int count);

Calls PointCalls(const Questions& questions);
Calls AreaCalls(const Questions& questions);
Calls ValueCalls(const Questions& questions);
Calls NearestCalls(const Questions& questions);

// Right answers to the first queries of each kind: ids in ascending order, for nearest in order of
// distance. Computed by testing every object of the site.
struct RightAnswers {
  std::vector<std::vector<ObjectId>> points;
  std::vector<std::vector<ObjectId>> areas;
  std::vector<std::vector<ObjectId>> values;
  std::vector<std::vector<ObjectId>> nearest;
};
RightAnswers AnswerByBruteForce(const GeneratedSite& site, const Questions& questions, int count);

// Makes the first queries of each kind. INTERNAL naming the first one whose answer has other
// objects, labels or shapes than the site.
absl::Status CheckAnswers(const Channels& channels, const GeneratedSite& site,
                          const Questions& questions, const RightAnswers& right);

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_QUESTIONS_H_
