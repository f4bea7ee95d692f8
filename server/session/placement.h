// Which server owns which map, among servers that share a store.
#ifndef HYPERMAP_SERVER_SESSION_PLACEMENT_H_
#define HYPERMAP_SERVER_SESSION_PLACEMENT_H_

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include "absl/types/span.h"
#include "map/snapshot.h"
#include "storage/map_store.h"

namespace hypermap::server {

// Every server plans for itself, by the same survey and the same rule (map_assignment.h), and so
// they agree mostly. That two of them don't agree does no harm, because the store gives a map to
// one of them only. Not thread safe.
//
// A server that is drained owns no maps. If all that live are drained, each keeps those that it
// has, and all take those of servers that go.
class Placement {
 public:
  // A server that has just come gets no maps of others for so long, lest maps move to and fro while
  // servers restart.
  static constexpr absl::Duration kSettle = absl::Seconds(5);
  // A map without an owner is left to the server that it belongs to for so long; then any takes it.
  static constexpr absl::Duration kPatience = absl::Seconds(1);

  explicit Placement(std::string server_id) : server_id_(std::move(server_id)) {}

  // A map that this server lists.
  struct Listed {
    std::string name;
    bool is_open = false;
    bool is_follower = false;  // if it is open
    // Of its session, also of one that does not work any more; 0 if it has none.
    uint64_t incarnation = 0;
    Revision revision = 0;  // that this session shows
  };

  enum class Action {
    kOwn,     // open it for writing; it may be followed until then
    kFollow,  // open it for reading; it may be owned until then
    kForget,  // it is no longer in the store
    kRenew,   // the store has lost revisions of it: another incarnation is to begin
    kKeep,    // it is open as it should be
  };
  struct Task {
    std::string map;
    Action action = Action::kKeep;
    std::string owner_address;  // of the owner; empty if there is none, or it is this server
    Revision revision = 0;      // that the store has; kRenew: that was shown
    uint64_t incarnation = 0;   // that the store has
  };
  // Returns what is to be done with each map of the survey and of the list, at the time `now` of
  // any clock that never goes back.
  std::vector<Task> Plan(const storage::Survey& survey, absl::Span<const Listed> listed,
                         absl::Duration now);

  // How long after the last plan a survey will tell what can be foreseen: that the lease of another
  // server ends, or that a map has been without an owner for kPatience. Infinite if neither can.
  absl::Duration UntilChange() const { return until_change_; }

 private:
  struct Shown {
    uint64_t incarnation = 0;
    Revision revision = 0;
  };

  // Notes which revisions this server has shown of the maps of the survey.
  void NoteShown(const storage::Survey& survey, absl::Span<const Listed> listed);
  // Whether the store has lost revisions that this server has shown.
  bool HasLost(const storage::Survey::Map& map) const;
  // Notes which servers and which maps without an owner there are, since when.
  void Note(const storage::Survey& survey, absl::Duration now);
  // The servers among which maps are divided: of those that may take maps, the ones that have
  // settled, or all if none has.
  std::vector<std::string> Homes(absl::Duration now) const;
  // `is_home`: the map belongs to this server.
  bool ShouldOwn(const storage::Survey::Map& map, bool is_home, bool is_owner,
                 absl::Duration now) const;

  const std::string server_id_;
  std::map<std::string, absl::Duration> servers_;  // id -> since when it lives
  std::map<std::string, std::string> addresses_;   // of these
  bool all_drained_ = false;                       // whether all these servers are drained
  std::vector<std::string> may_take_;              // ids of the servers that may take maps
  std::map<std::string, absl::Duration> unowned_;  // map -> since when it has no owner
  std::map<std::string, Shown> shown_;             // map -> the newest revision, also once closed
  absl::Duration until_change_ = absl::InfiniteDuration();
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_PLACEMENT_H_
