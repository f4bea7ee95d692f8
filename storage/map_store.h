// The interface between maps and their durable storage.
#ifndef HYPERMAP_STORAGE_MAP_STORE_H_
#define HYPERMAP_STORAGE_MAP_STORE_H_

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "absl/types/span.h"
#include "map/check_report.h"
#include "map/edits/change.h"
#include "map/snapshot.h"
#include "storage/fusion_log.h"
#include "storage/history.h"

namespace hypermap::storage {

// The answer to a mutation. It is stored, so that a retry of the request gets the same answer.
struct Receipt {
  std::string request_id;  // empty: the caller gave none, and no receipt is stored
  Revision revision = 0;
  std::vector<ObjectId> object_ids;  // AppliedBatch::object_ids
  // Digest of the request without its id, so that another request with the same id is not taken for
  // a retry. Empty in receipts of files that older versions wrote.
  std::string request_digest;
};

// A receipt with the time of its commit, by which it is forgotten.
struct TimedReceipt {
  Receipt receipt;
  absl::Time time;
};

// One batch of edits that is to be written.
struct Commit {
  AppliedBatch applied;
  std::string author;
  absl::Time time;
  std::string request_id;
  std::string request_digest;  // Receipt::request_digest
  // Its changes to fused layers, at most one for each layer. When the batch deletes a layer, the
  // log of its evidence is deleted first.
  std::vector<FusionChange> fusion;
  // What the record of the revision tells, if the commit stands for another one: a copy of a map
  // begins with a commit of all that its oldest kept revision shows. nullopt: the number of
  // applied.changes.
  std::optional<int64_t> num_changes = std::nullopt;
};

// A moment in the life of a map, by all clocks that it goes by.
//
// Commit times come from a clock that can be set, so that their differences need not be time that
// passed. Marks tie them to it: for the commits after a mark's revision, and before the next
// mark's, the time that passed is the mark's and the difference of the commit times, but at most
// that of the next mark. Before the first mark, both durations are the commit time's distance from
// the Unix epoch.
struct TimeMark {
  // The newest revision at that moment.
  Revision revision = 0;
  // The time of the next commit, or that of the newest one. Not before the newest one.
  absl::Time commit_time;
  // The time that had certainly passed for the map since some origin: it leaves out what is known
  // by the wall clock only, which is the time for which the machine was off.
  absl::Duration passed;
  // The same with the time for which the machine was off.
  absl::Duration lived;
  // The server's clock. If it was behind commit_time, commit times stood still until the mark.
  absl::Time server_time;
  // The boot of the machine, and the time since, including suspension.
  std::string boot_id;
  absl::Duration since_boot;

  friend bool operator==(const TimeMark&, const TimeMark&) = default;
};

// The properties of a map that never change while it is open.
struct MapHeader {
  std::string name;
  std::string frame_id;
  absl::Time created_at;
  std::string request_id;  // of its creation
  // Tells one history from another: revisions can be compared within an incarnation only. Never 0
  // in an open map. Chosen at random at the creation if it is 0, and again by Open if the file is
  // not the one that this store wrote last, or if commits are missing that were acknowledged.
  uint64_t incarnation = 0;
  // True if the map is incomplete before its first commit. A map that a crash left without one is
  // removed when it is opened.
  bool provisional = false;
  // True while another map is copied into this one (storage/transfer), over restarts. Such a map is
  // no map yet: only OpenUnfinishedCopy opens it, and StoredMap::FinishCopy makes it one.
  bool unfinished_copy = false;
};

// Where the history of a map stands.
struct MapPosition {
  KeptRevisions kept;
  ObjectId next_object_id = 1;  // Snapshot::next_object_id of the newest revision
};

// A copy of a map that is about to be written.
class MapBackup {
 public:
  virtual ~MapBackup() = default;

  // Writes a consistent copy of the newest stored revision, which can be opened as a map of its
  // own. Any thread may call this, once, while the map's writer goes on. The map may be closed by
  // then. The copy is not durable: who keeps the file syncs it. ALREADY_EXISTS if the file exists;
  // errors of CheckCancelled. After an error there is no copy.
  virtual absl::Status WriteTo(const std::string& path) = 0;
};

// A check of a map that is about to be made.
class MapCheck {
 public:
  virtual ~MapCheck() = default;

  // Checks the newest stored revision as a whole, and reports all damage. Any thread may call this,
  // once, while the map's writer goes on. The map may be closed by then. `evidence` may be null.
  // Errors of CheckCancelled; UNAVAILABLE.
  virtual absl::StatusOr<CheckReport> Run(const EvidenceCheck& evidence) = 0;
};

// All that a store keeps of a map, for reading. One thread at a time, except where a method says
// otherwise.
class ReadableMap {
 public:
  virtual ~ReadableMap() = default;

