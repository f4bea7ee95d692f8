// What a fleet's observations cost if the network delays each by another time, so that most come
// out of order: a late observation makes newer ones be folded again.
//
// Fills a layer of a real server with objects. Then robots send frames in real time, each delayed
// at random. Reads the server's meters before and after, and its queue meanwhile. The floor is the
// same log, folded in order by one thread of this process, which also gives what the layer must
// show. The exit code is 1 if an observation was not accepted or the layer shows something else;
// goals are reported, not enforced. The last line of the output is a JSON object.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "base/metering/thread_cpu.h"
#include "base/status/status_macros.h"
#include "client_libs/bench/server_numbers.h"
#include "client_libs/cpp/client.h"
#include "map/fusion/strategy.h"
#include "tests/bench/fold_places.h"
#include "tests/support/server_process.h"
#include "tests/support/temporary_folder.h"
#include "wire/observation.h"

namespace hypermap::bench {
namespace {

constexpr char kMap[] = "site";
constexpr char kLayer[] = "things";
// Looks at each place that fill the layer: an object is shown after four detections.
constexpr int kLooks = 6;
// Time that a robot spends at a place.
constexpr absl::Duration kStay = absl::Seconds(2);
// Time after the last frame within which all must be acknowledged.
constexpr absl::Duration kPatience = absl::Minutes(3);
constexpr double kGoalFoldMs = 1.0;
constexpr double kGoalP99Ms = 300.0;

struct Options {
  std::string server;
  int robots = 50;
  double hz = 5.0;
  double seconds = 20.0;
  int objects = 10'000;
  int max_delay_ms = 500;
  unsigned seed = 1;
};

// An observation, and when it reaches the server and is acknowledged.
struct Frame {
  Observation observation;
  absl::Time arrives;
  absl::Time acknowledged = absl::InfiniteFuture();
};

// Observations that fill the layer, of one robot, in order.
std::vector<Observation> FillingObservations(const Options& options, absl::Time end) {
  std::vector<Observation> looks;
  const int places = options.objects / kBoxesOfPlace;
  for (int i = 0; i < places; ++i) {
    const FoldPlace place = MakeFoldPlace(i);
    for (int look = 0; look < kLooks; ++look) {
      fusion::SceneCamera camera = place.camera;
      camera.y += 0.05 * look;
      looks.push_back(
          fusion::Observe(place.boxes, camera, static_cast<int64_t>(looks.size()), {}, "filler"));
    }
  }
  absl::Time stamp = end - static_cast<double>(looks.size()) * absl::Milliseconds(100);
  for (Observation& look : looks) look.stamp = stamp += absl::Milliseconds(100);
  return looks;
}

// The frames of a robot that goes from one random place to another, in the order of their arrival.
// Stamps begin at the Unix epoch.
std::vector<Frame> FramesOf(const Options& options, int robot) {
  std::mt19937 random(options.seed * 1000 + static_cast<unsigned>(robot));
  const auto uniform = [&](double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random);
  };
  const absl::Duration period = absl::Seconds(1 / options.hz);
  const absl::Duration phase = uniform(0.0, 1.0) * period;
  std::vector<Frame> frames;
  absl::Duration leaves;
  FoldPlace place;
  for (absl::Duration at = phase; at < absl::Seconds(options.seconds); at += period) {
    if (at >= leaves) {
      place = MakeFoldPlace(std::min(static_cast<int>(uniform(0, options.objects / kBoxesOfPlace)),
                                     options.objects / kBoxesOfPlace - 1));
      leaves = at + kStay;
    }
    fusion::SceneCamera camera = place.camera;
    camera.y += uniform(-0.2, 0.2);
    const fusion::SceneDetector detector = {.score = uniform(0.5, 0.95),
                                            .pose_error_x = uniform(-0.02, 0.02),
                                            .pose_error_y = uniform(-0.02, 0.02)};
    Frame frame;
    frame.observation = fusion::Observe(place.boxes, camera, static_cast<int64_t>(frames.size()),
                                        detector, absl::StrCat("robot ", robot));
    frame.observation.stamp = absl::UnixEpoch() + at;
    frame.arrives =
        frame.observation.stamp + absl::Milliseconds(uniform(0.0, options.max_delay_ms));
    frames.push_back(std::move(frame));
  }
  std::stable_sort(frames.begin(), frames.end(),
                   [](const Frame& a, const Frame& b) { return a.arrives < b.arrives; });
  return frames;
}

// Sends observations as fast as the server takes them.
absl::Status SendAll(client::Client& client, const std::vector<Observation>& observations) {
  HYPERMAP_ASSIGN_OR_RETURN(const auto stream, client.Observe(kMap, kLayer));
  std::thread writer([&] {
    for (const Observation& observation : observations) {
      if (!stream->Write(observation)) return;
    }
    stream->WritesDone();
  });
  size_t accepted = 0;
  while (const auto acknowledgement = stream->Read()) {
    accepted += acknowledgement->outcome == client::ObservationOutcome::kAccepted;
  }
  writer.join();
  HYPERMAP_RETURN_IF_ERROR(stream->status());
  if (accepted == observations.size()) return absl::OkStatus();
  return absl::InternalError(absl::StrCat(accepted, " of ", observations.size(), " accepted"));
}

// A robot: sends its frames when they arrive, and notes when they are acknowledged.
class Sender {
 public:
  Sender(client::Client& client, std::vector<Frame>* frames) : frames_(frames) {
    auto stream = client.Observe(kMap, kLayer);
    if (!stream.ok()) {
      status_ = stream.status();
      return;
    }
    stream_ = *std::move(stream);
    writer_ = std::thread([this] {
      for (const Frame& frame : *frames_) {
        absl::SleepFor(frame.arrives - absl::Now());
        if (!stream_->Write(frame.observation)) return;
      }
      stream_->WritesDone();
    });
    reader_ = std::thread([this] {
      while (const auto acknowledgement = stream_->Read()) {
        if (acknowledgement->outcome != client::ObservationOutcome::kAccepted) continue;
        const auto it = std::find_if(frames_->begin(), frames_->end(), [&](const Frame& frame) {
          return frame.observation.sequence == acknowledgement->sequence;
        });
        it->acknowledged = absl::Now();
        ++accepted_;
      }
      status_ = stream_->status();
      ended_ = true;
    });
  }
  ~Sender() { End().IgnoreError(); }

