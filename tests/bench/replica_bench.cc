// Compares the cost of queries to a robot's replica with queries to the same map in this process.
//
// Loads a site of generated objects into a real server, mirrors it, and queries the replica and a
// map that was never on a server at the same points in turns. Both answer in two ways: with objects
// that are shared with the map, and with copies, like the answers of a client. Times are CPU time
// of the querying thread, medians of paired rounds. The exit code is 1 if the answers differ; goals
// are reported, not enforced.
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/status/status_macros.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/replica/replica.h"
#include "map/layers/semantic_layer.h"
#include "map/query/query.h"
#include "tests/bench/server/generated_site.h"
#include "tests/support/random_map.h"
#include "tests/support/server_process.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::bench {
namespace {

constexpr char kMap[] = "site";
constexpr char kLayer[] = "things";
constexpr int64_t kObjectsPerBatch = 2000;
constexpr double kGoalUs = 5.0;
constexpr double kGoalRatio = 1.1;

struct Options {
  std::string server;
  int64_t objects = 100'000;
  int points = 20'000;
  int rounds = 31;
};

double ThreadCpuSeconds() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double Median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

absl::Status Load(client::Client& client, const GeneratedSite& site) {
  absl::Status status = client.CreateMap(kMap).status();
  if (status.ok()) status = client.CreateLayer(kMap, {.name = kLayer}).status();
  for (int64_t begin = 0; status.ok() && begin < site.num_objects(); begin += kObjectsPerBatch) {
    EditBatch batch;
    const int64_t end = std::min(begin + kObjectsPerBatch, site.num_objects());
    for (int64_t i = begin; i < end; ++i) {
      SemanticObject object = site.Object(i);
      object.id = 0;  // the server assigns the same id
      batch.edits.push_back(PutObject{kLayer, std::move(object)});
    }
    status = client.ApplyEdits(kMap, batch).status();
  }
  return status;
}

SnapshotPtr InProcess(const GeneratedSite& site) {
  std::vector<ObjectPtr> objects;
  for (int64_t i = 0; i < site.num_objects(); ++i) {
    objects.push_back(std::make_shared<SemanticObject>(site.Object(i)));
  }
  auto snapshot = std::make_shared<Snapshot>();
  snapshot->map_name = kMap;
  LayerSpec spec{.name = kLayer, .frame_id = "map"};
  snapshot->layers[kLayer] = std::make_shared<SemanticLayer>(spec, std::move(objects));
  return snapshot;
}

// A way to query, its times, and the total number of objects that it found.
struct Way {
  const char* name;
  std::function<int64_t(const Point&)> ask;
  std::vector<double> seconds = {};  // for each round, per point
  int64_t found = 0;
};

// The median of the ratios of times in the same round.
double RatioOf(const Way& way, const Way& other) {
  std::vector<double> ratios;
  for (size_t i = 0; i < way.seconds.size(); ++i) {
    ratios.push_back(way.seconds[i] / other.seconds[i]);
  }
  return Median(ratios);
}

void Print(const Way& way, const std::string& note = "") {
  std::printf("%-44s %7.3f us%s\n", way.name, 1e6 * Median(way.seconds), note.c_str());
}

std::vector<Point> RandomPoints(int count, double side_m) {
  testing::Rng rng(1);
  std::vector<Point> points;
  for (int i = 0; i < count; ++i) {
    points.push_back({testing::Uniform(rng, 0, side_m), testing::Uniform(rng, 0, side_m)});
  }
  return points;
}

int64_t CountShared(const Snapshot& snapshot, const Point& p) {
  return static_cast<int64_t>(ContentAt(snapshot, {}, p)->front().content.objects.size());
}

int64_t CountCopies(const Snapshot& snapshot, const Point& p) {
  std::vector<SemanticObject> copies;
  const auto contents = ContentAt(snapshot, {}, p);
  for (const ObjectPtr& object : contents->front().content.objects) copies.push_back(*object);
  return static_cast<int64_t>(copies.size());
}

absl::Status Measure(const Options& options, const GeneratedSite& site,
                     const client::Replica& replica) {
  const std::vector<Point> points = RandomPoints(options.points, site.side_m());
  const SnapshotPtr map = InProcess(site);
  Way ways[] = {
      {"the map in the process, objects shared", [&](auto& p) { return CountShared(*map, p); }},
      {"Replica::snapshot, taken for each point",
       [&](auto& p) { return CountShared(*replica.snapshot(), p); }},
      {"the map in the process, objects copied", [&](auto& p) { return CountCopies(*map, p); }},
      {"Replica::QueryPoint",
       [&](auto& p) {
         return static_cast<int64_t>(replica.QueryPoint(p)->layers.front().objects.size());
       }},
  };
  for (int round = 0; round <= options.rounds; ++round) {
    for (Way& way : ways) {
      const double begin = ThreadCpuSeconds();
      for (const Point& p : points) way.found += way.ask(p);
      const double seconds = (ThreadCpuSeconds() - begin) / static_cast<double>(points.size());
      if (round > 0) way.seconds.push_back(seconds);  // the first warms up
    }
  }
  for (const Way& way : ways) {
    if (way.found == ways[0].found && way.found > 0) continue;
    return absl::InternalError(
        absl::StrCat(way.name, " found ", way.found, " objects, the map ", ways[0].found));
  }
  std::printf("point query at %lld objects, median of %d paired rounds of %d points\n",
              static_cast<long long>(site.num_objects()), options.rounds, options.points);
  const auto& [shared, pinned, copied, asked] = ways;
  const double ratio = RatioOf(asked, copied);
  const bool holds = 1e6 * Median(asked.seconds) <= kGoalUs && ratio <= kGoalRatio;
  Print(shared);
  Print(pinned, absl::StrFormat("  x%.3f", RatioOf(pinned, shared)));
  Print(copied);
  Print(asked, absl::StrFormat("  x%.3f  goal: %.0f us, x%.1f: %s", ratio, kGoalUs, kGoalRatio,
                               holds ? "holds" : "misses"));
  return absl::OkStatus();
}

absl::Status Run(const Options& options) {
  const testing::TemporaryFolder folder;
  testing::ServerProcess server(
      {options.server, absl::StrCat("--data_dir=", folder / "data"), "--log_level=warn"},
      folder / "server.log");
  HYPERMAP_RETURN_IF_ERROR(server.Start());
  client::Client client(server.address());
  const GeneratedSite site(options.objects);
  HYPERMAP_RETURN_IF_ERROR(Load(client, site));
  const auto replica = client::Replica::Open(client, {.map = kMap, .folder = folder / "replica"});
  HYPERMAP_RETURN_IF_ERROR(replica.status());
  return Measure(options, site, **replica);
}

}  // namespace
}  // namespace hypermap::bench

int main(int argc, char** argv) {
  hypermap::bench::Options options;
  CLI::App app("Compares queries of a robot's replica with queries of a map in the same process.");
  app.add_option("--server", options.server, "Path of hypermapd")->required();
  app.add_option("--objects", options.objects, "Number of objects of the site")
      ->capture_default_str();
  app.add_option("--points", options.points, "Number of points per round")->capture_default_str();
  app.add_option("--rounds", options.rounds, "Number of measured rounds")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const absl::Status status = hypermap::bench::Run(options);
  if (status.ok()) return EXIT_SUCCESS;
  std::fprintf(stderr, "%s\n", status.ToString().c_str());
  return EXIT_FAILURE;
}
