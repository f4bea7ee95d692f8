#include "tests/histories/history.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "map/layers/layer_spec.h"
#include "server/services/evidence_codec.h"
#include "tests/histories/network.h"
#include "tests/histories/outbox_robot.h"
#include "tests/histories/record.h"
#include "tests/histories/robots.h"
#include "tests/histories/schedule.h"
#include "tests/histories/server.h"
#include "tests/histories/server_disk.h"
#include "tests/histories/volume.h"

namespace hypermap::histories {
namespace {

// Events after which a history that has not ended is one that hangs.
constexpr int64_t kMaxEvents = 20'000;
// Events after which nothing goes wrong any more.
constexpr int64_t kMaxEventsWithFaults = 5'000;

// Share of the histories whose maps are in files.
constexpr double kGeoPackage = 0.02;
// Share of the outboxes that get more than a few entries.
constexpr double kManyEntries = 0.01;

server::FusionOptions Fusion() {
  server::FusionOptions fusion;
  fusion.codec = server::WireEvidenceCodec();
  fusion.entries_per_checkpoint = 3;
  fusion.entries_per_stored_checkpoint = 5;
  return fusion;
}

EditBatch Layers() {
  LayerSpec things;
  things.name = kThings;
  LayerSpec seen;
  seen.name = kSeen;
  LayerSpec floor;
  floor.name = kFloor;
  floor.kind = LayerKind::kOccupancy;
  floor.grid = GridGeometry{PlanarTransform(), 0.1};
  return {{CreateLayer{things}, CreateLayer{seen}, CreateLayer{floor}}};
}

// Draws the same number in any case, so that a seed has about the same history with any files.
bool IsInFiles(Schedule& schedule, Files files) {
  const bool drawn = schedule.Chance(kGeoPackage);
  return files == Files::kAny ? drawn : files == Files::kGeoPackage;
}

class History {
 public:
  History(uint64_t seed, Plant plant, Files files, const std::string& folder, bool traces)
      : schedule_(seed, traces),
        record_(Fusion()),
        in_files_(IsInFiles(schedule_, files)),
        volume_(in_files_ ? MakeGeoPackageVolume(&schedule_, folder + "/server")
                          : MakeMemoryVolume()),
        disk_(&schedule_, &record_, volume_.get(), plant, [this] { EndServerSoon(); }),
        network_(&schedule_, [this] { return server_ ? server_.get() : nullptr; }),
        plant_(plant),
        folder_(folder) {}

  Outcome Run() {
    Begin();
    SetFaults(true);
    PlanFaults();
    RunUntil([this] { return RobotsAreDone() || schedule_.num_run() > kMaxEventsWithFaults; });
    SetFaults(false);
    RunUntil([this] { return RobotsAreDone() && MirrorsAreUpToDate(); });
    for (const auto& robot : outboxes_) robot->CheckDelivered();
    return {record_.violation(), schedule_.num_run(), record_.newest(), crashes_, in_files_};
  }

 private:
  void Begin();
  void SetFaults(bool faults) {
    faults_ = faults;
    disk_.set_faults(faults);
    volume_->set_faults(faults);
    network_.set_faults(faults);
  }
  // Kills and restarts processes from time to time, while there are faults.
  void PlanFaults();
  void StartServer();
  void EndServerSoon();
  void StopServer();
  // Runs events until `done`, or until a promise is broken.
  void RunUntil(const std::function<bool()>& done);
  bool RobotsAreDone();
  bool MirrorsAreUpToDate() const;
  // What a history waits for.
  std::string Waiting();

