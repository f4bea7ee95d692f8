// The registry of all maps of a server.
#ifndef HYPERMAP_SERVER_SESSION_SITE_H_
#define HYPERMAP_SERVER_SESSION_SITE_H_

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/sync/executor.h"
#include "base/sync/mutex.h"
#include "map/check_report.h"
#include "server/session/map_session.h"
#include "server/session/placement.h"
#include "server/session/placement_meters.h"
#include "server/session/read_index.h"
#include "server/session/store_comparison.h"
#include "storage/map_store.h"

namespace hypermap::server {

// The open sessions of the maps of one store. A map that can't be opened is listed with its error
// and affects no other map. Find never waits for a disk. Thread safe.
//
// At most Limits::max_maps maps are open; 0: any number. Further maps of the store are listed with
// RESOURCE_EXHAUSTED, and the first of them by name is opened once an open map has been deleted.
class Site {
 public:
  // Opens the maps of the store in the order of their names. Fails only if the store can't be
  // listed.
  static absl::StatusOr<std::unique_ptr<Site>> Open(std::unique_ptr<storage::MapStore> store,
                                                    const SessionOptions& options);

  // Calls Close.
  ~Site();

  struct Entry {
    std::string name;
    std::shared_ptr<MapSession> session;  // null if there is a problem
    // The error of opening the map, or the reason for which it does not work since
    // (MapSession::problem).
    absl::Status problem;

    // What can be done with the map at the moment.
    MapCondition condition() const {
      return session ? session->condition() : MapCondition{MapState::kClosed, problem};
    }
  };

  // The clock of all maps; tells jumps of the wall clock.
  ServerClock& clock() const { return *options_.clock; }

  // All maps, ordered by name.
  std::vector<Entry> List() const;

  // The map's session. NOT_FOUND naming the map, or Entry::problem.
  absl::StatusOr<std::shared_ptr<MapSession>> Find(const std::string& map) const;
  // OK unless another server is known to own the map: then NotOwnerError.
  absl::Status CheckOwner(const std::string& map) const;

  // Calls `done` with the newest revision that any server may have acknowledged when this was
  // called: at once if the store is this server's own, otherwise once the store has told it.
  // NOT_FOUND; UNAVAILABLE. `done` must not wait.
  void AskNewest(const std::string& map, ReadIndex::Callback done) const;

  struct NewMap {
    std::string name;
    std::string frame_id;
    std::string request_id;
  };
  using Fill = absl::FunctionRef<absl::Status(MapSession&)>;

  // Creates an empty map. If the same request has created the map before, it is returned as it is.
  // INVALID_ARGUMENT for the names, or if the request id was used for another request;
  // ALREADY_EXISTS; ABORTED while another call creates or deletes the map; RESOURCE_EXHAUSTED,
  // before anything is written, if there are max_maps maps, open or not. After any error there is
  // no map, or it is listed.
  absl::StatusOr<std::shared_ptr<MapSession>> Create(const NewMap& map);
  // As Create, but calls `fill` with the map before it is listed. If that fails, or the process
  // ends before `fill` has made a revision, the map is removed again.
  absl::StatusOr<std::shared_ptr<MapSession>> CreateFilled(const NewMap& map, Fill fill);

  // Removes a map (for good, or into the store's trash), also one that is not open, and opens
  // another one in its place if there was no room for all. FAILED_PRECONDITION if the request has
  // deleted an earlier map of that name; errors as MapStore::Delete; ABORTED as Create, and if the
  // map is another incarnation than the given one; 0 is any.
  absl::Status Delete(const std::string& map, const std::string& request_id,
                      uint64_t incarnation = 0);

  // As MapStore::CheckFile.
  absl::StatusOr<CheckReport> CheckFile(const std::string& path);