  // The header given at its creation, but with the name it was opened by and the incarnation that
  // the map has since.
  virtual const MapHeader& header() const = 0;

  virtual absl::StatusOr<MapPosition> Position() = 0;

  // At most `max_count` receipts after that of the request `after`, in the order of their
  // revisions; from the first one if `after` is empty. UNAVAILABLE if there is no receipt of that
  // request any more; DATA_LOSS naming the damaged table and row.
  virtual absl::StatusOr<std::vector<TimedReceipt>> Receipts(absl::string_view after,
                                                             int max_count) = 0;

  // The marks that were added, in order. DATA_LOSS naming the damaged table.
  virtual absl::StatusOr<std::vector<TimeMark>> TimeMarks() = 0;

  // The evidence of fused layers. Lives as long as this map.
  virtual FusionLog& fusion_log() = 0;

  // Opens a reader of the map's history. May be called by any thread. The reader may outlive this
  // map, but then sees no newer revisions.
  virtual absl::StatusOr<std::unique_ptr<HistoryReader>> OpenHistory() = 0;
};

// One map, open for writing in this process alone.
class StoredMap : public ReadableMap {
 public:
  // Findings of the opening that people should know, such as the reason for which the map has
  // another incarnation. Each is a sentence that names the map.
  virtual std::vector<std::string> opening_notes() const { return {}; }

  // DATA_LOSS, for ever, once the files of the map were found removed, replaced or changed by
  // another program while the map was open, so that commits would not be where the next opening
  // looks for them. Cheap.
  virtual absl::Status CheckFile() { return absl::OkStatus(); }

  // What the opening found that can't be read although the map is open: DATA_LOSS naming it.
  virtual absl::Status damage() const { return absl::OkStatus(); }

  // Reads all of the newest revision. A layer of which something can't be read is in
  // Snapshot::damaged. DATA_LOSS naming the damaged table and row if that concerns all of the map.
  virtual absl::StatusOr<SnapshotPtr> Load() = 0;

  // Writes the commits in order, durably and in one transaction. On error none of them is stored
  // and the map is unchanged. But if the process ends before anything else is written, all of them
  // may be found stored: a sync that failed does not take back what was written. UNAVAILABLE and
  // RESOURCE_EXHAUSTED (disk full) may pass, so that a retry makes sense; DATA_LOSS does not. An
  // error of CheckFile may come after the commits were written to files that are no longer the
  // map's.
  virtual absl::Status Write(absl::Span<const Commit> commits) = 0;

  // OK if no other process can have written the map so far, so that Load and the writes since tell
  // all of it; LostOwnershipError, for ever; UNAVAILABLE. Writes nothing.
  virtual absl::Status ConfirmOwnership() { return absl::OkStatus(); }

  // Keeps other servers from opening the map when this is closed, because this one is about to
  // replace it or to open it again.
  virtual void KeepOwnership() {}

  // Writes durably without changing the map: OK if a small commit could be written now. Errors as
  // Write.
  virtual absl::Status TryWrite() = 0;

  // The receipt of an earlier request, also from before a restart; nullopt when there is none.
  virtual absl::StatusOr<std::optional<Receipt>> FindReceipt(absl::string_view request_id) = 0;

  // The receipts of those of the requests that have one, in any order. Errors as FindReceipt. A
  // store to which each question is a round trip answers all with one.
  virtual absl::StatusOr<std::vector<Receipt>> FindReceipts(
      absl::Span<const std::string> request_ids) {
    std::vector<Receipt> receipts;
    for (const std::string& request_id : request_ids) {
      absl::StatusOr<std::optional<Receipt>> receipt = FindReceipt(request_id);
      if (!receipt.ok()) return receipt.status();
      if (*receipt) receipts.push_back(*std::move(*receipt));
    }
    return receipts;
  }

  // Adds a mark durably, and forgets all but the newest of those with passed < `forget_before`. On
  // error nothing changes. REQUIRES: revision, commit_time, passed and lived are not before those
  // of earlier marks.
  virtual absl::Status AddTimeMark(const TimeMark& mark, absl::Duration forget_before) = 0;

  // Makes `oldest` the oldest revision that can be read, unless it was a newer one already, and
  // forgets the receipts from before `receipts_before`. Removes about `max_rows` of the rows that
  // are no longer needed, also of evidence that fusion_log has forgotten, in a short transaction;
  // returns true when more of them are left.
  // REQUIRES: `oldest` is not newer than the newest revision.
  virtual absl::StatusOr<bool> Compact(Revision oldest, absl::Time receipts_before,
                                       int max_rows) = 0;

