#include "client_libs/bench/settlement.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "base/sync/deadline.h"

namespace hypermap::bench {
namespace {

constexpr absl::Duration kLookAgain = absl::Milliseconds(20);
constexpr int kRevisionsOfPage = 1000;
// Objects are put up to some metres from their place.
constexpr double kMargin_m = 10.0;
// How often the layers are compared anew because others edit the map at the same time.
constexpr int kMaxComparisons = 5;

// Waits until all followers have reached the revision, and returns how many have not at the
// deadline.
template <typename Follower, typename RevisionOf>
int CountBehind(const std::vector<Follower*>& followers, Revision newest, const Deadline& deadline,
                RevisionOf revision_of) {
  while (true) {
    const auto behind = std::count_if(followers.begin(), followers.end(),
                                      [&](const Follower* f) { return revision_of(*f) < newest; });
    if (behind == 0 || deadline.has_passed()) return static_cast<int>(behind);
    absl::SleepFor(kLookAgain);
  }
}

// The revisions in (start, newest] that have changes, of which each watcher must have been told.
absl::StatusOr<RevisionSet> RevisionsWithChanges(client::Client& client, const std::string& map,
                                                 Revision start, Revision newest) {
  RevisionSet revisions(start);
  client::RevisionPage page{.after = start, .before = newest + 1, .size = kRevisionsOfPage};
  while (page.after < newest) {
    HYPERMAP_ASSIGN_OR_RETURN(const client::RevisionList list, client.ListRevisions(map, page));
    if (list.revisions.empty() || list.revisions.front().revision != page.after + 1) {
      return absl::OutOfRangeError(
          absl::StrCat("the server does not list revision ", page.after + 1));
    }
    for (const client::RevisionRecord& record : list.revisions) {
      if (record.num_changes > 0) revisions.Add(record.revision);
    }
    page.after = list.revisions.back().revision;
  }
  return revisions;
}

// The versions of all objects of the edited layer.
absl::StatusOr<std::map<ObjectId, Revision>> VersionsOfShapes(client::Client& client,
                                                              const std::string& map,
                                                              const ImaginedSite& site) {
  const Polygon everywhere = Polygon::FromBox(
      Box{{-kMargin_m, -kMargin_m}, {site.side_m() + kMargin_m, site.side_m() + kMargin_m}});
  std::map<ObjectId, Revision> versions;
  client::AnswerReader reader = client.QueryArea(map, everywhere, {{kShapesLayer}, ""});
  while (const std::optional<client::LayerPart> part = reader.Next()) {
    for (const SemanticObject& object : part->objects) versions[object.id] = object.version;
  }
  HYPERMAP_RETURN_IF_ERROR(reader.status());
  return versions;
}

std::map<std::string, int64_t> SizesOf(const client::LayerList& list) {
  std::map<std::string, int64_t> sizes;
  for (const client::LayerEntry& layer : list.layers) sizes[layer.spec.name] = layer.size;
  return sizes;
}

// Returns the number of replicas whose layers have other sizes than the server's at the same
// revision. Replicas of another revision are left out, unless the map stands still.
absl::StatusOr<int> CountDifferent(client::Client& client, const std::string& map,
                                   const std::vector<ReplicaWorker*>& replicas) {
  int different = 0;
  for (int i = 0; i < kMaxComparisons; ++i) {
    HYPERMAP_ASSIGN_OR_RETURN(const client::LayerList of_server, client.ListLayers(map));
    CountBehind(replicas, of_server.revision, Deadline(kAnswerLimit),
                [](const ReplicaWorker& replica) { return replica.revision(); });
    different = 0;
    bool has_moved = false;
    for (const ReplicaWorker* replica : replicas) {
      const client::LayerList of_replica = replica->ListLayers();
      has_moved |= of_replica.revision > of_server.revision;
      different += SizesOf(of_replica) != SizesOf(of_server);
    }
    if (!has_moved) return different;
  }
  return absl::AbortedError("others change the map, so that replicas can't be compared with it");
}

void CompareRobots(const std::vector<ObserveWorker*>& robots, Consistency* found) {
  const Deadline deadline(kSettleLimit);
  int num_unchecked = 0;
  absl::Status why;
  for (ObserveWorker* robot : robots) {
    found->observations_acknowledged += robot->num_acknowledged();
    const absl::StatusOr<int64_t> lost = robot->CountLost(deadline.left());
    if (lost.ok()) {
      found->observations_lost += *lost;
    } else {
      ++num_unchecked;
      why = lost.status();
    }
    if (robot->newest() > found->newest) {
      found->problems.push_back(absl::StrCat("an observation was acknowledged at revision ",
                                             robot->newest(), ", which is not there"));
    }
  }
  if (num_unchecked == 0) return;
  found->problems.push_back(absl::StrCat("the observations of ", num_unchecked,
                                         " robots were not checked: ", why.ToString()));
}

absl::Status CompareEditors(client::Client& client, const FleetOptions& options,
                            const ImaginedSite& site, const std::vector<EditWorker*>& editors,
                            Consistency* found) {
  HYPERMAP_ASSIGN_OR_RETURN(const auto versions, VersionsOfShapes(client, options.map, site));
  for (const EditWorker* editor : editors) {
    const EditFaults faults = editor->ledger().Compare(versions);
    found->edits_acknowledged += editor->ledger().num_acknowledged();
    found->edits_lost += faults.lost;
    found->edits_repeated += faults.repeated;
    if (editor->ledger().newest() > found->newest) {
      found->problems.push_back(absl::StrCat("an edit was acknowledged at revision ",
                                             editor->ledger().newest(), ", which is not there"));
    }
  }
  return absl::OkStatus();
}

absl::Status CompareWatchers(client::Client& client, const FleetOptions& options, Revision start,
                             const std::vector<WatchWorker*>& watchers, Consistency* found) {
  for (const WatchWorker* watcher : watchers) {
    const WatchFaults faults = watcher->track().faults();
    found->revisions_repeated += faults.repeated;
    found->revisions_reordered += faults.reordered;
  }
  HYPERMAP_ASSIGN_OR_RETURN(const RevisionSet expected,
                            RevisionsWithChanges(client, options.map, start, found->newest));
  found->revisions_with_changes = expected.size();
  for (const WatchWorker* watcher : watchers) {
    found->revisions_missed += watcher->track().CountMissing(expected);
  }
  return absl::OkStatus();
}

// Everything but the robots, and all that needs the newest revision.
absl::Status CompareMap(client::Client& client, const FleetOptions& options,
                        const ImaginedSite& site, const client::MapEntry& start,
                        const Witnesses& witnesses, Consistency* found) {
  // From here on the client takes no answer of a server that does not have all that was
  // acknowledged.
  client::CallOptions linearizable;
  linearizable.as_of.consistency = hypermap::Consistency::kLinearizable;
  HYPERMAP_RETURN_IF_ERROR(client.QueryPoint(options.map, Point{0, 0}, {}, linearizable).status());
  HYPERMAP_ASSIGN_OR_RETURN(const client::MapEntry map, client.GetMap(options.map));
  found->newest = map.revision;
  if (map.incarnation != start.incarnation) {
    return absl::AbortedError("the map is another incarnation than at the start");
  }
  const Deadline deadline(kSettleLimit);
  found->watchers_behind =
      CountBehind(witnesses.watchers, map.revision, deadline,
                  [](const WatchWorker& watcher) { return watcher.track().last(); });
  found->replicas_behind =
      CountBehind(witnesses.replicas, map.revision, deadline,
                  [](const ReplicaWorker& replica) { return replica.revision(); });
  HYPERMAP_RETURN_IF_ERROR(
      CompareWatchers(client, options, start.revision, witnesses.watchers, found));
  HYPERMAP_RETURN_IF_ERROR(CompareEditors(client, options, site, witnesses.editors, found));
  HYPERMAP_ASSIGN_OR_RETURN(found->replicas_different,
                            CountDifferent(client, options.map, witnesses.replicas));
  return absl::OkStatus();
}

}  // namespace

Consistency Settle(client::Client& client, const FleetOptions& options, const ImaginedSite& site,
                   const client::MapEntry& start, const Witnesses& witnesses) {
  Consistency found;
  found.first = start.revision;
  const absl::Status status = CompareMap(client, options, site, start, witnesses, &found);
  if (!status.ok()) found.problems.push_back(status.ToString());
  CompareRobots(witnesses.robots, &found);
  return found;
}

}  // namespace hypermap::bench