  struct Restoration {
    std::string map;
    std::string path;  // of a file that CheckFile has found to be clean; it is moved away
    bool replace = false;
    std::string request_id;
    uint64_t incarnation = 0;  // of the map to replace; 0 is any
  };
  // Makes a file a map, in place of the one of its name, which is deleted, also one that is not
  // open; UNAVAILABLE is its problem meanwhile. The map is another incarnation. If the same request
  // has restored the map before, it is returned as it is. ALREADY_EXISTS if there is a map that is
  // not to be replaced; ABORTED as Delete; RESOURCE_EXHAUSTED as Create; errors as
  // MapStore::Restore and Find.
  absl::StatusOr<std::shared_ptr<MapSession>> Restore(const Restoration& restoration);

  // Opens maps that could not be opened and perhaps can be by now: a damaged one after its file was
  // changed, others after a pause that doubles with each attempt, from kFirstPause to kLastPause.
  // To be called about every second; waits for the disk.
  static constexpr absl::Duration kFirstPause = absl::Seconds(1);
  static constexpr absl::Duration kLastPause = absl::Minutes(1);
  void ReopenMaps();

  // Compares what the session shows with what a shared store has. ABORTED if the store has another
  // incarnation of the map; errors of MapStore::Follow and of server::CompareWithStore.
  absl::StatusOr<StoreComparison> CompareWithStore(const MapSession& session);
  // Closes a map that is shown otherwise than the store has it, and opens it again as before.
  // Errors of Delete, except those of the store.
  absl::Status LoadAgain(const std::string& map, uint64_t incarnation);

  // Tells the other servers that share the store at which address they reach this one.
  void Advertise(const std::string& address) { store_->Advertise(address); }

  // Whether other servers may share the maps.
  bool is_shared() const { return placement_.has_value(); }
  const PlacementMeters& placement_meters() const { return placement_meters_; }

  // As the methods of MapStore.
  std::string server_id() const { return store_->server_id(); }
  absl::Duration LeaseAge() const { return store_->LeaseAge(); }
  absl::StatusOr<storage::Survey> TakeSurvey() { return store_->TakeSurvey(); }
  absl::Status SetDraining(const std::string& server_id, bool draining) {
    return store_->SetDraining(server_id, draining);
  }

  // As MapStore::RemoveOldTrash, by the server's clock.
  absl::Status RemoveOldTrash() { return store_->RemoveOldTrash(clock().Now()); }

  // Closes all sessions, several at a time. No other method may be called afterwards.
  void Close();

 private:
  Site(std::unique_ptr<storage::MapStore> store, const SessionOptions& options);

  // Replaces the session of a map that does not work by its problem.
  static Entry WithProblem(Entry entry);
  // When a map that could not be opened is opened again.
  struct Retry {
    absl::Duration at;  // ServerClock::SinceBoot
    absl::Duration pause = kFirstPause;
    std::string stamp;  // of a damaged map: MapStore::FileStamp at the last attempt
  };

  // Opens a map of the store, and lists it.
  void OpenMap(const std::string& name);
  // Plans the next attempt to open a map that could not be opened.
  void PlanRetry(const Entry& entry, const std::string& stamp)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // A map whose next attempt is due, which it reserves and counts as changing, with its retry;
  // nullopt if there is none.
  std::optional<std::pair<std::string, Retry>> ReserveMapToReopen();
  // Opens a map that is listed with a problem that may have passed. On a full disk a creation may
  // have failed and left a map that could not be removed; then that is removed now. Returns the
  // problem, if it has not passed.
  absl::Status OpenAgain(const std::string& name);
  // Lists a map that is not opened, because max_maps maps are open.
  void ListWithoutRoom(const std::string& name);
  // Opens the first maps that were listed without room, if there is room now.
  void OpenMoreMaps();
  // The first of these maps, which it reserves; nullopt if there is none, or no room.
  std::optional<std::string> ReserveMapToOpen();
  bool HasRoomToOpen() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Counts a new map. RESOURCE_EXHAUSTED if there are max_maps already.
  absl::Status BeginCreation(const std::string& map);
  using Start = absl::FunctionRef<absl::StatusOr<std::shared_ptr<MapSession>>()>;
  // Lists the map that `start` makes. If the map exists, `check(session)` decides whether the same
  // request has created it.
  using Check = absl::FunctionRef<absl::Status(MapSession&)>;
  absl::StatusOr<std::shared_ptr<MapSession>> CreateBy(const NewMap& map, Start start, Check check);
  absl::StatusOr<std::shared_ptr<MapSession>> StartNew(const NewMap& map, bool provisional);
  // Removes a map that could not be completed. Returns `status` with what is left, if anything is.
  absl::Status RemoveIncomplete(const std::string& map, const absl::Status& status);
  absl::StatusOr<std::shared_ptr<MapSession>> StartFilled(const NewMap& map, Fill fill);
  // FAILED_PRECONDITION if there is a map of the name of the one that the request has deleted.
  absl::Status CheckGone(const std::string& map, const std::string& request_id) const;
  absl::Status DeleteReserved(const std::string& map, const std::string& request_id,
                              uint64_t incarnation);
  // Takes a map off the list, counts it as changing, and closes it. If `meanwhile` is not OK, the
  // map stays on the list with this problem until PutBack. Returns whether it was not open for want
  // of room. NOT_FOUND, ABORTED.
  absl::StatusOr<bool> TakeOut(const std::string& map, uint64_t incarnation,
                               const absl::Status& meanwhile);
  // Lists a map again that was taken out, or one that a restoration has put in its place, and
  // counts it no more as changing.
  void PutBack(const std::string& map, bool without_room);

