// A model of how maps in PostgreSQL are owned and written
// (docs/decisions/038-a-row-is-the-fence.md, storage/postgres/owned_map.h, map_row.h,
// server_lease.h, PostgresStore::TryTake), in the manner of TLA+: a state, atomic actions that are
// enabled in some states, and invariants.
//
// Modelled: the row of one map with its lock; edits and their receipts; leases by the database's
// clock; for each process of a server what it believes of the row, its attempt to write, and its
// session with the database. Statements arrive at any later time, also after the client has given
// the connection up. Processes pause, crash and start again; several may have the same server id.
//
// Not modelled: creation and deletion of maps; reads (a snapshot that is loaded after a takeover);
// failover of the database with loss of commits; numbers that collide; more than one map; the
// length of leases and timeouts (any wait may end at any time).
//
// Numbers and epochs are only compared, so that states are equal up to a renaming of them. That
// makes the set of states finite although takeovers are not counted.
#ifndef HYPERMAP_TESTS_FLEET_FENCE_MODEL_H_
#define HYPERMAP_TESTS_FLEET_FENCE_MODEL_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace hypermap::fence_model {

inline constexpr int kMaxProcesses = 3;
inline constexpr int kMaxSessions = 6;
inline constexpr int kMaxEdits = 4;
inline constexpr uint8_t kNobody = 0xff;

// Mistakes that can be planted. Each breaks an invariant, or the promise of progress.
enum class Mistake : uint8_t {
  kNone,
  kEpochNotCompared,      // a write compares only last_write and the revision
  kNoNumberPut,           // Resolve puts no number after it has found "not stored"
  kEpochStays,            // a takeover does not advance the epoch
  kLeaseBelieved,         // a write compares nothing: the owner looks at its lease instead
  kReceiptApart,          // the receipt is written in a transaction after that of the edit
  kLeaseReadBeforeLock,   // a takeover reads the lease by a snapshot from before it has the lock
  kTakenKept,             // a takeover that is tried again keeps what the attempt before had taken
  kSessionsOfLostRemain,  // nothing ends the session of a process that stands still
};

struct Rules {
  Mistake mistake = Mistake::kNone;
  // The server id of each process.
  std::vector<uint8_t> server_ids = {0, 1};
  // Processes that run at first; the others may start later.
  int running = 2;
  int requests = 2;
  // Whether owners also make writes that do not advance the revision (OwnedMap::WriteInSteps).
  bool touches = true;
  // How many faults of each kind there may be in one history.
  uint8_t breaks = 1;
  uint8_t pauses = 1;
  uint8_t crashes = 1;
  uint8_t lapses = 1;  // ends of leases of processes that run, but renew too late
};

enum class Role : uint8_t { kDown, kIdle, kTaking, kOwner, kWriting, kAsking, kReleasing };

// A process of a server. The attempt is the write that is under way or whose outcome is unknown.
struct Process {
  Role role = Role::kDown;
  bool paused = false;
  // What it believes of the row.
  uint8_t epoch = 0;
  uint8_t last_write = 0;
  uint8_t revision = 0;
  // The attempt: its number, and its request or 0.
  uint8_t number = 0;
  uint8_t request = 0;
  // History variables: whether the attempt is stored; whether nobody took the map since.
  bool is_stored = false;
  bool is_last_taker = false;

  bool operator==(const Process&) const = default;
};

enum class Work : uint8_t { kNone, kWrite, kTouch, kAsk, kTake, kRelease, kReceipt };

// How far the database is with the transaction of a session. In kInTransaction the client is waited
// for; in kInTransaction and kCommitSent the transaction holds the row.
enum class Stage : uint8_t {
  kSent,
  kFindMapSent,
  kWaitsForRow,
  kInTransaction,
  kCommitSent,
  kCommitted,
  kRefused,
  kBroken
};

enum class Found : uint8_t { kNothing, kStored, kNotStored, kOtherEpoch, kOwned, kFree };

