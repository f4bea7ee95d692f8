#include <algorithm>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "server/backup_schedule.h"
#include "server/services/evidence_codec.h"
#include "server/session/site.h"
#include "storage/geopackage/geopackage_store.h"
#include "storage/sqlite/durable_file.h"
#include "tests/robustness/recorder.h"
#include "tests/robustness/scenarios.h"
#include "tests/robustness/store_stage.h"

namespace hypermap::robustness {
namespace {

using server::MapSession;
using server::Site;

struct SiteStage {
  explicit SiteStage(std::string path) : folder(std::move(path)) {}

  const std::string folder;
  std::unique_ptr<Site> site;
  std::unique_ptr<server::BackupSchedule> backups;
};

using SiteStep = std::function<absl::Status(SiteStage&)>;

absl::Status OpenSite(SiteStage& stage) {
  HYPERMAP_ASSIGN_OR_RETURN(auto store, storage::OpenGeoPackageStore(stage.folder, StoreOptions()));
  server::SessionOptions options;
  options.fusion.codec = server::WireEvidenceCodec();
  HYPERMAP_ASSIGN_OR_RETURN(stage.site, Site::Open(std::move(store), options));
  for (const Site::Entry& entry : stage.site->List()) {
    if (entry.problem.ok()) continue;
    stage.site = nullptr;
    return entry.problem;
  }
  return absl::OkStatus();
}

absl::Status Submit(MapSession& session, const EditBatch& batch, const std::string& request) {
  return session.SubmitAndWait(server::Submission{batch, "editor", request}).status();
}

SiteStep EditStep(const std::string& map, const EditBatch& batch, const std::string& request) {
  return [=](SiteStage& stage) -> absl::Status {
    HYPERMAP_ASSIGN_OR_RETURN(const auto session, stage.site->Find(map));
    return Submit(*session, batch, request);
  };
}

// A map that appears only when it is filled.
SiteStep ImportStep(const std::string& map, const EditBatch& batch) {
  return [=](SiteStage& stage) {
    const Site::NewMap made{map, "map", "import " + map};
    const absl::Status status =
        stage.site
            ->CreateFilled(made, [&](MapSession& session) { return Submit(session, batch, ""); })
            .status();
    // What a failed import has left on a read-only disk is listed, and goes when it can be removed.
    return absl::IsAlreadyExists(status) ? absl::UnavailableError(status.message()) : status;
  };
}

SiteStep CloseStep() {
  return [](SiteStage& stage) {
    stage.backups = nullptr;
    stage.site = nullptr;
    return absl::OkStatus();
  };
}

Script<SiteStage> SiteScript(const std::string& name, std::vector<std::string> requests) {
  DescriptionOptions options;
  options.requests = std::move(requests);
  options.has_known_times = false;
  Script<SiteStage> script;
  script.name = name;
  script.prepare = [](const std::string&) { return absl::OkStatus(); };
  script.steps.emplace_back(OpenSite);
  script.answers = [](SiteStage& stage) -> absl::StatusOr<Description> {
    Description description;
    if (!stage.site) return description;
    for (const Site::Entry& entry : stage.site->List()) {
      HYPERMAP_RETURN_IF_ERROR(entry.problem);
      description[absl::StrCat("map ", entry.name, "/newest")] =
          DescribeSnapshot(*entry.session->snapshot());
    }
    return description;
  };
  script.describe = [options](const std::string& folder) -> absl::StatusOr<Description> {
    HYPERMAP_ASSIGN_OR_RETURN(Description description,
                              DescribeFolder(folder, StoreOptions(), options));
    // A server must be able to work with the files, too, such as with the evidence of fused layers.
    SiteStage stage(folder);
    HYPERMAP_RETURN_IF_ERROR(OpenSite(stage));
    return description;
  };
  script.go_on = [](const std::string& folder) { return EditAllMaps(folder, StoreOptions()); };
  return script;
}

ScenarioPtr Make(Script<SiteStage> script) {
  return std::make_unique<ScriptedScenario<SiteStage>>(std::move(script));
}

EditBatch Objects(testing::Rng& rng, int count) {
  EditBatch batch;
  LayerSpec spec;
  spec.name = absl::StrCat("imported", count);
  batch.edits.push_back(CreateLayer{spec});
  for (int i = 0; i < count; ++i) {
    const Point centre{testing::Uniform(rng, -50, 50), testing::Uniform(rng, -50, 50)};
    batch.edits.push_back(PutObject{spec.name, testing::RandomObject(rng, centre, 1.0), ""});
  }
  return batch;
}

ScenarioPtr Import(testing::Rng& rng) {
  const EditBatch large = Objects(rng, 300);
  const EditBatch more = Objects(rng, 150);
  EditBatch site = testing::RandomSite(rng, 20);
  Script<SiteStage> script = SiteScript("import", {"import site", "import store", "more"});
  script.steps.push_back(ImportStep("site", site));
  script.steps.push_back(ImportStep("store", large));
  script.steps.push_back(EditStep("site", more, "more"));
  script.steps.push_back(CloseStep());
  script.steps.emplace_back(OpenSite);
  script.steps.push_back(EditStep("store", more, "more"));
  return Make(std::move(script));
}

// What a robot saw: a few things near the origin.
Observation Sighting(const std::string& robot, int64_t sequence) {
  Observation observation;
  observation.robot = robot;
  observation.sequence = sequence;
  observation.stamp = absl::FromUnixSeconds(1'700'000'000) + absl::Seconds(sequence);
  for (int i = 0; i < 3; ++i) {
    Detection detection;
    detection.scores = {{i == 0 ? "chair" : "table", 0.9}};
    const double x = 3.0 * i + 0.01 * static_cast<double>(sequence);
    detection.hull = Polygon::FromBox({{x, 0}, {x + 1, 1}});
    detection.num_points = 5;
    observation.detections.push_back(detection);
  }
  observation.free_space = Polygon::FromBox({{-1, -1}, {10, 3}});
  return observation;
}

SiteStep ObserveStep(const std::string& robot, int64_t sequence) {
  return [=](SiteStage& stage) -> absl::Status {
    HYPERMAP_ASSIGN_OR_RETURN(const auto session, stage.site->Find("site"));
    using Verdicts = absl::StatusOr<std::vector<ObservationVerdict>>;
    std::promise<Verdicts> promise;
    std::future<Verdicts> verdicts = promise.get_future();
    session->Observe(server::ObservationSubmission{"things", {Sighting(robot, sequence)}, robot},
                     [&promise](Verdicts answer) { promise.set_value(std::move(answer)); });
    return verdicts.get().status();
  };
}

SiteStep FusionStep(const server::FusionCommand& command, const std::string& request) {
  return [=](SiteStage& stage) -> absl::Status {
    HYPERMAP_ASSIGN_OR_RETURN(const auto session, stage.site->Find("site"));
    return session->RunAndWait(server::FusionSubmission{command, "operator", request}).status();
  };
}

ScenarioPtr Fusion() {
  LayerSpec things;
  things.name = "things";
  LayerSpec seen;
  seen.name = "seen";
  seen.kind = LayerKind::kExploration;
  seen.grid = GridGeometry{PlanarTransform(), 0.5};
  SemanticObject placed;
  placed.label = "door";
  placed.shape = Polygon::FromBox({{20, 20}, {21, 21}});
  Script<SiteStage> script = SiteScript("fusion", {"layers", "start", "placed", "rebuild"});
  script.steps.push_back(ImportStep("site", {{CreateLayer{things}, CreateLayer{seen}}}));
  script.steps.push_back(FusionStep(server::StartFusion{"things", {"", "", "seen"}}, "start"));
  for (int i = 1; i <= 4; ++i) script.steps.push_back(ObserveStep("robot", i));
  script.steps.push_back(EditStep("site", {{PutObject{"things", placed, ""}}}, "placed"));
  for (int i = 1; i <= 3; ++i) script.steps.push_back(ObserveStep("other", i));
  script.steps.push_back(FusionStep(server::RebuildFusion{"things", "", ""}, "rebuild"));
  script.steps.push_back(CloseStep());
  script.steps.emplace_back(OpenSite);
  script.steps.push_back(ObserveStep("robot", 9));
  return Make(std::move(script));
}

std::string BackupFolder(const std::string& folder) { return folder + "/backups"; }

// The folder of a backup that is there before, and older than all others.
constexpr char kOldBackup[] = "2020-01-01T000000Z";
constexpr char kBackupName[] = "/site.gpkg";

// The folder of the newest backup of the map; empty if there is none.
std::string NewestBackup(const FileTree& backups) {
  std::string newest;
  for (const auto& [name, bytes] : backups) {
    if (name.ends_with(kBackupName)) newest = std::max(newest, storage::FolderOf(name));
  }
  return newest;
}

// Removes all but the old backup.
absl::Status RemoveNewBackups(const std::string& folder) {
  std::error_code error;
  std::vector<std::filesystem::path> paths;
  std::filesystem::directory_iterator entry(BackupFolder(folder), error);
  for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    if (entry->path().filename() != kOldBackup) paths.push_back(entry->path());
  }
  for (const auto& path : paths) {
    if (!error) std::filesystem::remove_all(path, error);
  }
  return error ? absl::UnavailableError(error.message()) : absl::OkStatus();
}

// Makes the first backup, and waits for it.
absl::Status BackUp(SiteStage& stage) {
  stage.backups = nullptr;
  // If an attempt failed to take back its file, no other would be due.
  HYPERMAP_RETURN_IF_ERROR(RemoveNewBackups(stage.folder));
  HYPERMAP_ASSIGN_OR_RETURN(
      stage.backups, server::BackupSchedule::Start(
                         stage.site.get(), {BackupFolder(stage.folder), absl::Hours(24), 1}));
  while (true) {
    for (const auto& [name, map] : stage.backups->meters().Read()) {
      if (map.failed > 0) return absl::UnavailableError("the backup fails");
      if (map.verified > 0) return absl::OkStatus();
    }
    absl::SleepFor(absl::Milliseconds(1));
  }
}

// The newest backup, which is what counts.
absl::Status DescribeBackups(const std::string& folder, Description* description) {
  const FileTree files = ReadTree(BackupFolder(folder));
  const std::string newest = NewestBackup(files);
  if (newest.empty()) return absl::OkStatus();
  const std::string elsewhere = folder + ".backup";
  WriteTree({{"site.gpkg", files.at(newest + kBackupName)}}, elsewhere);
  DescriptionOptions options;
  options.has_known_times = false;
  HYPERMAP_ASSIGN_OR_RETURN(const Description parts,
                            DescribeFolder(elsewhere, StoreOptions(), options));
  for (const auto& [part, text] : parts) (*description)["backup/" + part] = text;
  WriteTree({}, elsewhere);
  return absl::OkStatus();
}

ScenarioPtr Backup(testing::Rng& rng) {
  const auto history = std::make_shared<History>(rng, "site", 6, 6);
  Script<SiteStage> script = SiteScript("backup", history->requests());
  script.prepare = [history](const std::string& folder) -> absl::Status {
    // Of another state.
    const std::string old = absl::StrCat(BackupFolder(folder), "/", kOldBackup);
    WriteTree({}, old);
    HYPERMAP_RETURN_IF_ERROR(MakeMap(old, "site", *history, 2));
    FileTree files = ReadTree(old);
    std::erase_if(files, [](const auto& file) { return file.first != "site.gpkg"; });
    WriteTree(files, old);
    return MakeMap(folder, "site", *history, 5);
  };
  script.steps.emplace_back(BackUp);
  LayerSpec spec;
  spec.name = "later";
  script.steps.push_back(EditStep("site", {{CreateLayer{spec}}}, "later"));
  const auto describe_site = script.describe;
  script.describe = [=](const std::string& folder) -> absl::StatusOr<Description> {
    HYPERMAP_ASSIGN_OR_RETURN(Description description, describe_site(folder));
    HYPERMAP_RETURN_IF_ERROR(DescribeBackups(folder, &description));
    return description;
  };
  return Make(std::move(script));
}

}  // namespace

std::vector<ScenarioPtr> SessionScenarios(testing::Rng& rng) {
  std::vector<ScenarioPtr> scenarios;
  scenarios.push_back(Import(rng));
  scenarios.push_back(Fusion());
  scenarios.push_back(Backup(rng));
  return scenarios;
}

}  // namespace hypermap::robustness