  bool has_ended() const { return ended_; }
  void Cancel() {
    if (stream_) stream_->Cancel();
  }
  absl::Status End() {
    if (writer_.joinable()) writer_.join();
    if (reader_.joinable()) reader_.join();
    return status_;
  }
  int accepted() const { return accepted_; }

 private:
  std::vector<Frame>* const frames_;
  std::unique_ptr<client::ObserveStream> stream_;
  absl::Status status_;
  std::thread writer_;
  std::thread reader_;
  std::atomic<int> accepted_ = 0;
  std::atomic<bool> ended_ = false;
};

// The meters of the server.
class Meters {
 public:
  // `log` is the server's, which names the address of the metrics.
  static absl::StatusOr<Meters> Of(const std::string& log) {
    std::ifstream file(log);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    const std::vector<std::string> parts = absl::StrSplit(text, "metrics are served address=");
    if (parts.size() != 2) return absl::InternalError("the log names no address of metrics");
    return Meters(std::vector<std::string>(absl::StrSplit(parts[1], absl::ByAnyChar(" \n")))[0]);
  }

  // The value of a meter of the map; 0 if there is none.
  double Read(const std::string& name) const { return ReadAll({name})[0]; }
  std::vector<double> ReadAll(const std::vector<std::string>& names) const {
    const std::string text = GetMetrics(address_, absl::Seconds(10)).value_or("");
    std::vector<double> values(names.size(), 0.0);
    for (size_t i = 0; i < names.size(); ++i) {
      const std::string line = absl::StrCat("\n", names[i], "{map=\"", kMap, "\"} ");
      const size_t at = text.find(line);
      if (at == std::string::npos) continue;
      const std::string rest = text.substr(at + line.size(), 40);
      if (!absl::SimpleAtod(rest.substr(0, rest.find('\n')), &values[i])) values[i] = 0.0;
    }
    return values;
  }

 private:
  explicit Meters(std::string address) : address_(std::move(address)) {}

