#include "server/session/object_history.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"

namespace hypermap::server {
namespace {

// Entries that are read in one task of the writer's thread.
constexpr int kReadEntries = 64;

// Collects the events of all tracks. Which tracks the object consists of is known at the end only,
// so that events of all are kept; a track that is merged hands its events over.
class Histories {
 public:
  void Add(const Evidence& evidence, const fusion::FoldReport& report) {
    if (evidence.fact) return AddFact(evidence);
    const ObservationKey& at = evidence.key.after;
    for (const fusion::FoldReport::Association& association : report.associations) {
      if (association.track.empty()) continue;
      std::vector<ObjectEvent>& events = of_track_[association.track];
      const bool founds = association.track == TrackFoundedBy(at, association.detection);
      events.push_back({founds ? ObjectEventKind::kFounded : ObjectEventKind::kSeen, at,
                        association.detection, association.score,
                        ExistenceOf(report, association.track), ""});
    }
    for (const fusion::TrackKey& track : report.missed) {
      of_track_[track].push_back(
          {ObjectEventKind::kMissed, at, 0, 0.0, ExistenceOf(report, track), ""});
    }
    for (const auto& [from, into] : report.merged) {
      std::vector<ObjectEvent> moved = std::exchange(of_track_[from], {});
      std::vector<ObjectEvent>& events = of_track_[into];
      std::move(moved.begin(), moved.end(), std::back_inserter(events));
      events.push_back({ObjectEventKind::kMerged, at, 0, 0.0, ExistenceOf(report, into), from});
    }
  }

  // Takes the events of the tracks, ordered by observation.
  std::vector<ObjectEvent> Of(const std::vector<fusion::TrackKey>& tracks) {
    std::vector<ObjectEvent> events;
    for (const fusion::TrackKey& track : tracks) {
      std::vector<ObjectEvent>& own = of_track_[track];
      std::move(own.begin(), own.end(), std::back_inserter(events));
      own.clear();
    }
    std::stable_sort(events.begin(), events.end(),
                     [](const auto& a, const auto& b) { return a.at < b.at; });
    return events;
  }

 private:
  static fusion::TrackKey TrackFoundedBy(const ObservationKey& at, int detection) {
    return absl::StrCat(at.robot, "/", at.sequence, "/", detection);
  }

  static std::optional<double> ExistenceOf(const fusion::FoldReport& report,
                                           const fusion::TrackKey& track) {
    const auto existence = report.existence.find(track);
    if (existence == report.existence.end()) return std::nullopt;
    return existence->second;
  }

  void AddFact(const Evidence& evidence) {
    const bool pin = evidence.fact->kind == fusion::OperatorFact::Kind::kPin;
    of_track_[evidence.fact->track].push_back(
        {pin ? ObjectEventKind::kPinned : ObjectEventKind::kRemoved, evidence.key.after, 0, 0.0,
         std::nullopt, ""});
  }

  std::map<fusion::TrackKey, std::vector<ObjectEvent>> of_track_;
};

// Folds the entries after `beginning`.
absl::Status FoldAll(MapSession& session, const std::string& layer, FoldPoint beginning,
                     const PoseCorrections& corrections, const fusion::Strategy& strategy,
                     const std::function<absl::Status()>& check_wanted, Histories* histories) {
  fusion::StatePtr state = std::move(beginning.state);
  storage::LogKey at = std::move(beginning.key);
  while (true) {
    HYPERMAP_RETURN_IF_ERROR(check_wanted());
    HYPERMAP_ASSIGN_OR_RETURN(const std::vector<Evidence> entries,
                              session.ReadEvidence(layer, at, kReadEntries));
    for (Evidence evidence : entries) {
      HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
      if (evidence.observation) {
        evidence.observation = corrections.Apply(std::move(evidence.observation));
      }
      fusion::FoldReport report;
      state = Fold(strategy, state, evidence, &report);
      histories->Add(evidence, report);
      at = evidence.key;
    }
    if (entries.size() < kReadEntries) return absl::OkStatus();
  }
}

}  // namespace

absl::StatusOr<ObjectHistory> ExplainObject(MapSession& session, const std::string& layer,
                                            ObjectId object_id,
                                            const std::function<absl::Status()>& check_wanted) {
  ObjectHistory history;
  history.map = session.header().name;
  history.incarnation = session.incarnation();
  history.object_id = object_id;
  std::vector<fusion::TrackKey> tracks;
  PoseCorrections corrections;
  absl::Status status = session.InspectFusion(layer, [&](FusedLayer& fused) {
    history.revision = session.snapshot()->revision;
    history.strategy = fused.settings().strategy;
    history.parameters = fused.settings().parameters;
    tracks = fused.TracksOf(object_id);
    corrections = fused.log().corrections();
    return absl::OkStatus();
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  if (tracks.empty()) {
    return absl::NotFoundError(
        absl::StrCat("layer \"", layer, "\" has no object ", object_id, " that fusion knows of"));
  }
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::unique_ptr<fusion::Strategy> strategy,
      session.options().fusion.make_strategy(history.strategy, history.parameters));
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<storage::FusionBase> base,
                            session.ReadEvidenceBase(layer));
  HYPERMAP_ASSIGN_OR_RETURN(FoldPoint beginning, BeginningOfLog(base, *strategy));
  const storage::LogKey begin = beginning.key;
  if (base) history.forgotten_until = begin.after.stamp;
  Histories histories;
  status = FoldAll(session, layer, std::move(beginning), corrections, *strategy, check_wanted,
                   &histories);
  HYPERMAP_RETURN_IF_ERROR(status);
  status = session.InspectFusion(layer, [&](FusedLayer& fused) {
    if (fused.log().begin() == begin) return absl::OkStatus();
    return absl::UnavailableError("evidence was forgotten while it was read");
  });
  HYPERMAP_RETURN_IF_ERROR(status);
  history.track = tracks.front();
  history.events = histories.Of(tracks);
  return history;
}

}  // namespace hypermap::server
