// Cost of durable maps, measured in turns with bare SQLite that writes only the rows that the same
// tables need: a first load, batches, single edits, many callers at once, opening.
//
//    storage_bench [--objects=100000] [--edits=400] [--batches=5] [--dir=FOLDER]
#include <sys/resource.h>
#include <time.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "map/edits/apply.h"
#include "map/layers/semantic_layer.h"
#include "server/session/map_session.h"
#include "storage/encoding/geometry_blob.h"
#include "storage/geopackage/geopackage_store.h"
#include "tests/bench/bare_map.h"

namespace hypermap {
namespace {

constexpr char kLayer[] = "objects";

struct Cost {
  double cpu_us = 0;
  double wall_us = 0;

  Cost& operator+=(const Cost& other) {
    cpu_us += other.cpu_us;
    wall_us += other.wall_us;
    return *this;
  }
  Cost Per(double count) const { return {cpu_us / count, wall_us / count}; }
};

double Now_us(clockid_t clock) {
  timespec now;
  clock_gettime(clock, &now);
  return now.tv_sec * 1e6 + now.tv_nsec * 1e-3;
}

// Cost of `work` for this thread or the whole process.
template <typename Work>
Cost Measure(Work work, clockid_t clock = CLOCK_THREAD_CPUTIME_ID) {
  const double cpu_us = Now_us(clock);
  const double wall_us = Now_us(CLOCK_MONOTONIC);
  work();
  return {Now_us(clock) - cpu_us, Now_us(CLOCK_MONOTONIC) - wall_us};
}

void Check(const absl::Status& status) {
  if (status.ok()) return;
  std::fprintf(stderr, "%s\n", status.ToString().c_str());
  std::exit(1);
}

template <typename T>
T Must(absl::StatusOr<T> result) {
  Check(result.status());
  return *std::move(result);
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

// Objects of a site with one object per five square metres, the same in each run.
class Generator {
 public:
  explicit Generator(int64_t num_objects) : side_m_(std::sqrt(num_objects / 0.2)) {}

  int64_t num_made() const { return num_made_; }

  SemanticObject Next() {
    ++num_made_;
    const double radius_m = Uniform(0, 1) < 0.0005 ? Uniform(2, 5) : Uniform(0.15, 1.0);
    const Point centre{Uniform(0, side_m_), Uniform(0, side_m_)};
    const int num_vertices = std::uniform_int_distribution<int>(5, 12)(rng_);
    Ring ring;
    for (int i = 0; i < num_vertices; ++i) {
      const double angle = 2 * M_PI * (i + Uniform(0, 0.8)) / num_vertices;
      const double r_m = radius_m * Uniform(0.6, 1);
      ring.push_back({centre.x + r_m * std::cos(angle), centre.y + r_m * std::sin(angle)});
    }
    SemanticObject object;
    object.label = "class_" + std::to_string(std::uniform_int_distribution<int>(10, 89)(rng_));
    object.existence = Uniform(0.3, 1);
    object.shape = Polygon::MakeUnchecked({std::move(ring)});
    return object;
  }

 private:
  double Uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(rng_);
  }

  const double side_m_;
  int64_t num_made_ = 0;
  std::mt19937_64 rng_{5};
};

std::vector<SemanticObject> Take(Generator& generator, int count) {
  std::vector<SemanticObject> objects;
  for (int i = 0; i < count; ++i) objects.push_back(generator.Next());
  return objects;
}

// Rows in strips of the site, in a serpentine, so that neighbours in space are neighbours in the
// table.
std::vector<BareRow> SortedRows(std::vector<SemanticObject> objects, int64_t first_id) {
  const auto strip_of = [](const SemanticObject& object) {
    return std::floor(object.shape.bounds().min.x / 10);
  };
  std::sort(objects.begin(), objects.end(), [&](const auto& a, const auto& b) {
    if (strip_of(a) != strip_of(b)) return strip_of(a) < strip_of(b);
    return a.shape.bounds().min.y < b.shape.bounds().min.y;
  });
  std::vector<BareRow> rows;
  for (const SemanticObject& object : objects) {
    rows.push_back(
        {first_id++, storage::EncodeGeometryBlob(object.shape), object.label, object.existence});
  }
  return rows;
}

// A stored map with the snapshot that a session would hold.
class OurMap {
 public:
  OurMap(storage::MapStore* store, const std::string& name)
      : stored_(Must(store->Create({name, "map", absl::Now(), ""}))),
        snapshot_(Must(stored_->Load())) {}

  Cost Commit(EditBatch batch) {
    storage::Commit commit;
    batch.time = absl::Now();
    commit.applied = Must(Apply(*snapshot_, batch));
    commit.author = "bench";
    commit.time = batch.time;
    snapshot_ = commit.applied.snapshot;
    return Measure([&] { Check(stored_->Write({commit})); });
  }