  Schedule schedule_;
  Record record_;
  const bool in_files_;
  const std::unique_ptr<Volume> volume_;
  ServerDisk disk_;
  Network network_;
  const Plant plant_;
  const std::string folder_;
  Server::Options options_;
  bool faults_ = false;
  int64_t crashes_ = 0;
  std::unique_ptr<Server> server_;
  std::vector<std::unique_ptr<Editor>> editors_;
  std::vector<std::unique_ptr<Mirror>> mirrors_;
  std::vector<std::unique_ptr<OutboxRobot>> outboxes_;
};

void History::Begin() {
  options_.fusion = Fusion();
  // Some servers keep little of their history, so that replicas come too late for it.
  if (schedule_.Chance(0.3)) options_.limits.history_revisions = schedule_.Pick(2, 10);
  if (schedule_.Chance(0.3)) options_.feed.max_commits = schedule_.Pick(1, 4);
  if (schedule_.Chance(0.3)) options_.limits.chunk_items = static_cast<int>(schedule_.Pick(1, 3));
  if (schedule_.Chance(0.3)) options_.tuning.max_ring_commits = schedule_.Pick(1, 3);
  // Nothing may depend on how long work takes on this machine.
  options_.tuning.max_encoding = absl::Hours(1);
  if (const absl::Status made = disk_.CreateMap(); !made.ok()) {
    return record_.Violate(made.ToString());
  }
  StartServer();
  bool ready = false;
  server_->ApplyEdits(
      Layers(), "layers",
      [&ready](const absl::StatusOr<client::EditAnswer>& answer) { ready = answer.ok(); });
  RunUntil([&ready] { return ready; });
  for (int64_t i = schedule_.Pick(1, 3); i > 0; --i) {
    editors_.push_back(std::make_unique<Editor>(&schedule_, &network_, &record_,
                                                absl::StrCat("editor ", i),
                                                static_cast<int>(schedule_.Pick(2, 10))));
  }
  for (int64_t i = schedule_.Pick(1, 2); i > 0; --i) {
    mirrors_.push_back(std::make_unique<Mirror>(&schedule_, &network_, &record_, plant_));
  }
  if (schedule_.Chance(0.5)) {
    // Of many entries, some come so late that they wait until they are folded in advance.
    const int64_t num_entries =
        schedule_.Chance(kManyEntries) ? schedule_.Pick(120, 150) : schedule_.Pick(1, 10);
    outboxes_.push_back(std::make_unique<OutboxRobot>(
        &schedule_, &network_, &record_, folder_ + "/outbox.db", static_cast<int>(num_entries)));
  }
}

void History::PlanFaults() {
  schedule_.After(schedule_.Pick(absl::ZeroDuration(), absl::Seconds(4)), [this] {
    if (!faults_) return;
    switch (schedule_.Pick(0, 4)) {
      case 0:
        disk_.Kill();
        break;
      case 1:
        StopServer();
        break;
      case 2:
        if (!outboxes_.empty()) outboxes_.front()->Restart();
        break;
      case 3:
        mirrors_.front()->Restart();
        break;
      default:
        break;
    }
    PlanFaults();
  });
}

void History::StartServer() {
  auto server = Server::Start(&schedule_, &disk_, &record_, &network_, options_);
  if (!server.ok()) return record_.Violate(server.status().ToString());
  server_ = *std::move(server);
  schedule_.Trace("server: starts at revision ", server_->session().snapshot()->revision);
  record_.CheckStarted(server_->session());
}

// The process was killed. It is in the middle of an event, so that its memory is freed later.
void History::EndServerSoon() {
  ++crashes_;
  schedule_.Trace("server: is killed");
  schedule_.After(absl::ZeroDuration(), [this] {
    server_.reset();
    disk_.Restart();
    schedule_.After(schedule_.Pick(absl::ZeroDuration(), absl::Seconds(5)), [this] {
      if (!server_) StartServer();
    });
  });
}

void History::StopServer() {
  if (!server_ || disk_.is_killed()) return;
  schedule_.Trace("server: stops");
  server_.reset();
  if (disk_.is_killed()) return;  // during a write of the end
  schedule_.After(schedule_.Pick(absl::ZeroDuration(), absl::Seconds(5)), [this] {
    if (!server_ && !disk_.is_killed()) StartServer();
  });
}

void History::RunUntil(const std::function<bool()>& done) {
  while (record_.violation().empty() && !done()) {
    if (!schedule_.RunNext() || schedule_.num_run() > kMaxEvents) {
      return record_.Violate(absl::StrCat("liveness: the history does not end: ", Waiting()));
    }
    if (server_ && !disk_.is_killed()) record_.CheckServer(server_->session());
  }
}

bool History::RobotsAreDone() {
  return std::all_of(editors_.begin(), editors_.end(), [](const auto& e) { return e->done(); }) &&
         std::all_of(outboxes_.begin(), outboxes_.end(), [](const auto& o) { return o->done(); });
}

bool History::MirrorsAreUpToDate() const {
  return std::all_of(mirrors_.begin(), mirrors_.end(),
                     [this](const auto& m) { return m->revision() == record_.newest(); });
}

std::string History::Waiting() {
  std::string waiting =
      absl::StrCat("faults ", faults_, ", server ", server_ != nullptr, ", killed ",
                   disk_.is_killed(), ", newest revision ", record_.newest());
  for (const auto& editor : editors_) absl::StrAppend(&waiting, ", editor ", editor->done());
  for (const auto& outbox : outboxes_) {
    absl::StrAppend(&waiting, ", outbox ", outbox->done(), " ", outbox->problem().ToString());
  }
  for (const auto& mirror : mirrors_) absl::StrAppend(&waiting, ", mirror ", mirror->revision());
  return waiting;
}

}  // namespace

Outcome RunHistory(uint64_t seed, Plant plant, Files files, const std::string& folder,
                   bool traces) {
  return History(seed, plant, files, folder, traces).Run();
}

}  // namespace hypermap::histories
