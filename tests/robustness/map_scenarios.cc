#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/geopackage/spatial_functions.h"
#include "storage/sqlite/sqlite.h"
#include "tests/robustness/scenarios.h"
#include "tests/robustness/store_stage.h"

namespace hypermap::robustness {
namespace {

using HistoryPtr = std::shared_ptr<const History>;

constexpr int kObjects = 8;

HistoryPtr MakeHistory(testing::Rng& rng, int num_commits) {
  return std::make_shared<History>(rng, "site", kObjects, num_commits);
}

ScenarioPtr Make(Script<StoreStage> script) {
  return std::make_unique<ScriptedScenario<StoreStage>>(std::move(script));
}

ScenarioPtr Creation(testing::Rng& rng) {
  const HistoryPtr history = MakeHistory(rng, 3);
  DescriptionOptions options;
  options.requests = history->requests();
  Script<StoreStage> script = StoreScript("create", StoreOptions(), options);
  script.steps.push_back(CreateMapStep("site"));
  script.steps.push_back(WriteStep(history, 0, 1));
  script.steps.push_back(WriteStep(history, 1, 2));
  script.steps.push_back(CreateMapStep("other"));
  script.steps.push_back(OpenMapStep("site"));
  script.steps.push_back(WriteStep(history, 2, 3));
  return Make(std::move(script));
}

// Marks of time, commits alone and in a group, with and without a reader of the history.
ScenarioPtr Edits(testing::Rng& rng) {
  const HistoryPtr history = MakeHistory(rng, 14);
  DescriptionOptions options;
  options.requests = history->requests();
  Script<StoreStage> script = StoreScript("edit", StoreOptions(), options);
  script.prepare = [history](const std::string& folder) {
    return MakeMap(folder, "site", *history, 2);
  };
  script.steps.push_back(OpenMapStep("site"));
  for (const auto& [from, to] : {std::pair(2, 3), {3, 4}, {4, 7}, {7, 8}}) {
    script.steps.push_back(WriteStep(history, from, to));
  }
  script.steps.emplace_back([](StoreStage& stage) {
    storage::TimeMark mark;
    mark.revision = 8;
    mark.commit_time = absl::FromUnixSeconds(1'800'000'000);
    mark.passed = mark.lived = absl::Hours(1);
    return stage.map->AddTimeMark(mark, absl::ZeroDuration());
  });
  script.steps.emplace_back([](StoreStage& stage) -> absl::Status {
    HYPERMAP_ASSIGN_OR_RETURN(stage.reader, stage.map->OpenHistory());
    return stage.reader->Commits(5, 100).status();
  });
  for (const auto& [from, to] : {std::pair(8, 9), {9, 11}, {11, 12}}) {
    script.steps.push_back(WriteStep(history, from, to));
  }
  script.steps.push_back(CloseMapStep());
  script.steps.push_back(OpenMapStep("site"));
  for (const auto& [from, to] : {std::pair(12, 13), {13, 14}}) {
    script.steps.push_back(WriteStep(history, from, to));
  }
  return Make(std::move(script));
}

StoreStep CompactStep(Revision oldest) {
  return [oldest](StoreStage& stage) {
    constexpr int kRows = 6;
    return stage.map->Compact(oldest, absl::InfinitePast(), kRows).status();
  };
}

ScenarioPtr Compaction(testing::Rng& rng) {
  const HistoryPtr history = MakeHistory(rng, 14);
  DescriptionOptions options;
  options.requests = history->requests();
  Script<StoreStage> script = StoreScript("compaction", StoreOptions(), options);
  script.prepare = [history](const std::string& folder) {
    return MakeMap(folder, "site", *history, 12);
  };
  script.steps.push_back(OpenMapStep("site"));
  for (int i = 0; i < 4; ++i) script.steps.push_back(CompactStep(8));
  script.steps.push_back(WriteStep(history, 12, 13));
  for (int i = 0; i < 3; ++i) script.steps.push_back(CompactStep(11));
  script.steps.push_back(WriteStep(history, 13, 14));
  return Make(std::move(script));
}

// Commits that fill the write-ahead log, so that it is moved into the file meanwhile, and closings,
// which do that, too.
ScenarioPtr Checkpoints(testing::Rng& rng) {
  constexpr int kLarge = 4;
  auto history = std::make_shared<History>(rng, "site", kObjects, 1);
  LayerSpec spec;
  spec.name = "signal";
  spec.frame_id = "map";
  spec.kind = LayerKind::kScalar;
  spec.grid = GridGeometry{PlanarTransform(), 0.1};
  history->Add({{CreateLayer{spec}}});
  for (int i = 0; i < kLarge; ++i) {
    const CellBox box{0, 4 * kTileSide, 0, 5 * kTileSide};
    std::vector<std::optional<double>> values(static_cast<size_t>(20) * kCellsPerTile);
    for (auto& value : values) value = testing::Uniform(rng, 0, 1);
    history->Add({{WriteCells{spec.name, box, std::move(values)}}});
  }
  DescriptionOptions options;
  options.requests = history->requests();
  Script<StoreStage> script = StoreScript("checkpoint", StoreOptions(), options);
  script.prepare = [history](const std::string& folder) {
    return MakeMap(folder, "site", *history, 2);
  };
  script.steps.push_back(OpenMapStep("site"));
  for (int i = 2; i < 2 + kLarge - 1; ++i) script.steps.push_back(WriteStep(history, i, i + 1));
  // What is no longer needed of the past makes the file smaller for the checks.
  script.steps.emplace_back(
      [](StoreStage& stage) { return stage.map->Compact(4, absl::InfinitePast(), 1000).status(); });
  script.steps.push_back(CloseMapStep());
  script.steps.push_back(OpenMapStep("site"));
  script.steps.push_back(WriteStep(history, kLarge + 1, kLarge + 2));
  script.steps.push_back(CloseMapStep());
  return Make(std::move(script));
}

absl::Status MakeOldMap(const std::string& path, int version) {
  const std::string script = absl::StrCat(GEOPACKAGE_TESTDATA, "/map_v", version, ".sql");
  std::ifstream in(script);
  const std::string sql{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (sql.empty()) return absl::NotFoundError(script);
  HYPERMAP_ASSIGN_OR_RETURN(
      const auto database,
      storage::Database::Open(path, storage::Database::OpenMode::kCreate, absl::ZeroDuration()));
  HYPERMAP_RETURN_IF_ERROR(storage::RegisterSpatialFunctions(database.get()));
  return database->Execute(sql);
}

ScenarioPtr Migration() {
  Script<StoreStage> script = StoreScript("migration", StoreOptions(), {});
  script.prepare = [](const std::string& folder) -> absl::Status {
    HYPERMAP_RETURN_IF_ERROR(MakeOldMap(folder + "/site.gpkg", 7));
    return MakeOldMap(folder + "/older.gpkg", 4);
  };
  script.steps.push_back(OpenMapStep("site"));
  // A file of version 4 has no incarnation: it gets one, of which nobody knows before it is opened.
  const auto describe = script.describe;
  script.describe = [describe](const std::string& folder) -> absl::StatusOr<Description> {
    HYPERMAP_ASSIGN_OR_RETURN(Description description, describe(folder));
    description.erase("map older/notes");
    return description;
  };
  script.steps.push_back(OpenMapStep("older"));
  script.steps.push_back(CloseMapStep());
  script.steps.push_back(OpenMapStep("site"));
  return Make(std::move(script));
}

}  // namespace

std::vector<ScenarioPtr> MapScenarios(testing::Rng& rng) {
  std::vector<ScenarioPtr> scenarios;
  scenarios.push_back(Creation(rng));
  scenarios.push_back(Edits(rng));
  scenarios.push_back(Compaction(rng));
  scenarios.push_back(Checkpoints(rng));
  scenarios.push_back(Migration());
  return scenarios;
}

}  // namespace hypermap::robustness