  std::string address_;
};

// The objects of the layer without their ids, in an order of their content.
std::vector<std::string> Sorted(std::vector<SemanticObject> objects) {
  std::vector<std::string> encoded;
  for (SemanticObject& object : objects) {
    object.id = 0;
    object.version = 0;
    encoded.push_back(wire::ObjectToBytes(object));
  }
  std::sort(encoded.begin(), encoded.end());
  return encoded;
}

absl::StatusOr<std::vector<std::string>> Shown(client::Client& client) {
  std::vector<SemanticObject> objects;
  client::AnswerReader answer =
      client.QueryArea(kMap, Polygon::FromBox({{-1e5, -1e5}, {1e5, 1e5}}));
  for (client::LayerPart& part : answer) {
    std::move(part.objects.begin(), part.objects.end(), std::back_inserter(objects));
  }
  HYPERMAP_RETURN_IF_ERROR(answer.status());
  return Sorted(std::move(objects));
}

struct InOrder {
  double fold_ms = 0.0;  // CPU time for each of the robots' observations
  std::vector<std::string> objects;
};

// Folds the log in order.
absl::StatusOr<InOrder> FoldInOrder(const std::vector<Observation>& filling,
                                    const std::vector<std::vector<Frame>>& robots) {
  const auto strategy =
      fusion::MakeStrategy("evidence", fusion::ParametersOfNewLayer("evidence", ""));
  HYPERMAP_RETURN_IF_ERROR(strategy.status());
  fusion::StatePtr state = (*strategy)->Initial();
  // As a server has them, which stores and decodes them.
  const auto fold = [&](const Observation& observation) -> absl::Status {
    HYPERMAP_ASSIGN_OR_RETURN(const Observation stored,
                              wire::ObservationFromBytes(wire::ObservationToBytes(observation)));
    state = (*strategy)->Fold(state, stored, nullptr);
    return absl::OkStatus();
  };
  for (const Observation& observation : filling) HYPERMAP_RETURN_IF_ERROR(fold(observation));
  std::vector<const Observation*> log;
  for (const auto& frames : robots) {
    for (const Frame& frame : frames) log.push_back(&frame.observation);
  }
  std::sort(log.begin(), log.end(),
            [](const auto* a, const auto* b) { return KeyOf(*a) < KeyOf(*b); });
  const absl::Duration begin = ThreadCpuTime();
  for (const Observation* observation : log) HYPERMAP_RETURN_IF_ERROR(fold(*observation));
  const absl::Duration took = ThreadCpuTime() - begin;
  std::vector<SemanticObject> objects;
  for (const auto& fused : (*strategy)->Objects(state)) objects.push_back(*fused.object);
  return InOrder{absl::ToDoubleMilliseconds(took) / static_cast<double>(log.size()),
                 Sorted(std::move(objects))};
}

// What the queue of the writer had at most while this lived.
class QueueSampler {
 public:
  explicit QueueSampler(const Meters& meters)
      : thread_([this, &meters] {
          while (!stop_) {
            const std::vector<double> queue =
                meters.ReadAll({"hypermap_map_queue_submissions", "hypermap_map_queue_bytes"});
            submissions_ = std::max(submissions_, queue[0]);
            bytes_ = std::max(bytes_, queue[1]);
            absl::SleepFor(absl::Milliseconds(50));
          }
        }) {}
  void Stop() {
    stop_ = true;
    thread_.join();
  }
  double submissions() const { return submissions_; }
  double bytes() const { return bytes_; }

