#include <memory>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/sqlite/durable_file.h"
#include "tests/robustness/recorder.h"
#include "tests/robustness/scenarios.h"
#include "tests/robustness/store_stage.h"

namespace hypermap::robustness {
namespace {

using HistoryPtr = std::shared_ptr<const History>;

ScenarioPtr Make(Script<StoreStage> script) {
  return std::make_unique<ScriptedScenario<StoreStage>>(std::move(script));
}

StoreStep DeleteStep(const std::string& map, const std::string& request) {
  return [map, request](StoreStage& stage) {
    stage.map = nullptr;
    return stage.store->Delete(map, request);
  };
}

ScenarioPtr Deletion(testing::Rng& rng, bool keeps) {
  const auto history = std::make_shared<History>(rng, "site", 6, 4);
  storage::GeoPackageOptions store_options = StoreOptions();
  if (keeps) store_options.trash_age = absl::Hours(1);
  DescriptionOptions options;
  options.requests = history->requests();
  for (const char* request : {"delete 1", "delete 2", "delete 3"}) {
    options.requests.emplace_back(request);
  }
  Script<StoreStage> script =
      StoreScript(keeps ? "delete to trash" : "delete", store_options, options);
  script.prepare = [history](const std::string& folder) -> absl::Status {
    HYPERMAP_RETURN_IF_ERROR(MakeMap(folder, "site", *history, 2));
    return MakeMap(folder, "other", *history, 1);
  };
  script.steps.push_back(OpenMapStep("site"));
  script.steps.push_back(WriteStep(history, 2, 3));
  script.steps.push_back(DeleteStep("site", "delete 1"));
  if (keeps) {
    script.steps.emplace_back(
        [](StoreStage& stage) { return stage.store->RemoveOldTrash(absl::InfiniteFuture()); });
  }
  script.steps.push_back(CreateMapStep("site"));
  script.steps.push_back(WriteStep(history, 0, 1));
  script.steps.push_back(DeleteStep("site", "delete 2"));
  script.steps.push_back(DeleteStep("other", "delete 3"));
  return Make(std::move(script));
}

// A check of a file and its restoration in place of a map, and one beside it.
ScenarioPtr Restoration(testing::Rng& rng) {
  const auto history = std::make_shared<History>(rng, "site", 6, 6);
  storage::GeoPackageOptions store_options = StoreOptions();
  store_options.trash_age = absl::Hours(1);
  DescriptionOptions options;
  options.requests = history->requests();
  Script<StoreStage> script = StoreScript("restore", store_options, options);
  const auto upload = [](const std::string& folder, int number) {
    return absl::StrCat(folder, "/upload.", number);
  };
  script.prepare = [history, upload](const std::string& folder) -> absl::Status {
    HYPERMAP_RETURN_IF_ERROR(MakeMap(folder, "site", *history, 5));
    const std::string elsewhere = folder + ".elsewhere";
    for (const int number : {1, 2}) {
      WriteTree({}, elsewhere);
      HYPERMAP_RETURN_IF_ERROR(MakeMap(elsewhere, "site", *history, 2 + number));
      StoreStage stage(elsewhere);
      HYPERMAP_RETURN_IF_ERROR(OpenStep(StoreOptions())(stage));
      HYPERMAP_RETURN_IF_ERROR(OpenMapStep("site")(stage));
      HYPERMAP_RETURN_IF_ERROR(stage.map->BackupTo(upload(folder, number)));
    }
    WriteTree({}, elsewhere);
    return absl::OkStatus();
  };
  const auto restore = [upload](int number, const std::string& map) {
    return [=](StoreStage& stage) -> absl::Status {
      const std::string path = upload(stage.folder, number);
      HYPERMAP_ASSIGN_OR_RETURN(const CheckReport report, stage.store->CheckFile(path, nullptr));
      if (!report.is_clean()) return absl::DataLossError(Describe(report.findings.front()));
      return stage.store->Restore(path, map, absl::StrCat("restore ", number));
    };
  };
  script.steps.emplace_back(restore(1, "other"));
  script.steps.emplace_back(restore(2, "site"));
  script.steps.push_back(OpenMapStep("site"));
  script.steps.push_back(WriteStep(history, 4, 5));
  return Make(std::move(script));
}

}  // namespace

std::vector<ScenarioPtr> StoreScenarios(testing::Rng& rng) {
  std::vector<ScenarioPtr> scenarios;
  scenarios.push_back(Deletion(rng, /*keeps=*/false));
  scenarios.push_back(Deletion(rng, /*keeps=*/true));
  scenarios.push_back(Restoration(rng));
  return scenarios;
}

}  // namespace hypermap::robustness
