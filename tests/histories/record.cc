#include "tests/histories/record.h"

#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "map/edits/difference.h"
#include "server/fusion/map_fusion.h"

namespace hypermap::histories {
namespace {

bool AreEqual(const Snapshot& a, const Snapshot& b) {
  return a.revision == b.revision && Difference(a, b).empty() && Difference(b, a).empty();
}

}  // namespace

void Record::Violate(absl::string_view what) {
  if (violation_.empty()) violation_ = std::string(what);
}

void Record::Committed(absl::Span<const storage::Commit> commits) {
  perhaps_.clear();
  for (const storage::Commit& commit : commits) Commit(commit);
}

void Record::MayBeCommitted(absl::Span<const storage::Commit> commits) {
  perhaps_.assign(commits.begin(), commits.end());
}

void Record::Commit(const storage::Commit& commit) {
  const SnapshotPtr& snapshot = commit.applied.snapshot;
  const Revision revision = snapshot->revision;
  if (revision != newest() + 1) {
    return Violate(absl::StrCat("one history: revision ", revision, " follows ", newest()));
  }
  if (!made_.empty() && commit.time < made_.rbegin()->second.time) {
    Violate(absl::StrCat("one history: the time of revision ", revision, " goes back"));
  }
  if (!commit.request_id.empty() && !requests_.emplace(commit.request_id, revision).second) {
    Violate(absl::StrCat("exactly once: request ", commit.request_id, " is carried out in ",
                         requests_[commit.request_id], " and in ", revision));
  }
  made_[revision] = {snapshot, commit.time, commit.request_id, commit.applied.changes.size()};
  for (const storage::FusionChange& change : commit.fusion) {
    for (const storage::LoggedObservation& o : change.observations) {
      if (!observations_.emplace(o.key.robot, o.key.sequence).second) {
        Violate(absl::StrCat("exactly once: observation ", o.key.sequence, " of ", o.key.robot,
                             " is accepted twice"));
      }
      const absl::StatusOr<Observation> observation = fusion_.codec.decode_observation(o.body);
      if (!observation.ok()) return Violate("an observation in the log can't be read");
      for (const Detection& detection : observation->detections) {
        for (const auto& [label, score] : detection.scores) {
          // The other label is that of the thing itself.
          if (label != kSeenThing && ++observed_[label] > 1) {
            Violate(absl::StrCat("exactly once: the observation of ", label, " is accepted twice"));
          }
        }
      }
    }
    log_.Apply(change);
  }
  for (const storage::FusionChange& change : commit.fusion) CheckFold(*snapshot, change.layer);
}

// Folding the whole log again finds nothing to edit.
void Record::CheckFold(const Snapshot& snapshot, const std::string& layer) {
  server::MemoryFusionLog log = log_;
  const auto fusion = server::MapFusion::Open(&log, &fusion_, Limits());
  if (!fusion.ok()) return Violate(fusion.status().ToString());
  const auto reaction = (*fusion)->Run(snapshot, server::RebuildFusion{layer, "", ""});
  if (!reaction.ok()) return Violate(absl::StrCat("fold: ", reaction.status().ToString()));
  if (reaction->edits.empty()) return;
  Violate(absl::StrCat("fused layer: ", layer, " at revision ", snapshot.revision, " differs by ",
                       reaction->edits.size(), " edits from the fold of its log"));
}

void Record::CheckServer(const server::MapSession& session) {
  const SnapshotPtr snapshot = session.snapshot();
  if (snapshot->revision == newest()) return;
  Violate(absl::StrCat("visible = on disk: the server shows revision ", snapshot->revision,
                       ", the disk has ", newest()));
}

void Record::CheckStarted(const server::MapSession& session) {
  const SnapshotPtr snapshot = session.snapshot();
  const std::vector<storage::Commit> perhaps = std::exchange(perhaps_, {});
  const bool is_there =
      !perhaps.empty() && snapshot->revision == perhaps.back().applied.snapshot->revision;
  if (is_there) Committed(perhaps);
  if (incarnation_ != 0 && session.incarnation() != incarnation_) {
    Violate("one history: the map is another incarnation after a crash");
  }
  incarnation_ = session.incarnation();
  if (snapshot->revision != newest()) {
    return Violate(absl::StrCat("durable: the server has revision ", snapshot->revision,
                                " after a crash, and had ", newest(), " before"));
  }
  if (made_.empty() || AreEqual(*snapshot, *made_.rbegin()->second.snapshot)) return;
  Violate(absl::StrCat("durable: revision ", newest(), " differs after a crash"));
}

void Record::Acknowledged(const std::string& request_id, Revision revision) {
  const auto found = requests_.find(request_id);
  if (found != requests_.end() && found->second == revision) return;
  Violate(absl::StrCat("acknowledged = durable: request ", request_id, " was acknowledged as ",
                       revision, ", but is ",
                       found == requests_.end() ? "not there" : absl::StrCat(found->second)));
}

void Record::ObservationAcknowledged(const std::string& robot, int64_t sequence) {
  if (observations_.count({robot, sequence}) > 0) return;
  Violate(absl::StrCat("acknowledged = durable: observation ", sequence, " of ", robot,
                       " was acknowledged, but is not in the log"));
}

void Record::CheckReplica(const client::WatchEvent& event, const client::KnownRevision& after,
                          Revision before) {
  const Revision revision = event.revision;
  const auto made = made_.find(revision);
  // Revision 0 is the map as it was created.
  if (made == made_.end() && revision != 0) {
    return Violate(absl::StrCat("one history: a replica was told revision ", revision,
                                ", which is not on disk"));
  }
  if (!event.snapshot && before >= 0) {
    if (revision < before || (revision == before && event.num_changes > 0)) {
      Violate(absl::StrCat("no repetition: revision ", revision, " was told after ", before));
    }
    for (auto it = made_.upper_bound(before); it != made_.end() && it->first < revision; ++it) {
      if (it->second.num_changes == 0) continue;
      Violate(absl::StrCat("no gap: revision ", revision, " was told after ", before));
      break;
    }
  }
  if (revision == 0) return;
  if (after.time != made->second.time) {
    Violate(absl::StrCat("replica = server: another time of revision ", revision));
  }
  if (AreEqual(*after.snapshot, *made->second.snapshot)) return;
  Violate(absl::StrCat("replica = server: the replica differs at revision ", revision));
}

int64_t Record::TimesObserved(const std::string& label) const {
  const auto found = observed_.find(label);
  return found == observed_.end() ? 0 : found->second;
}

}  // namespace hypermap::histories
