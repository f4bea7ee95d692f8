#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "client_libs/cpp/replica/durable_copy.h"
#include "storage/outbox/outbox_file.h"
#include "tests/robustness/description.h"
#include "tests/robustness/history.h"
#include "tests/robustness/scenarios.h"
#include "tests/robustness/scripted_scenario.h"

namespace hypermap::robustness {
namespace {

using client::DurableCopy;
using storage::OutboxFile;

struct OutboxStage {
  explicit OutboxStage(std::string path) : folder(std::move(path)) {}

  const std::string folder;
  std::unique_ptr<OutboxFile> file;
};

using OutboxStep = std::function<absl::Status(OutboxStage&)>;

absl::Status OpenOutbox(OutboxStage& stage) {
  stage.file = nullptr;
  HYPERMAP_ASSIGN_OR_RETURN(stage.file,
                            OutboxFile::Open(stage.folder + "/outbox.sqlite", int64_t{1} << 30));
  return absl::OkStatus();
}

// The error of a step or a question when the last OpenOutbox has failed.
absl::Status CheckOpen(const OutboxStage& stage) {
  return stage.file ? absl::OkStatus() : absl::FailedPreconditionError("the outbox is not open");
}

storage::SendTime TimeOf(int seconds) {
  return {absl::FromUnixSeconds(1'700'000'000 + seconds), true, "boot", absl::Seconds(seconds)};
}

OutboxStep PutStep(const std::string& layer, const std::string& request) {
  return [=](OutboxStage& stage) -> absl::Status {
    HYPERMAP_RETURN_IF_ERROR(CheckOpen(stage));
    HYPERMAP_ASSIGN_OR_RETURN(const storage::OutboxStream stream,
                              stage.file->FindStream("site", layer, layer.empty() ? "" : "robot"));
    storage::QueuedRequest queued;
    queued.stream = stream.id;
    if (layer.empty()) queued.request_id = request;
    queued.options = "options";
    queued.body = absl::StrCat(request, std::string(3000, 'x'));
    queued.put_at = absl::FromUnixSeconds(1'700'000'000);
    return stage.file->Put(queued).status();
  };
}

absl::StatusOr<std::vector<storage::QueuedRequest>> Queue(OutboxStage& stage,
                                                          const std::string& layer, int count) {
  HYPERMAP_RETURN_IF_ERROR(CheckOpen(stage));
  HYPERMAP_ASSIGN_OR_RETURN(const storage::OutboxStream stream,
                            stage.file->FindStream("site", layer, layer.empty() ? "" : "robot"));
  return stage.file->First(stream.id, count);
}

OutboxStep SendStep(const std::string& layer, int count, int seconds) {
  return [=](OutboxStage& stage) -> absl::Status {
    HYPERMAP_ASSIGN_OR_RETURN(std::vector<storage::QueuedRequest> requests,
                              Queue(stage, layer, count));
    if (layer.empty()) return stage.file->MarkSent(absl::MakeSpan(requests), TimeOf(seconds));
    return stage.file->MarkSentInSequence(absl::MakeSpan(requests), 7, TimeOf(seconds));
  };
}

// The first request of a stream is delivered, and the second one refused. Requests are named by
// their ids, so that a step that is tried again settles the same ones.
OutboxStep SettleStep(int64_t delivered, int64_t refused) {
  return [=](OutboxStage& stage) -> absl::Status {
    HYPERMAP_RETURN_IF_ERROR(CheckOpen(stage));
    const storage::ServerRefusal refusal{refused, absl::InvalidArgumentError("no such layer")};
    return stage.file->Settle({&delivered, 1}, {&refusal, 1});
  };
}

std::string TextOf(const storage::QueuedRequest& request) {
  return absl::StrCat(
      request.id, " in ", request.stream, " ", request.request_id, " number ",
      request.sequence ? absl::StrCat(*request.sequence) : "none", " ", request.options, " ",
      request.body.substr(0, request.body.find('x')), " of ", request.body.size(), " bytes ",
      std::hash<std::string>()(request.body), " at ", absl::ToUnixNanos(request.put_at), " sent ",
      request.first_sent ? absl::FormatTime(request.first_sent->wall) : "never", "\n");
}

absl::StatusOr<Description> DescribeOutbox(OutboxStage& stage) {
  HYPERMAP_RETURN_IF_ERROR(CheckOpen(stage));
  Description description;
  HYPERMAP_ASSIGN_OR_RETURN(const auto streams, stage.file->Streams());
  for (const storage::OutboxStream& stream : streams) {
    HYPERMAP_ASSIGN_OR_RETURN(const auto requests, stage.file->First(stream.id, 1000));
    std::string& text = description[absl::StrCat("stream ", stream.map, "/", stream.layer)];
    for (const storage::QueuedRequest& request : requests) text += TextOf(request);
  }
  HYPERMAP_ASSIGN_OR_RETURN(const auto refused, stage.file->Refused());
  for (const storage::RefusedRequest& request : refused) {
    description["refused"] += TextOf(request.request) + request.why.ToString() + "\n";
  }
  HYPERMAP_ASSIGN_OR_RETURN(const storage::OutboxCounts counts, stage.file->Counts());
  description["counts"] = absl::StrCat(counts.queued, " queued, ", counts.delivered, " delivered, ",
                                       counts.refused, " refused");
  return description;
}

ScenarioPtr Outbox() {
  Script<OutboxStage> script;
  script.name = "outbox";
  script.prepare = [](const std::string&) { return absl::OkStatus(); };
  script.steps.emplace_back(OpenOutbox);
  for (int i = 1; i <= 4; ++i) script.steps.push_back(PutStep("", absl::StrCat("edit ", i)));
  for (int i = 1; i <= 3; ++i) script.steps.push_back(PutStep("things", absl::StrCat("seen ", i)));
  script.steps.push_back(SendStep("", 3, 1));
  script.steps.push_back(SendStep("things", 2, 2));
  script.steps.push_back(SettleStep(1, 2));
  script.steps.push_back(SettleStep(5, 6));
  script.steps.emplace_back([](OutboxStage& stage) -> absl::Status {
    HYPERMAP_RETURN_IF_ERROR(CheckOpen(stage));
    return stage.file->PutBack(2);
  });
  script.steps.emplace_back([](OutboxStage& stage) -> absl::Status {
    HYPERMAP_RETURN_IF_ERROR(CheckOpen(stage));
    return stage.file->Discard(6);
  });
  script.steps.emplace_back(OpenOutbox);
  script.steps.push_back(PutStep("", "edit 5"));
  script.answers = DescribeOutbox;
  script.describe = [](const std::string& folder) -> absl::StatusOr<Description> {
    OutboxStage stage(folder);
    HYPERMAP_RETURN_IF_ERROR(OpenOutbox(stage));
    return DescribeOutbox(stage);
  };
  script.go_on = [](const std::string& folder) -> absl::Status {
    OutboxStage stage(folder);
    HYPERMAP_RETURN_IF_ERROR(OpenOutbox(stage));
    HYPERMAP_ASSIGN_OR_RETURN(const auto before, stage.file->Counts());
    HYPERMAP_RETURN_IF_ERROR(PutStep("", "the last")(stage));
    HYPERMAP_RETURN_IF_ERROR(OpenOutbox(stage));
    HYPERMAP_ASSIGN_OR_RETURN(const auto after, stage.file->Counts());
    if (after.queued == before.queued + 1) return absl::OkStatus();
    return absl::DataLossError("the last request is lost");
  };
  return std::make_unique<ScriptedScenario<OutboxStage>>(std::move(script));
}

constexpr char kSelection[] = "everything";

struct ReplicaStage {
  explicit ReplicaStage(std::string path) : folder(std::move(path)) {}

  const std::string folder;
  std::unique_ptr<DurableCopy> copy;
};

using ReplicaStep = std::function<absl::Status(ReplicaStage&)>;

absl::Status OpenCopy(ReplicaStage& stage) {
  stage.copy = nullptr;
  // The thread of the copy does nothing, so that every write is that of a step.
  HYPERMAP_ASSIGN_OR_RETURN(stage.copy,
                            DurableCopy::Open(stage.folder, "site", kSelection, absl::Hours(1)));
  return absl::OkStatus();
}

client::KnownRevision KnownOf(const SnapshotPtr& snapshot, uint64_t incarnation) {
  return {snapshot, absl::FromUnixSeconds(1'700'000'000 + snapshot->revision),
          absl::FromUnixSeconds(1'600'000'000 + static_cast<int64_t>(incarnation)), incarnation};
}

ReplicaStep KeepStep(const std::shared_ptr<const History>& history, Revision revision,
                     uint64_t incarnation) {
  return [=](ReplicaStage& stage) {
    stage.copy->Write(KnownOf(history->at(revision), incarnation));
    return stage.copy->Flush();
  };
}

// Incarnations of the server's maps are smaller than any that is chosen at random.
constexpr uint64_t kLastIncarnation = 13;

// A replica that has nothing gives no answers, and gets the map again.
constexpr char kNothing[] = "nothing";

absl::StatusOr<Description> DescribeReplica(ReplicaStage& stage) {
  Description description;
  std::error_code error;
  if (std::filesystem::exists(stage.folder + "/site.gpkg.damaged", error)) {
    description["damaged"] = "a file was set aside";
  }
  const std::optional<client::KnownRevision> stored = stage.copy->stored();
  if (!stored) {
    description["stored"] = kNothing;
    return description;
  }
  // The file is found to be another one than was written, and the server's map will replace it.
  if (stored->incarnation > kLastIncarnation) description["damaged"] = "another incarnation";
  description["stored"] = absl::StrCat(
      "of ", absl::FormatTime(stored->time), " created ", absl::FormatTime(stored->created_at),
      " incarnation ", stored->incarnation, "\n", DescribeSnapshot(*stored->snapshot));
  return description;
}

ScenarioPtr Replica(testing::Rng& rng) {
  const auto first = std::make_shared<History>(rng, "site", 8, 9);
  const auto second = std::make_shared<History>(rng, "site", 8, 4);
  Script<ReplicaStage> script;
  script.name = "replica";
  script.prepare = [](const std::string&) { return absl::OkStatus(); };
  script.steps.emplace_back(OpenCopy);
  for (const int revision : {1, 2, 5, 6}) script.steps.push_back(KeepStep(first, revision, 11));
  script.steps.emplace_back(OpenCopy);
  for (const int revision : {7, 9}) script.steps.push_back(KeepStep(first, revision, 11));
  // The map was deleted and made again.
  for (const int revision : {2, 3, 4}) script.steps.push_back(KeepStep(second, revision, 12));
  script.answers = DescribeReplica;
  script.describe = [](const std::string& folder) -> absl::StatusOr<Description> {
    ReplicaStage stage(folder);
    HYPERMAP_RETURN_IF_ERROR(OpenCopy(stage));
    return DescribeReplica(stage);
  };
  script.go_on = [first](const std::string& folder) -> absl::Status {
    ReplicaStage stage(folder);
    HYPERMAP_RETURN_IF_ERROR(OpenCopy(stage));
    HYPERMAP_RETURN_IF_ERROR(KeepStep(first, 3, kLastIncarnation)(stage));
    HYPERMAP_RETURN_IF_ERROR(OpenCopy(stage));
    const auto stored = stage.copy->stored();
    if (stored && stored->incarnation == kLastIncarnation) return absl::OkStatus();
    return absl::DataLossError("the newest revision is lost");
  };
  return std::make_unique<ScriptedScenario<ReplicaStage>>(std::move(script));
}

}  // namespace

std::vector<ScenarioPtr> RobotScenarios(testing::Rng& rng) {
  std::vector<ScenarioPtr> scenarios;
  scenarios.push_back(Outbox());
  scenarios.push_back(Replica(rng));
  return scenarios;
}

std::vector<ScenarioPtr> MakeScenarios(uint64_t seed) {
  testing::Rng rng(seed);
  std::vector<ScenarioPtr> scenarios;
  for (const auto make : {MapScenarios, StoreScenarios, SessionScenarios, RobotScenarios}) {
    for (ScenarioPtr& scenario : make(rng)) scenarios.push_back(std::move(scenario));
  }
  return scenarios;
}

}  // namespace hypermap::robustness
