#include "tests/robustness/store_stage.h"

#include <utility>
#include <vector>

#include "base/status/status_macros.h"
#include "storage/geopackage/geopackage_store.h"

namespace hypermap::robustness {

StoreStep OpenStep(const storage::GeoPackageOptions& options) {
  return [options](StoreStage& stage) -> absl::Status {
    HYPERMAP_ASSIGN_OR_RETURN(stage.store, storage::OpenGeoPackageStore(stage.folder, options));
    return absl::OkStatus();
  };
}

StoreStep OpenMapStep(const std::string& map) {
  return [map](StoreStage& stage) -> absl::Status {
    stage.map = nullptr;
    HYPERMAP_ASSIGN_OR_RETURN(stage.map, stage.store->Open(map));
    return stage.map->Load().status();
  };
}

StoreStep CloseMapStep() {
  return [](StoreStage& stage) {
    stage.reader = nullptr;
    stage.map = nullptr;
    return absl::OkStatus();
  };
}

StoreStep CreateMapStep(const std::string& map) {
  return [map](StoreStage& stage) -> absl::Status {
    stage.map = nullptr;
    auto created = stage.store->Create(HeaderOf(map));
    // After an error that could not be undone the map stays, and is the one that was asked for.
    if (absl::IsAlreadyExists(created.status())) created = stage.store->Open(map);
    HYPERMAP_RETURN_IF_ERROR(created.status());
    stage.map = *std::move(created);
    return absl::OkStatus();
  };
}

StoreStep WriteStep(const std::shared_ptr<const History>& history, Revision from, Revision to) {
  return [history, from, to](StoreStage& stage) {
    return stage.map->Write(history->Commits(from, to));
  };
}

absl::Status MakeMap(const std::string& folder, const std::string& map, const History& history,
                     Revision newest) {
  StoreStage stage(folder);
  HYPERMAP_RETURN_IF_ERROR(OpenStep(StoreOptions())(stage));
  HYPERMAP_RETURN_IF_ERROR(CreateMapStep(map)(stage));
  for (Revision revision = 0; revision < newest; ++revision) {
    HYPERMAP_RETURN_IF_ERROR(stage.map->Write(history.Commits(revision, revision + 1)));
  }
  return absl::OkStatus();
}

Script<StoreStage> StoreScript(const std::string& name,
                               const storage::GeoPackageOptions& store_options,
                               const DescriptionOptions& options) {
  Script<StoreStage> script;
  script.name = name;
  script.prepare = [](const std::string&) { return absl::OkStatus(); };
  script.steps.push_back(OpenStep(store_options));
  script.answers = [options](StoreStage& stage) -> absl::StatusOr<Description> {
    Description description;
    if (stage.map) HYPERMAP_RETURN_IF_ERROR(DescribeMap(*stage.map, options, &description));
    // They are those of the opening before the last changes.
    std::erase_if(description, [](const auto& part) { return part.first.ends_with("/notes"); });
    return description;
  };
  script.describe = [store_options, options](const std::string& folder) {
    return DescribeFolder(folder, store_options, options);
  };
  script.go_on = [store_options](const std::string& folder) {
    return EditAllMaps(folder, store_options);
  };
  return script;
}

}  // namespace hypermap::robustness
