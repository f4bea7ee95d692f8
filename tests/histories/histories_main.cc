// hypermap_histories: runs simulated histories of a server and its robots, each in one thread and
// under one seed, and checks the promises at each step. The last line is one JSON object with the
// counts and "holds". The exit code is 0 if it holds.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "base/logging/log.h"
#include "tests/histories/history.h"

namespace hypermap::histories {
namespace {

const std::map<std::string, Plant> kPlants = {{"none", Plant::kNone},
                                              {"skip_sync", Plant::kSkipSync},
                                              {"publish_early", Plant::kPublishEarly},
                                              {"resume_late", Plant::kResumeLate}};

const std::map<std::string, Files> kFiles = {
    {"any", Files::kAny}, {"memory", Files::kMemory}, {"geopackage", Files::kGeoPackage}};

// A folder in memory, if there is one: a history makes files and syncs them.
std::string MakeFolder() {
  std::string path = std::filesystem::is_directory("/dev/shm") ? "/dev/shm" : "/tmp";
  path += "/hypermap_histories.XXXXXX";
  return mkdtemp(path.data()) == nullptr ? "" : path;
}

int Main(int argc, char** argv) {
  uint64_t seed = 1;
  int64_t histories = 1000;
  std::string plant = "none", files = "any";
  CLI::App app("Simulates histories of a Hypermap server, its robots and all that goes wrong.",
               "hypermap_histories");
  app.add_option("--seed", seed, "Seed of the first history")->capture_default_str();
  app.add_option("--histories", histories, "Number of histories, of consecutive seeds")
      ->capture_default_str();
  app.add_option("--plant", plant,
                 "Bug to plant, which must be found: skip_sync, publish_early or resume_late")
      ->check(CLI::IsMember(kPlants));
  app.add_option("--files", files,
                 "Where the server's maps are: memory, geopackage (slow), or any, which is "
                 "geopackage in a small share of the histories")
      ->check(CLI::IsMember(kFiles));
  bool traces = false;
  app.add_flag("--trace", traces, "Write what happens in the histories to stderr");
  CLI11_PARSE(app, argc, argv);

  const std::string folder = MakeFolder();
  if (folder.empty()) {
    std::cerr << "hypermap_histories: no folder for files\n";
    return 1;
  }
  logging::Start(logging::Level::kError, logging::Format::kText);
  const auto begin = std::chrono::steady_clock::now();
  nlohmann::json sums = {{"proof", "histories"}, {"plant", plant}};
  int64_t run = 0, events = 0, revisions = 0, crashes = 0, in_files = 0;
  bool violated = false;
  for (; run < histories && !violated; ++run) {
    const uint64_t this_seed = seed + static_cast<uint64_t>(run);
    const Outcome outcome =
        RunHistory(this_seed, kPlants.at(plant), kFiles.at(files), folder, traces);
    events += outcome.events;
    revisions += outcome.revisions;
    crashes += outcome.crashes;
    in_files += outcome.in_files;
    violated = !outcome.violation.empty();
    if (!violated) continue;
    sums["seed"] = this_seed;
    sums["violation"] = outcome.violation;
    std::cerr << "hypermap_histories: " << outcome.violation << "; replay with " << argv[0]
              << " --histories 1 --seed " << this_seed << " --plant " << plant << " --files "
              << files << '\n';
  }
  std::filesystem::remove_all(folder);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  const bool holds = violated == (plant != "none");
  sums.update({{"histories", run},
               {"events", events},
               {"revisions", revisions},
               {"crashes", crashes},
               {"in_files", in_files},
               {"seconds", took.count()},
               {"holds", holds}});
  std::cout << sums << std::endl;
  return holds ? 0 : 1;
}

}  // namespace
}  // namespace hypermap::histories

int main(int argc, char** argv) {
  try {
    return hypermap::histories::Main(argc, argv);
  } catch (const std::exception& error) {  // of CLI11 and the JSON library
    std::cerr << "hypermap_histories: " << error.what() << '\n';
    return 1;
  }
}