// One transaction of a process in the database. It lasts until the client has its answer, or, if
// the client's end is gone, until the database has ended it.
struct Session {
  Work work = Work::kNone;
  uint8_t process = 0;
  bool is_connected = false;
  bool is_terminated = false;  // pg_terminate_backend was called
  Stage stage = Stage::kSent;
  Found found = Found::kNothing;
  // Compared with the row; what a takeover has read.
  uint8_t epoch = 0;
  uint8_t last_write = 0;
  uint8_t revision = 0;
  uint8_t number = 0;
  uint8_t request = 0;
  // With kLeaseReadBeforeLock: what the snapshot of the statement has.
  uint8_t seen_owner = 0;
  bool seen_lease = false;
  bool has_row_changed = false;
  // History variables: whether its write was answered as not stored; whether nobody took the map
  // since the sender did.
  bool is_denied = false;
  bool is_of_last_taker = false;

  auto operator<=>(const Session&) const = default;
};

// A committed edit. All but the request are history variables.
struct Edit {
  uint8_t request = 0;
  uint8_t base = 0;  // the revision to which it was applied
  bool had_epoch = false;
  bool was_of_last_taker = false;
  bool was_denied = false;

  bool operator==(const Edit&) const = default;
};

// hypermap.maps
struct Row {
  uint8_t epoch = 1;
  uint8_t owner = kNobody;
  uint8_t last_write = 1;
  uint8_t revision = 0;

  bool operator==(const Row&) const = default;
};

// hypermap.servers
struct Lease {
  uint8_t holder = kNobody;  // the process
  bool lasts = false;

  bool operator==(const Lease&) const = default;
};

struct State {
  Row row;
  std::array<Lease, kMaxProcesses> leases;  // by server id
  std::array<Process, kMaxProcesses> processes;
  std::array<Session, kMaxSessions> sessions;
  std::array<Edit, kMaxEdits> edits;
  uint8_t num_edits = 0;
  uint8_t receipts = 0;  // bits of requests
  uint8_t answered = 0;  // bits of requests that were answered with OK
  uint8_t breaks = 0;    // faults that are left
  uint8_t pauses = 0;
  uint8_t crashes = 0;
  uint8_t lapses = 0;
  // History variables.
  bool was_answer_wrong = false;  // whether an answer told another outcome than the true one
  bool was_living_robbed = false;

  bool operator==(const State&) const = default;
};
// States are hashed as bytes.
static_assert(sizeof(State) == sizeof(Row) + kMaxProcesses * (sizeof(Lease) + sizeof(Process)) +
                                   kMaxSessions * sizeof(Session) + kMaxEdits * sizeof(Edit) + 9);

enum class Kind : uint8_t {
  // Of a process.
  kBeginTake,
  kBeginWrite,
  kBeginTouch,
  kBeginRelease,
  kBeginAsk,
  kGiveUp,
  kHandle,
  kRenew,
  kStart,
  // Of the database.
  kExecute,
  kEndSession,
  kExpire,
  // Faults.
  kLapse,
  kBreak,
  kPause,
  kResume,
  kCrash,
};

struct Action {
  Kind kind = Kind::kBeginTake;
  uint8_t actor = 0;    // a process, a session or a server id
  uint8_t request = 0;  // of kBeginWrite
};

// Faults, and what need not happen after them: that a paused process goes on.
bool IsFault(Kind kind);

struct Step {
  Action action;
  State next;
};

State InitialState(const Rules& rules);

// Adds all steps that are possible in `state`, to states in their canonical form.
void AddSteps(const Rules& rules, const State& state, std::vector<Step>* steps);

// The bit of a request in State::receipts and State::answered.
constexpr uint8_t Bit(uint8_t request) { return static_cast<uint8_t>(1U << request); }

bool IsRowLocked(const State& state);

// The name of an invariant that does not hold in `state`; nullptr if all hold.
const char* FindViolation(const State& state);

// Whether a process that runs owns the map by the row as well, and can write at once.
bool CanWrite(const State& state);
// Whether a process runs, or may start.
bool HasRunningProcess(const Rules& rules, const State& state);

// Tells `step` from `before`, with the row after it.
std::string Describe(const State& before, const Step& step);

}  // namespace hypermap::fence_model

#endif  // HYPERMAP_TESTS_FLEET_FENCE_MODEL_H_