  Cost Put(std::vector<SemanticObject> objects) {
    EditBatch batch;
    for (SemanticObject& object : objects) {
      batch.edits.push_back(PutObject{kLayer, std::move(object), "", false, {}, {}});
    }
    return Commit(std::move(batch));
  }

  // Puts existing objects again, shifted.
  Cost PutAgain(const std::vector<ObjectId>& ids, double shift_m) {
    const auto& layer = static_cast<const SemanticLayer&>(*snapshot_->FindLayer(kLayer));
    std::vector<SemanticObject> objects;
    for (const ObjectId id : ids) {
      objects.push_back(*layer.Find(id));
      objects.back().shape = PlanarTransform(shift_m, 0, 0) * objects.back().shape;
    }
    return Put(std::move(objects));
  }

  void MakeLayer() {
    LayerSpec spec;
    spec.name = kLayer;
    EditBatch batch;
    batch.edits.push_back(CreateLayer{spec});
    Commit(std::move(batch));
  }

 private:
  std::unique_ptr<storage::StoredMap> stored_;
  SnapshotPtr snapshot_;
};

void Print(const char* what, const Cost& ours, const Cost& bare) {
  std::printf("%-28s ours %8.2f us CPU %8.2f us wall   bare %8.2f %8.2f   ratio %5.2f %5.2f\n",
              what, ours.cpu_us, ours.wall_us, bare.cpu_us, bare.wall_us, ours.cpu_us / bare.cpu_us,
              ours.wall_us / bare.wall_us);
  std::fflush(stdout);
}

// Creates an empty map of ours with the layer, and opens it as a BareMap.
std::unique_ptr<BareMap> MakeBareMap(storage::MapStore* store, const std::string& folder) {
  OurMap(store, "bare").MakeLayer();
  return std::make_unique<BareMap>(folder + "/bare.gpkg", kLayer);
}

Cost PutBare(BareMap* bare, std::vector<SemanticObject> objects) {
  const std::vector<BareRow> rows = SortedRows(std::move(objects), bare->next_id());
  return Measure([&] { bare->Commit(rows.data(), rows.data() + rows.size()); });
}

void CompareBatches(OurMap* ours, BareMap* bare, Generator* generator, int size, int repeats) {
  Cost our_cost, bare_cost;
  for (int i = 0; i < repeats; ++i) {
    std::vector<SemanticObject> objects = Take(*generator, size);
    bare_cost += PutBare(bare, objects);
    our_cost += ours->Put(std::move(objects));
  }
  const double count = double(size) * repeats;
  Print(("batches of " + std::to_string(size) + ", an object").c_str(), our_cost.Per(count),
        bare_cost.Per(count));
}

void CompareSingles(OurMap* ours, BareMap* bare, Generator* generator, int edits) {
  std::vector<Cost> our_costs, bare_costs;
  for (int i = 0; i < edits; ++i) {
    std::vector<SemanticObject> objects = Take(*generator, 1);
    bare_costs.push_back(PutBare(bare, objects));
    our_costs.push_back(ours->Put(std::move(objects)));
  }
  const auto median = [](const std::vector<Cost>& costs) {
    std::vector<double> cpu, wall;
    for (const Cost& cost : costs) {
      cpu.push_back(cost.cpu_us);
      wall.push_back(cost.wall_us);
    }
    return Cost{Median(cpu), Median(wall)};
  };
  const auto mean = [](const std::vector<Cost>& costs) {
    Cost sum;
    for (const Cost& cost : costs) sum += cost;
    return sum.Per(costs.size());
  };
  Print("single puts, median", median(our_costs), median(bare_costs));
  Print("single puts, mean", mean(our_costs), mean(bare_costs));
}

void MeasureReplacing(OurMap* ours, int64_t num_objects, int edits) {
  std::mt19937_64 rng(7);
  Cost cost;
  for (int i = 0; i < edits; ++i) {
    const auto id = std::uniform_int_distribution<int64_t>(1, num_objects)(rng);
    cost += ours->PutAgain({id}, 0.01);
  }
  cost = cost.Per(edits);
  std::printf("%-28s ours %8.2f us CPU %8.2f us wall\n", "single replacements, mean", cost.cpu_us,
              cost.wall_us);
}

// Edits per second of callers that each wait for their answer before the next edit.
double EditsPerSecond(server::MapSession* session, Generator* generator, int num_callers,
                      int edits_each) {
  std::vector<std::vector<SemanticObject>> objects;
  for (int i = 0; i < num_callers; ++i) objects.push_back(Take(*generator, edits_each));
  const Cost cost = Measure(
      [&] {
        std::vector<std::thread> callers;
        for (int i = 0; i < num_callers; ++i) {
          callers.emplace_back([&, i] {
            for (SemanticObject& object : objects[i]) {
              server::Submission submission;
              submission.batch.edits.push_back(
                  PutObject{kLayer, std::move(object), "", false, {}, {}});
              submission.author = "bench";
              Check(session->SubmitAndWait(std::move(submission)).status());
            }
          });
        }
        for (std::thread& caller : callers) caller.join();
      },
      CLOCK_PROCESS_CPUTIME_ID);
  const double count = double(num_callers) * edits_each;
  std::printf("%2d callers: %8.0f edits/s, %7.2f us CPU an edit (the whole process)\n", num_callers,
              count / cost.wall_us * 1e6, cost.Per(count).cpu_us);
  std::fflush(stdout);
  return count / cost.wall_us * 1e6;
}

void MeasureCallers(std::unique_ptr<storage::StoredMap> stored, Generator* generator, int edits) {
  std::unique_ptr<server::MapSession> session =
      Must(server::MapSession::Start(std::move(stored), server::SessionOptions()));
  std::vector<double> ratios;
  for (int i = 0; i < 3; ++i) {
    const double one = EditsPerSecond(session.get(), generator, 1, edits);
    const double many = EditsPerSecond(session.get(), generator, 16, edits);
    ratios.push_back(many / one);
  }
  std::printf("16 callers / one: %.2f\n", Median(ratios));
}

void Run(int64_t num_objects, int edits, int batches, const std::string& folder) {
  std::unique_ptr<storage::MapStore> store = Must(storage::OpenGeoPackageStore(folder));
  Generator generator(num_objects);
  {
    OurMap ours(store.get(), "ours");
    ours.MakeLayer();
    std::unique_ptr<BareMap> bare = MakeBareMap(store.get(), folder);
    std::vector<SemanticObject> objects = Take(generator, num_objects);
    const Cost bare_cost = PutBare(bare.get(), objects);
    const Cost our_cost = ours.Put(std::move(objects));
    Print("first load, an object", our_cost.Per(num_objects), bare_cost.Per(num_objects));
    for (const int size : {10'000, 1'000, 16}) {
      if (batches > 0) CompareBatches(&ours, bare.get(), &generator, size, batches);
    }
    CompareSingles(&ours, bare.get(), &generator, edits);
    MeasureReplacing(&ours, num_objects, edits);
  }
  std::unique_ptr<storage::StoredMap> stored;
  const Cost open = Measure([&] { stored = Must(store->Open("ours")); });
  SnapshotPtr snapshot;
  const Cost load = Measure([&] { snapshot = Must(stored->Load()); });
  const auto& layer = static_cast<const SemanticLayer&>(*snapshot->FindLayer(kLayer));
  std::vector<ObjectPtr> objects = layer.Objects();
  const auto size = static_cast<int64_t>(objects.size());
  if (size != generator.num_made()) {
    Check(absl::InternalError("the map has not what was put into it"));
  }
  const Cost index = Measure([&] { SemanticLayer(layer.spec(), std::move(objects)); });
  std::printf(
      "open %.3f s CPU, load %.3f s CPU %.3f s wall: %.2f us CPU an object, %.2f of them "
      "the index in memory\n",
      open.cpu_us * 1e-6, load.cpu_us * 1e-6, load.wall_us * 1e-6, load.cpu_us / size,
      index.cpu_us / size);
  std::fflush(stdout);
  snapshot.reset();
  MeasureCallers(std::move(stored), &generator, edits);
}

}  // namespace
}  // namespace hypermap

int main(int argc, char** argv) {
  int64_t num_objects = 100'000;
  int edits = 400;
  int batches = 5;
  std::string parent = std::filesystem::temp_directory_path().string();
  for (int i = 1; i < argc; ++i) {
    const auto value = [&](const char* flag) {
      const size_t length = std::strlen(flag);
      return std::strncmp(argv[i], flag, length) == 0 ? argv[i] + length : nullptr;
    };
    if (const char* text = value("--objects=")) num_objects = std::atoll(text);
    if (const char* text = value("--edits=")) edits = std::atoi(text);
    if (const char* text = value("--batches=")) batches = std::atoi(text);
    if (const char* text = value("--dir=")) parent = text;
  }
  std::string folder = parent + "/storage_bench_XXXXXX";
  if (mkdtemp(folder.data()) == nullptr) return 1;
  hypermap::Run(num_objects, edits, batches, folder);
  std::filesystem::remove_all(folder);
  return 0;
}