  // Writes into an unfinished copy what commits alone can't give it: receipts of revisions that are
  // no longer kept, and evidence that they had forgotten. Each is one durable transaction. For
  // another map FAILED_PRECONDITION; UNIMPLEMENTED if the store can't take copies; else as Write.
  virtual absl::Status AddCopied(absl::Span<const TimedReceipt> /*receipts*/,
                                 absl::Span<const FusionChange> /*fusion*/) {
    return absl::UnimplementedError("this store can't take copies");
  }
  // Removes all receipts, time marks and evidence of an unfinished copy, which then has its
  // revisions only.
  virtual absl::Status ClearCopied() {
    return absl::UnimplementedError("this store can't take copies");
  }
  // Makes an unfinished copy a map like any other.
  virtual absl::Status FinishCopy() {
    return absl::UnimplementedError("this store can't take copies");
  }

  // The most bytes of disk that a copy takes if nothing is written before it.
  virtual absl::StatusOr<int64_t> BackupBytes() = 0;

  // Begins a copy. DATA_LOSS if the map's files are not as its writer left them.
  virtual absl::StatusOr<std::unique_ptr<MapBackup>> OpenBackup() = 0;
  // Writes a copy at once: errors of OpenBackup and WriteTo.
  absl::Status BackupTo(const std::string& path) {
    const absl::StatusOr<std::unique_ptr<MapBackup>> backup = OpenBackup();
    return backup.ok() ? (*backup)->WriteTo(path) : backup.status();
  }

  // Begins a check. Errors as OpenBackup; UNIMPLEMENTED if the store can't check.
  virtual absl::StatusOr<std::unique_ptr<MapCheck>> OpenCheck() {
    return absl::UnimplementedError("this store can't check its maps");
  }
};

// The maps of a store that several servers share, and those servers, at one moment.
struct Survey {
  struct Server {
    std::string id;
    std::string address;  // at which the others reach it; may be empty
    // Until its lease ends, unless it renews it.
    absl::Duration lease_left = absl::InfiniteDuration();
    bool draining = false;  // MapStore::SetDraining
  };
  struct Map {
    std::string name;
    uint64_t incarnation = 0;
    Revision revision = 0;
    std::string owner;  // id of the server that has it open for writing; empty: none that lives
  };
  std::vector<Server> servers;  // that live, ordered by id
  std::vector<Map> maps;        // ordered by name
};

// How far a map is in the store.
struct NewestRevision {
  uint64_t incarnation = 0;
  Revision revision = 0;
};

// A set of maps. Each can be open for writing in one place at a time: in this process alone, unless
// the store is shared. Thread safe.
class MapStore {
 public:
  virtual ~MapStore() = default;

  // What the opening of the store found that people should know. Each is a sentence.
  virtual std::vector<std::string> notes() const { return {}; }

  // The id of this server if several may share the store; empty if they can't.
  virtual std::string server_id() const { return ""; }

  // Tells the other servers at which address, HOST:PORT, they reach this one.
  virtual void Advertise(const std::string& /*address*/) {}

  // How long ago this server's lease was renewed, by which the others know that it lives. Zero if
  // the store can't be shared.
  virtual absl::Duration LeaseAge() const { return absl::ZeroDuration(); }

  // Tells all servers that one of them is to own no maps, or may own maps again. A server that
  // starts may. NOT_FOUND if no such server lives; UNAVAILABLE; UNIMPLEMENTED if the store can't be
  // shared.
  virtual absl::Status SetDraining(const std::string& /*server_id*/, bool /*draining*/) {
    return absl::UnimplementedError("this store can't be shared");
  }

  // UNAVAILABLE; UNIMPLEMENTED if the store can't be shared.
  virtual absl::StatusOr<Survey> TakeSurvey() {
    return absl::UnimplementedError("this store can't be shared");
  }

  // Reads the newest revisions of those of the maps that there are. No revision is missing that any
  // server had acknowledged before the call. Does not wait for other calls. UNAVAILABLE, also if
  // the store does not know; UNIMPLEMENTED if the store can't be shared.
  virtual absl::StatusOr<std::map<std::string, NewestRevision>> NewestRevisions(
      const std::vector<std::string>& /*names*/) {
    return absl::UnimplementedError("this store can't be shared");
  }

  // Gives a map another incarnation, if it has the given one and its newest revision is before
  // `shown`, which was shown or acknowledged: the store has lost it. Whoever has the map open can
  // write nothing more. UNAVAILABLE; UNIMPLEMENTED if the store can't be shared.
  virtual absl::Status RenewIncarnation(const std::string& /*name*/, uint64_t /*incarnation*/,
                                        Revision /*shown*/) {
    return absl::UnimplementedError("this store can't be shared");
  }

