#include <atomic>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "client_libs/cpp/replica/replica.h"
#include "tests/prove/proofs.h"
#include "tests/prove/questions.h"
#include "tests/prove/site.h"

namespace hypermap::prove {
namespace {

constexpr int kBackups = 4;
// Past revisions of each backup that are compared with the model.
constexpr int kPastRevisions = 10;

// A file, and what was acknowledged when its making began.
struct Backup {
  std::string path;
  Revision acknowledged = 0;
};

absl::Status WriteBackup(const Site& site, const std::string& path) {
  client::Client client = site.NewClient();
  client::ByteReader reader = client.BackupMap(kMap);
  std::ofstream file(path, std::ios::binary);
  while (const std::optional<std::string> bytes = reader.Next()) file << *bytes;
  HYPERMAP_RETURN_IF_ERROR(reader.status());
  file.close();
  return file ? absl::OkStatus() : absl::InternalError(absl::StrCat(path, " can't be written"));
}

// Makes backups while the load is written, one in each of its parts.
absl::StatusOr<std::vector<Backup>> BackUpUnderLoad(Site& site, const Sizes& sizes) {
  std::vector<Backup> backups;
  WriterGroup writers(site, sizes.writers, {.edits = sizes.edits}, sizes.seed);
  const int64_t all = int64_t{sizes.writers} * sizes.edits;
  for (int i = 1; i <= kBackups; ++i) {
    while (site.model().num_edits() < all * i / (kBackups + 1) && !writers.done()) {
      absl::SleepFor(absl::Milliseconds(1));
    }
    backups.push_back({absl::StrCat(site.folder(), "/backup-", i, ".gpkg"), site.model().newest()});
    HYPERMAP_RETURN_IF_ERROR(WriteBackup(site, backups.back().path));
  }
  HYPERMAP_RETURN_IF_ERROR(writers.Wait());
  return backups;
}

absl::StatusOr<client::MapEntry> Restore(const Site& site, const Backup& backup, bool replace) {
  std::ifstream file(backup.path, std::ios::binary);
  return site.NewClient().RestoreMap(kMap, file, replace);
}

// What is wrong with restored maps.
struct Wrong {
  int64_t lost = 0;      // revisions older than an acknowledged one
  int64_t findings = 0;  // of checks
  int64_t states = 0;    // that differ from the model, now and in the past
  int64_t answers = 0;   // to random questions

  bool none() const { return lost + findings + states + answers == 0; }
};

// Compares a restored map with the model.
absl::Status Compare(const Site& site, const Model& model, const client::MapEntry& map,
                     const Backup& backup, const Sizes& sizes, Wrong& wrong) {
  client::Client client = site.NewClient();
  wrong.lost += map.revision < backup.acknowledged;
  const absl::StatusOr<CheckReport> report = client.CheckMap(kMap);
  HYPERMAP_RETURN_IF_ERROR(report.status());
  wrong.findings += static_cast<int64_t>(report->findings.size());
  const State state = model.At(map.revision, {});
  const absl::StatusOr<State> now = AskState(client, {});
  HYPERMAP_RETURN_IF_ERROR(now.status());
  wrong.states += !(*now == state);
  Rng rng(sizes.seed + static_cast<uint64_t>(map.revision));
  for (int i = 0; i < kPastRevisions; ++i) {
    // The layers were made by the revisions before.
    const Revision past = 3 + static_cast<Revision>(rng() % (map.revision - 2));
    const absl::StatusOr<State> then = AskState(client, {}, past);
    HYPERMAP_RETURN_IF_ERROR(then.status());
    wrong.states += !(*then == model.At(past, {}));
  }
  for (int i = 0; i < sizes.queries; ++i) {
    const Question question = RandomQuestion(i, rng);
    const absl::StatusOr<Answer> answer = Ask(client, question);
    HYPERMAP_RETURN_IF_ERROR(answer.status());
    wrong.answers += answer->revision != map.revision || !IsRight(*answer, question, state);
  }
  return absl::OkStatus();
}

// Restores each backup on another server, in place of the one before.
absl::StatusOr<Wrong> RestoreElsewhere(Site& site, const std::vector<Backup>& backups,
                                       const Sizes& sizes) {
  const std::unique_ptr<Site> elsewhere = site.Elsewhere();
  HYPERMAP_RETURN_IF_ERROR(elsewhere->server().Start());
  Wrong wrong;
  for (const Backup& backup : backups) {
    const bool replace = &backup != &backups.front();
    const absl::StatusOr<client::MapEntry> map = Restore(*elsewhere, backup, replace);
    HYPERMAP_RETURN_IF_ERROR(map.status());
    HYPERMAP_RETURN_IF_ERROR(Compare(*elsewhere, site.model(), *map, backup, sizes, wrong));
  }
  return wrong;
}

// Asks for the map all the time, without retries. While the map is replaced, it may be told
// UNAVAILABLE, but nothing else.
class Visitor {
 public:
  explicit Visitor(const Site& site)
      : client_(site.server_address(), {.retry_for = absl::ZeroDuration()}), thread_([this] {
          while (!stop_) {
            const absl::Status status = client_.GetMap(kMap).status();
            num_unavailable_ += absl::IsUnavailable(status);
            num_wrong_ += !status.ok() && !absl::IsUnavailable(status);
          }
        }) {}
  ~Visitor() { Stop(); }

  void Stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  // After Stop.
  int64_t num_unavailable() const { return num_unavailable_; }
  int64_t num_wrong() const { return num_wrong_; }

