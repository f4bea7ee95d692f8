#include <sqlite3.h>

#include <filesystem>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "tests/prove/proofs.h"

namespace hypermap::prove {
namespace {

// Runs PRAGMA integrity_check on a copy, so that the server finds its own files unchanged.
std::string CheckIntegrity(const Site& site) {
  const std::string copy = site.folder() + "/copy.gpkg";
  for (const char* suffix : {"", "-wal"}) {
    std::error_code error;
    std::filesystem::remove(copy + suffix, error);
    if (!std::filesystem::exists(site.map_file() + suffix)) continue;
    std::filesystem::copy_file(site.map_file() + suffix, copy + suffix, error);
    if (error) return error.message();
  }
  sqlite3* db = nullptr;
  std::string answer;
  if (sqlite3_open(copy.c_str(), &db) == SQLITE_OK) {
    char* message = nullptr;
    const auto append = [](void* to, int, char** values, char**) {
      absl::StrAppend(static_cast<std::string*>(to), values[0]);
      return 0;
    };
    if (sqlite3_exec(db, "PRAGMA integrity_check", append, &answer, &message) != SQLITE_OK) {
      answer = message != nullptr ? message : "failed";
      sqlite3_free(message);
    }
  }
  sqlite3_close(db);
  return answer;
}

struct Kills {
  int64_t kills = 0;
  int64_t damaged = 0;  // files that fail the check
  int64_t lost = 0;     // starts whose newest revision is older than an acknowledged one
};

// Waits until the writers make progress again: a batch after `before` was acknowledged.
bool WaitForLoad(const Model& model, Revision before, const WriterGroup& writers) {
  const absl::Time deadline = absl::Now() + absl::Minutes(2);
  while (model.newest() <= before && !writers.failed() && absl::Now() < deadline) {
    absl::SleepFor(absl::Milliseconds(1));
  }
  return model.newest() > before;
}

// Kills and restarts the server repeatedly.
absl::StatusOr<Kills> KillUnderLoad(Site& site, const Sizes& sizes, const WriterGroup& writers) {
  Rng rng(sizes.seed);
  Kills kills;
  client::Client client = site.NewClient();
  Revision acknowledged = site.model().newest();
  while (kills.kills < sizes.kills && WaitForLoad(site.model(), acknowledged, writers)) {
    absl::SleepFor(absl::Milliseconds(Uniform(rng, 0.0, 150.0)));
    site.server().Kill();
    acknowledged = site.model().newest();
    ++kills.kills;
    if (const std::string answer = CheckIntegrity(site); answer != "ok") ++kills.damaged;
    HYPERMAP_RETURN_IF_ERROR(site.server().Start());
    const absl::StatusOr<client::MapEntry> map = client.GetMap(kMap);
    HYPERMAP_RETURN_IF_ERROR(map.status());
    kills.lost += map->revision < acknowledged;
  }
  return kills;
}

}  // namespace

absl::StatusOr<Verdict> ProveKill(Site& site, const Sizes& sizes) {
  HYPERMAP_RETURN_IF_ERROR(site.Start());
  WatcherGroup watchers(site, sizes.watchers, sizes.seed);
  HYPERMAP_RETURN_IF_ERROR(watchers.WaitUntilBegun());
  WriterGroup writers(site, sizes.writers, {.edits = 1'000'000'000}, sizes.seed);
  const absl::StatusOr<Kills> kills = KillUnderLoad(site, sizes, writers);
  HYPERMAP_RETURN_IF_ERROR(writers.Stop());
  HYPERMAP_RETURN_IF_ERROR(kills.status());
  Model& model = site.model();
  HYPERMAP_RETURN_IF_ERROR(watchers.WaitUntil(model.newest()));

  // A batch that was lost or applied twice leaves a revision that was acknowledged to nobody or
  // twice. A batch that was applied partly is reported with other changes than were sent.
  const int64_t unaccounted = model.Sort();
  Faults faults;
  int64_t told = 0, resumed = 0, begun_anew = 0, states_differ = 0;
  for (const auto& follower : watchers.followers()) {
    faults += follower->Check(model);
    told += follower->num_told();
    resumed += follower->num_resumed();
    begun_anew += follower->num_begun_anew();
    states_differ += !(follower->state() == model.At(model.newest(), follower->selection()));
  }
  client::Client client = site.NewClient();
  const absl::StatusOr<State> now = AskState(client, {});
  HYPERMAP_RETURN_IF_ERROR(now.status());
  const absl::StatusOr<client::RevisionList> kept = client.ListRevisions(kMap);
  HYPERMAP_RETURN_IF_ERROR(kept.status());
  const bool compacted = sizes.history == 0 || kept->oldest > 0;
  const bool map_differs = !(*now == model.At(model.newest(), {}));
  // Without compaction every revision is kept, so a watch can always be resumed.
  const bool may_begin_anew = sizes.history != 0;
  const bool holds = (begun_anew == 0 || may_begin_anew) && faults.none() && unaccounted == 0 &&
                     kills->kills == sizes.kills && kills->lost == 0 && kills->damaged == 0 &&
                     states_differ == 0 && !map_differs && told > 0 && compacted;
  return Verdict{{"proof", "kill"},
                 {"seed", sizes.seed},
                 {"kills", kills->kills},
                 {"edits", model.num_edits()},
                 {"revisions", model.newest()},
                 {"oldest_revision_kept", kept->oldest},
                 {"watchers", sizes.watchers},
                 {"resumed", resumed},
                 {"begun_anew", begun_anew},
                 {"revisions_told", told},
                 {"acknowledged_revisions_lost", kills->lost},
                 {"unaccounted_revisions", unaccounted},
                 {"failed_integrity_checks", kills->damaged},
                 {"gaps", faults.gaps},
                 {"repeats", faults.repeats},
                 {"reorders", faults.reorders},
                 {"wrong", faults.wrong},
                 {"states_differ_from_model", states_differ},
                 {"map_differs_from_model", map_differs},
                 {"holds", holds}};
}

}  // namespace hypermap::prove