  // Opens a map for reading, whoever has it open for writing. Everything that would write fails
  // with FAILED_PRECONDITION. Errors as Open; UNIMPLEMENTED if the store can't be shared.
  virtual absl::StatusOr<std::unique_ptr<StoredMap>> Follow(const std::string& /*name*/) {
    return absl::UnimplementedError("this store can't be shared");
  }

  // Opens a map for reading as it is at this moment, whoever has it open for writing: all that is
  // read is of one moment, except that readers of the history see later revisions, too, and no
  // longer those that have been compacted since. To be closed soon: until then the store can't
  // reuse the space of what is removed. Errors as Open; UNIMPLEMENTED.
  virtual absl::StatusOr<std::unique_ptr<ReadableMap>> Pin(const std::string& /*name*/) {
    return absl::UnimplementedError("this store can't be read while it is used");
  }

  // Opens an unfinished copy, to go on with it. FAILED_PRECONDITION if the map is none; other
  // errors as Open.
  virtual absl::StatusOr<std::unique_ptr<StoredMap>> OpenUnfinishedCopy(
      const std::string& /*name*/) {
    return absl::UnimplementedError("this store can't take copies");
  }

  // Has `heard` called when another server may have made a revision of a map, or with an empty name
  // when anything may have changed, such as the owner of a map. These are hints: some are lost,
  // some are false. Calls come from a thread of the store, one at a time, until the store is
  // destroyed or another function is given.
  virtual void ListenForChanges(const std::function<void(const std::string& map)>& /*heard*/) {}

  // The names of all maps, sorted, whether or not they can be opened. May leave out unfinished
  // copies.
  virtual absl::StatusOr<std::vector<std::string>> List() = 0;

  // ALREADY_EXISTS. After any other error there is no map, unless the error tells that it stays.
  virtual absl::StatusOr<std::unique_ptr<StoredMap>> Create(const MapHeader& header) = 0;

  // NOT_FOUND, also for a map whose creation was not completed; FAILED_PRECONDITION when the file
  // is not a map, is an unfinished copy, has a newer schema version or is open in another process;
  // DATA_LOSS when it is damaged.
  virtual absl::StatusOr<std::unique_ptr<StoredMap>> Open(const std::string& name) = 0;

  // Tells states of the files of a map apart, without opening them: it differs after they were
  // replaced or changed. Empty if there are none.
  virtual std::string FileStamp(const std::string& name) = 0;

  // Removes the map, for good or into a trash of the store, and records the request, unless its id
  // is empty. A retry of the request changes nothing, also after a restart, and is OK unless there
  // is a new map of that name by then. NOT_FOUND; FAILED_PRECONDITION when the map is open, or when
  // the id was used to delete an earlier map of the name; INVALID_ARGUMENT when it was used to
  // delete another map.
  virtual absl::Status Delete(const std::string& name, const std::string& request_id) = 0;

  // Removes a map for good that was made but could not be completed. Errors as Delete.
  virtual absl::Status Discard(const std::string& name) { return Delete(name, /*request_id=*/""); }

  // Removes deleted maps for good that have been in the store's trash for long enough, or whose
  // space is needed. To be called from time to time; waits for the disk.
  virtual absl::Status RemoveOldTrash(absl::Time /*now*/) { return absl::OkStatus(); }

  // Checks a file that is not a map of the store, such as a copy by MapBackup, as MapCheck::Run
  // does. A file of an older schema version is migrated before. FAILED_PRECONDITION if it is not a
  // map. REQUIRES: nobody else uses the file.
  virtual absl::StatusOr<CheckReport> CheckFile(const std::string& /*path*/,
                                                const EvidenceCheck& /*evidence*/) {
    return absl::UnimplementedError("this store can't check files");
  }

  // Makes a file that CheckFile found to be clean the map of this name, of another incarnation,
  // created by the request. It takes the place of a map of that name in one step, and that one is
  // removed as by Delete; only if that one could not be closed properly, it is removed before, and
  // may be gone after an error. FAILED_PRECONDITION if that map is open. After an error the file
  // may be another one or gone; the same call may be repeated as it is. REQUIRES: the file is in
  // the file system of the store, and nobody else uses it.
  virtual absl::Status Restore(const std::string& /*path*/, const std::string& /*name*/,
                               const std::string& /*request_id*/) {
    return absl::UnimplementedError("this store can't restore maps");
  }

  // The name of the map that the request deleted; nullopt when it deleted none.
  virtual absl::StatusOr<std::optional<std::string>> FindDeletion(
      const std::string& request_id) = 0;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_MAP_STORE_H_