  // If other servers share the store, a loop opens, follows, takes over, hands over and forgets
  // maps about every second, and soon after the store has told of a change, so that each map has
  // one owner, and each server shows all of them.
  // Questions for the newest revisions have a loop of their own.
  absl::Status StartPlacement();
  void EndPlacement();
  void HearOfChange(const std::string& map);
  // A step of the loop; waits for the store. Returns the time until the next one.
  absl::Duration Reconcile();
  // Carries out what Placement has planned. Tasks of different maps may be carried out at once.
  void CarryOut(const Placement::Task& task);
  // The part of it that does not wait: a follower learns its owner and how far the map is.
  void Keep(const Placement::Task& task);
  std::vector<Placement::Listed> ListForPlacement() const;
  // Opens a map for writing or for reading.
  absl::StatusOr<std::unique_ptr<MapSession>> OpenFor(const Placement::Task& task);
  // If this server owns the map, ends writing it, and waits until the follower, which is to take
  // the place of the owner's session, shows all of it: what this server shows never goes back.
  void HandOver(const Placement::Task& task, MapSession& follower);
  // Opens the map, puts the session in the place of the one that there is, and closes that one.
  void Replace(const Placement::Task& task);
  // Begins another incarnation of a map of which the store has lost revisions.
  void Renew(const Placement::Task& task);
  // Closes the session of a map if it does not work any more, or owns an incarnation that is over;
  // UNAVAILABLE is the map's problem then.
  void CloseBroken(const Placement::Task& task);
  void Forget(const std::string& map);

  // Keeps other calls from creating or deleting the map until Release, without a lock that is held
  // during I/O. ABORTED if another call has reserved the map.
  absl::Status Reserve(const std::string& map);
  void Release(const std::string& map);

  const std::unique_ptr<storage::MapStore> store_;
  const SessionOptions options_;
  // Of a shared store. Used by the loop, and before that by Open.
  std::optional<Placement> placement_;
  PlacementMeters placement_meters_;
  // Of a shared store. Set before anybody but Open has the site.
  std::unique_ptr<ReadIndex> read_index_;

  mutable Mutex mutex_;
  std::map<std::string, Entry> maps_ ABSL_GUARDED_BY(mutex_);
  // Names of maps that are listed, but were not opened for want of room.
  std::set<std::string> without_room_ ABSL_GUARDED_BY(mutex_);
  // Of the maps that could not be opened.
  std::map<std::string, Retry> retries_ ABSL_GUARDED_BY(mutex_);
  // Maps that are being created, deleted or opened, and are open although maps_ does not show it.
  int num_changing_ ABSL_GUARDED_BY(mutex_) = 0;
  std::set<std::string> reserved_ ABSL_GUARDED_BY(mutex_);
  bool is_closing_ ABSL_GUARDED_BY(mutex_) = false;
  std::unique_ptr<Executor::Running> placing_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_SITE_H_