 private:
  std::atomic<bool> stop_ = false;
  double submissions_ = 0.0;
  double bytes_ = 0.0;
  std::thread thread_;
};

absl::StatusOr<nlohmann::json> Measure(const Options& options, client::Client& client,
                                       const Meters& meters, const testing::ServerProcess& server) {
  std::vector<std::vector<Frame>> robots;
  for (int i = 0; i < options.robots; ++i) robots.push_back(FramesOf(options, i));
  const absl::Time first_filling = absl::Now() - absl::Minutes(1);
  const std::vector<Observation> filling = FillingObservations(options, first_filling);
  HYPERMAP_RETURN_IF_ERROR(SendAll(client, filling));

  const std::vector<std::string> kWork = {
      "hypermap_map_folded_observations_total", "hypermap_map_fold_cpu_seconds_total",
      "hypermap_map_commits_total", "hypermap_map_repeated_folds_total"};
  const std::vector<double> before = meters.ReadAll(kWork);
  const absl::Duration cpu_before = server.CpuTime();
  const absl::Duration begin = absl::Now() + absl::Seconds(1) - absl::UnixEpoch();
  absl::Time end = absl::InfinitePast();
  int sent = 0;
  for (auto& frames : robots) {
    for (Frame& frame : frames) {
      frame.observation.stamp += begin;
      frame.arrives += begin;
      end = std::max(end, frame.arrives);
      ++sent;
    }
  }
  QueueSampler queue(meters);
  std::vector<std::unique_ptr<Sender>> senders;
  for (auto& frames : robots) senders.push_back(std::make_unique<Sender>(client, &frames));
  const auto all_ended = [&] {
    return std::all_of(senders.begin(), senders.end(),
                       [](const auto& sender) { return sender->has_ended(); });
  };
  while (!all_ended() && absl::Now() < end + kPatience) absl::SleepFor(absl::Milliseconds(10));
  int accepted = 0;
  for (const auto& sender : senders) {
    sender->Cancel();
    const absl::Status status = sender->End();
    if (!status.ok()) std::fprintf(stderr, "%s\n", status.ToString().c_str());
    accepted += sender->accepted();
  }
  queue.Stop();
  const absl::Duration cpu = server.CpuTime() - cpu_before;
  const std::vector<double> after = meters.ReadAll(kWork);

  std::vector<double> waits_ms;
  for (const auto& frames : robots) {
    for (const Frame& frame : frames) {
      waits_ms.push_back(absl::ToDoubleMilliseconds(frame.acknowledged - frame.arrives));
    }
  }
  std::sort(waits_ms.begin(), waits_ms.end());
  const auto quantile = [&](double q) {
    return waits_ms[static_cast<size_t>(q * static_cast<double>(waits_ms.size() - 1))];
  };
  HYPERMAP_ASSIGN_OR_RETURN(const InOrder in_order, FoldInOrder(filling, robots));
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<std::string> shown, Shown(client));
  const double fold_ms = 1e3 * (after[1] - before[1]) / accepted;
  return nlohmann::json{
      {"robots", options.robots},
      {"hz", options.hz},
      {"max_delay_ms", options.max_delay_ms},
      {"objects", in_order.objects.size()},
      {"sent", sent},
      {"accepted", accepted},
      {"folds_per_observation", (after[0] - before[0]) / accepted},
      {"repeats_per_observation", (after[3] - before[3]) / accepted},
      {"fold_cpu_ms", fold_ms},
      {"in_order_fold_cpu_ms", in_order.fold_ms},
      {"ratio", fold_ms / in_order.fold_ms},
      {"server_cpu_ms", absl::ToDoubleMilliseconds(cpu) / accepted},
      {"observations_per_revision", accepted / std::max(1.0, after[2] - before[2])},
      {"queue_most", queue.submissions()},
      {"queue_most_bytes", queue.bytes()},
      {"p50_ms", quantile(0.5)},
      {"p99_ms", quantile(0.99)},
      {"identical", shown == in_order.objects},
      {"holds", accepted == sent && fold_ms <= kGoalFoldMs && quantile(0.99) <= kGoalP99Ms &&
                    shown == in_order.objects}};
}

absl::Status Run(const Options& options) {
  const testing::TemporaryFolder folder;
  testing::ServerProcess server({options.server, absl::StrCat("--data_dir=", folder / "data"),
                                 "--metrics_listen=127.0.0.1:0"},
                                folder / "server.log");
  HYPERMAP_RETURN_IF_ERROR(server.Start());
  HYPERMAP_ASSIGN_OR_RETURN(const Meters meters, Meters::Of(folder / "server.log"));
  client::Client client(server.address());
  HYPERMAP_RETURN_IF_ERROR(client.CreateMap(kMap).status());
  HYPERMAP_RETURN_IF_ERROR(client.CreateLayer(kMap, {.name = kLayer}).status());
  HYPERMAP_ASSIGN_OR_RETURN(const nlohmann::json result, Measure(options, client, meters, server));
  std::printf(
      "%d robots at %.0f Hz, each frame delayed by 0 to %d ms, %d objects: goals (all "
      "accepted, fold <= %.0f ms, p99 <= %.0f ms, identical) %s\n",
      options.robots, options.hz, options.max_delay_ms, options.objects, kGoalFoldMs, kGoalP99Ms,
      result["holds"].get<bool>() ? "hold" : "missed");
  std::cout << result.dump() << "\n";
  if (result["accepted"] == result["sent"] && result["identical"].get<bool>()) {
    return absl::OkStatus();
  }
  return absl::InternalError("observations are missing, or the layer is not the fold of its log");
}

}  // namespace
}  // namespace hypermap::bench

int main(int argc, char** argv) {
  hypermap::bench::Options options;
  CLI::App app("Folds the observations of a fleet that a network delays at random.");
  app.add_option("--server", options.server, "Path of hypermapd")->required();
  app.add_option("--robots", options.robots, "Number of robots")->capture_default_str();
  app.add_option("--hz", options.hz, "Frames per second of each")->capture_default_str();
  app.add_option("--seconds", options.seconds, "Seconds that they send")->capture_default_str();
  app.add_option("--objects", options.objects, "Number of objects of the layer")
      ->capture_default_str();
  app.add_option("--max_delay_ms", options.max_delay_ms, "Longest delay of a frame")
      ->capture_default_str();
  app.add_option("--seed", options.seed, "Seed of places and delays")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const absl::Status status = hypermap::bench::Run(options);
  if (status.ok()) return EXIT_SUCCESS;
  std::fprintf(stderr, "%s\n", status.ToString().c_str());
  return EXIT_FAILURE;
}