 private:
  client::Client client_;
  std::atomic<bool> stop_ = false;
  int64_t num_unavailable_ = 0;
  int64_t num_wrong_ = 0;
  std::thread thread_;
};

// The model of a map that begins with a restored state.
std::unique_ptr<Model> BeginWith(const State& state, Revision revision) {
  Written begin;
  begin.revision = revision;
  for (const auto& [id, thing] : state.things) begin.things.emplace_back(id, thing);
  for (const auto& [cell, value] : state.cells) begin.cells.emplace_back(cell, value);
  auto model = std::make_unique<Model>();
  model->Add(std::move(begin));
  return model;
}

// Waits until the replica has this revision of this incarnation.
absl::Status AwaitReplica(const client::Replica& replica, const client::MapEntry& map) {
  const absl::Time deadline = absl::Now() + kPatience;
  while (replica.state().incarnation != map.incarnation) {
    if (absl::Now() > deadline) return absl::DeadlineExceededError("the replica stays as it was");
    absl::SleepFor(absl::Milliseconds(5));
  }
  return replica.AwaitRevision(map.revision, kPatience);
}

// Compares the whole replica with its server.
absl::StatusOr<bool> IsLikeServer(const client::Replica& replica, const Site& site) {
  client::Client client = site.NewClient();
  const absl::StatusOr<client::MapEntry> map = client.GetMap(kMap);
  HYPERMAP_RETURN_IF_ERROR(map.status());
  HYPERMAP_RETURN_IF_ERROR(AwaitReplica(replica, *map));
  const absl::StatusOr<std::string> there = TellAll(client);
  HYPERMAP_RETURN_IF_ERROR(there.status());
  const absl::StatusOr<std::string> here = TellAll(replica);
  HYPERMAP_RETURN_IF_ERROR(here.status());
  return *here == *there;
}

}  // namespace

absl::StatusOr<Verdict> ProveRestore(Site& site, const Sizes& sizes) {
  HYPERMAP_RETURN_IF_ERROR(site.Start());
  const absl::StatusOr<std::unique_ptr<client::Replica>> replica =
      client::Replica::Open(site.NewClient(), {.map = kMap, .folder = site.folder() + "/robot"});
  HYPERMAP_RETURN_IF_ERROR(replica.status());
  WatcherGroup watchers(site, sizes.watchers, sizes.seed);
  HYPERMAP_RETURN_IF_ERROR(watchers.WaitUntilBegun());
  const absl::StatusOr<std::vector<Backup>> backups = BackUpUnderLoad(site, sizes);
  HYPERMAP_RETURN_IF_ERROR(backups.status());
  const int64_t unaccounted = site.model().Sort();
  const absl::StatusOr<Wrong> elsewhere = RestoreElsewhere(site, *backups, sizes);
  HYPERMAP_RETURN_IF_ERROR(elsewhere.status());

  // In place of the map, which has gone on since.
  client::Client client = site.NewClient();
  const absl::StatusOr<client::MapEntry> before = client.GetMap(kMap);
  HYPERMAP_RETURN_IF_ERROR(before.status());
  const Backup& chosen = (*backups)[kBackups / 2];
  Visitor visitor(site);
  const absl::StatusOr<client::MapEntry> restored = Restore(site, chosen, /*replace=*/true);
  visitor.Stop();
  HYPERMAP_RETURN_IF_ERROR(restored.status());
  Wrong here;
  HYPERMAP_RETURN_IF_ERROR(Compare(site, site.model(), *restored, chosen, sizes, here));
  const std::unique_ptr<Model> old_model =
      site.Exchange(BeginWith(site.model().At(restored->revision, {}), restored->revision));
  WriterGroup writers(site, sizes.writers, {.edits = sizes.edits / 4}, sizes.seed + 1);
  HYPERMAP_RETURN_IF_ERROR(writers.Wait());
  HYPERMAP_RETURN_IF_ERROR(watchers.WaitUntilFollowing(restored->incarnation));
  HYPERMAP_RETURN_IF_ERROR(watchers.WaitUntil(site.model().newest()));
  const int64_t unaccounted_since = site.model().Sort();

  Faults faults;
  int64_t states_differ = 0;
  for (const auto& follower : watchers.followers()) {
    faults += follower->Check(*old_model, before->incarnation);
    faults += follower->Check(site.model(), restored->incarnation);
    states_differ +=
        !(follower->state() == site.model().At(site.model().newest(), follower->selection()));
  }
  const absl::StatusOr<bool> replica_equals = IsLikeServer(**replica, site);
  HYPERMAP_RETURN_IF_ERROR(replica_equals.status());
  const bool holds = elsewhere->none() && here.none() && unaccounted + unaccounted_since == 0 &&
                     restored->incarnation != before->incarnation && visitor.num_wrong() == 0 &&
                     faults.none() && states_differ == 0 && *replica_equals;
  return Verdict{{"proof", "restore"},
                 {"seed", sizes.seed},
                 {"edits", old_model->num_edits()},
                 {"backups", backups->size()},
                 {"acknowledged_revisions_lost", elsewhere->lost + here.lost},
                 {"findings_of_checks", elsewhere->findings + here.findings},
                 {"states_differ_from_model", elsewhere->states + here.states},
                 {"wrong_answers", elsewhere->answers + here.answers},
                 {"told_unavailable_meanwhile", visitor.num_unavailable()},
                 {"told_otherwise_meanwhile", visitor.num_wrong()},
                 {"restored_revision", restored->revision},
                 {"replaced_revision", before->revision},
                 {"edits_since", site.model().num_edits()},
                 {"unaccounted_revisions", unaccounted + unaccounted_since},
                 {"watchers", sizes.watchers},
                 {"gaps", faults.gaps},
                 {"repeats", faults.repeats},
                 {"reorders", faults.reorders},
                 {"wrong", faults.wrong},
                 {"watchers_differ_from_model", states_differ},
                 {"replica_equals_server", *replica_equals},
                 {"holds", holds}};
}

}  // namespace hypermap::prove
