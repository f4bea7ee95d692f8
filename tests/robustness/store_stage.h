// A process that has a store of maps open, for scenarios.
#ifndef HYPERMAP_TESTS_ROBUSTNESS_STORE_STAGE_H_
#define HYPERMAP_TESTS_ROBUSTNESS_STORE_STAGE_H_

#include <functional>
#include <memory>
#include <string>

#include "storage/map_store.h"
#include "tests/robustness/description.h"
#include "tests/robustness/history.h"
#include "tests/robustness/scripted_scenario.h"

namespace hypermap::robustness {

struct StoreStage {
  explicit StoreStage(std::string path) : folder(std::move(path)) {}

  const std::string folder;
  std::unique_ptr<storage::MapStore> store;
  std::unique_ptr<storage::StoredMap> map;
  std::unique_ptr<storage::HistoryReader> reader;
};

using StoreStep = std::function<absl::Status(StoreStage&)>;

// Steps that can be tried again after an error.
StoreStep OpenStep(const storage::GeoPackageOptions& options);
// Opens and loads a map.
StoreStep OpenMapStep(const std::string& map);
StoreStep CloseMapStep();
StoreStep CreateMapStep(const std::string& map);
// Writes the commits of a history after revision `from`, up to `to`, as one group.
StoreStep WriteStep(const std::shared_ptr<const History>& history, Revision from, Revision to);

// Makes a map with the revisions up to `newest`, and closes it.
absl::Status MakeMap(const std::string& folder, const std::string& map, const History& history,
                     Revision newest);

// The script of a store without steps, whose maps have the requests of the options.
Script<StoreStage> StoreScript(const std::string& name,
                               const storage::GeoPackageOptions& store_options,
                               const DescriptionOptions& options);

}  // namespace hypermap::robustness

#endif  // HYPERMAP_TESTS_ROBUSTNESS_STORE_STAGE_H_
