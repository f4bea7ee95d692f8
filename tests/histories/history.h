// One simulated history: a server, robots, and everything that goes wrong between them.
#ifndef HYPERMAP_TESTS_HISTORIES_HISTORY_H_
#define HYPERMAP_TESTS_HISTORIES_HISTORY_H_

#include <cstdint>
#include <string>

#include "tests/histories/plant.h"

namespace hypermap::histories {

// Where the server's maps are.
enum class Files {
  kAny,  // in files in a small share of the histories, because that is slow
  kMemory,
  kGeoPackage,
};

struct Outcome {
  std::string violation;  // the first broken promise; empty if all were kept
  int64_t events = 0;
  int64_t revisions = 0;
  int64_t crashes = 0;
  bool in_files = false;  // the maps were GeoPackages
};

// Runs the history of a seed to its end, or to the first broken promise. Equal arguments give equal
// outcomes. `folder`: for files that live as long as the call. With
// `traces`, writes what happens to stderr.
Outcome RunHistory(uint64_t seed, Plant plant, Files files, const std::string& folder,
                   bool traces = false);

}  // namespace hypermap::histories

#endif  // HYPERMAP_TESTS_HISTORIES_HISTORY_H_
