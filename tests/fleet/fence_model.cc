#include "tests/fleet/fence_model.h"

#include <algorithm>
#include <utility>

namespace hypermap::fence_model {
namespace {

bool Runs(const Process& process) { return process.role != Role::kDown && !process.paused; }

// Calls `visit` for all numbers of writes in the state.
template <typename Visit>
void ForEachNumber(State& state, Visit visit) {
  visit(state.row.last_write);
  for (Process& process : state.processes) {
    visit(process.last_write);
    visit(process.number);
  }
  for (Session& session : state.sessions) {
    visit(session.last_write);
    visit(session.number);
  }
}

template <typename Visit>
void ForEachEpoch(State& state, Visit visit) {
  visit(state.row.epoch);
  for (Process& process : state.processes) visit(process.epoch);
  for (Session& session : state.sessions) visit(session.epoch);
}

uint8_t NewNumber(State state) {
  uint8_t greatest = 0;
  ForEachNumber(state, [&](uint8_t& number) { greatest = std::max(greatest, number); });
  return greatest + 1;
}

// Numbers become 1, 2, ... in the order of their first occurrence. 0 is none.
void RenameNumbers(State* state) {
  std::array<uint8_t, 64> names{};
  uint8_t used = 0;
  ForEachNumber(*state, [&](uint8_t& number) {
    if (number == 0) return;
    if (names[number] == 0) names[number] = ++used;
    number = names[number];
  });
}

// Epochs become 1, 2, ... and keep their order, so that the one after the row's is a new one.
void RenameEpochs(State* state) {
  std::array<bool, 64> occurs{};
  ForEachEpoch(*state, [&](uint8_t& epoch) { occurs[epoch] = true; });
  std::array<uint8_t, 64> names{};
  uint8_t used = 0;
  for (size_t epoch = 1; epoch < names.size(); ++epoch) {
    if (occurs[epoch]) names[epoch] = ++used;
  }
  ForEachEpoch(*state, [&](uint8_t& epoch) { epoch = names[epoch]; });
}

void MakeCanonical(State* state) {
  std::sort(state->sessions.begin(), state->sessions.end());
  RenameNumbers(state);
  RenameEpochs(state);
}

// The steps from one state. Each function named after an action adds the step if it is enabled.
class Stepper {
 public:
  Stepper(const Rules& rules, const State& state, std::vector<Step>* steps)
      : rules_(rules), before_(state), steps_(steps) {}

  void AddAll() {
    for (uint8_t p = 0; p < rules_.server_ids.size(); ++p) AddStepsOfProcess(p);
    for (uint8_t s = 0; s < kMaxSessions; ++s) {
      if (before_.sessions[s].work == Work::kNone) continue;
      Execute(s);
      EndSession(s);
    }
    for (uint8_t id = 0; id < kMaxProcesses; ++id) Expire(id);
  }

 private:
  bool Has(Mistake mistake) const { return rules_.mistake == mistake; }

  void Emit(Action action, State next) {
    MakeCanonical(&next);
    steps_->push_back({action, next});
  }

  void AddStepsOfProcess(uint8_t p) {
    const Process& process = before_.processes[p];
    if (process.role == Role::kDown) return Start(p);
    Crash(p);
    if (process.paused) return Resume(p);
    Pause(p);
    Break(p);
    Lapse(p);
    Renew(p);
    Handle(p);
    if (process.role == Role::kIdle) BeginTake(p);
    if (process.role == Role::kOwner) AddStepsOfOwner(p);
    if (process.role == Role::kAsking) {
      BeginAsk(p);
      GiveUp(p);
    }
  }

  void AddStepsOfOwner(uint8_t p) {
    for (uint8_t request = 1; request <= rules_.requests; ++request) BeginWrite(p, request);
    BeginTouch(p);
    BeginRelease(p);
  }

  // --- Sessions of a process.

  static Session* FindSession(State& state, uint8_t p) {
    for (Session& session : state.sessions) {
      if (session.work != Work::kNone && session.process == p && session.is_connected) {
        return &session;
      }
    }
    return nullptr;
  }

  // nullptr if there are too many; then the history ends.
  static Session* OpenSession(State& state, uint8_t p, Work work) {
    for (Session& session : state.sessions) {
      if (session.work != Work::kNone) continue;
      session.work = work;
      session.process = p;
      session.is_connected = true;
      session.epoch = state.processes[p].epoch;
      return &session;
    }
    return nullptr;
  }

  // The client's end of the session is gone. What it has sent may still arrive.
  static void Disconnect(Session* session) {
    session->is_connected = false;
    DropIfDone(session);
  }

  static void DropIfDone(Session* session) {
    const bool is_done = session->stage >= Stage::kCommitted;
    if (is_done && !session->is_connected) *session = Session();
  }

  // --- What a process does.

  // PostgresStore::TryTake
  void BeginTake(uint8_t p) {
    State next = before_;
    if (OpenSession(next, p, Work::kTake) == nullptr) return;
    next.processes[p].role = Role::kTaking;
    Emit({Kind::kBeginTake, p}, next);
  }

  // FindReceipt, then OwnedMap::Write: all statements are sent at once.
  void BeginWrite(uint8_t p, uint8_t request) {
    State next = before_;
    if ((before_.receipts & Bit(request)) != 0) {
      next.answered |= Bit(request);
    } else {
      const Lease& lease = before_.leases[rules_.server_ids[p]];
      if (Has(Mistake::kLeaseBelieved) && !(lease.lasts && lease.holder == p)) return;
      if (!BeginAttempt(&next, p, Work::kWrite, request)) return;
    }
    Emit({Kind::kBeginWrite, p, request}, next);
  }

  // OwnedMap::WriteInSteps
  void BeginTouch(uint8_t p) {
    State next = before_;
    if (!rules_.touches || !BeginAttempt(&next, p, Work::kTouch, 0)) return;
    Emit({Kind::kBeginTouch, p}, next);
  }

  static bool BeginAttempt(State* next, uint8_t p, Work work, uint8_t request) {
    const uint8_t number = NewNumber(*next);
    Session* const session = OpenSession(*next, p, work);
    if (session == nullptr) return false;
    Process& process = next->processes[p];
    session->last_write = process.last_write;
    session->is_of_last_taker = process.is_last_taker;
    if (work == Work::kWrite) session->revision = process.revision;
    session->number = number;
    session->request = request;
    process.role = Role::kWriting;
    process.number = number;
    process.request = request;
    return true;
  }

  // OwnedMap::Release
  void BeginRelease(uint8_t p) {
    State next = before_;
    if (OpenSession(next, p, Work::kRelease) == nullptr) return;
    next.processes[p].role = Role::kReleasing;
    Emit({Kind::kBeginRelease, p}, next);
  }

  // OwnedMap::AskRow
  void BeginAsk(uint8_t p) {
    State next = before_;
    if (FindSession(next, p) != nullptr) return;
    if (OpenSession(next, p, Work::kAsk) == nullptr) return;
    Emit({Kind::kBeginAsk, p}, next);
  }

  // OwnedMap::Resolve, after kTimeToSettle.
  void GiveUp(uint8_t p) {
    State next = before_;
    if (FindSession(next, p) != nullptr) return;
    CloseMap(&next.processes[p]);
    Emit({Kind::kGiveUp, p}, next);
  }

  static void CloseMap(Process* process) {
    *process = Process();
    process->role = Role::kIdle;
  }

  // The process goes on with what the database has answered, or with the end of the session.
  void Handle(uint8_t p) {
    State next = before_;
    Session* const session = FindSession(next, p);
    if (session == nullptr) return;
    switch (session->stage) {
      case Stage::kInTransaction:
        SendNext(&next, session);
        break;
      case Stage::kCommitted:
        HandleCommitted(&next, session);
        break;
      case Stage::kRefused:
        Answer(&next, p, false);
        CloseMap(&next.processes[p]);
        *session = Session();
        break;
      case Stage::kBroken:
        HandleBreak(&next, session);
        break;
      default:
        return;
    }
    Emit({Kind::kHandle, p}, next);
  }

  void SendNext(State* next, Session* session) {
    if (session->work == Work::kTake && session->found == Found::kOwned) {
      HandleOwned(next, &next->processes[session->process]);
      *session = Session();
    } else if (session->work == Work::kAsk) {
      HandleRow(next, session);
    } else {
      session->stage = Stage::kCommitSent;
    }
  }

  // The map has another owner.
  void HandleOwned(State* next, Process* process) const {
    if (!Has(Mistake::kTakenKept) || process->epoch == 0) return CloseMap(process);
    process->role = Role::kOwner;
    process->revision = next->row.revision;
  }

  // The rest of AskRow: the row is locked, and was read.
  void HandleRow(State* next, Session* session) {
    const uint8_t p = session->process;
    Process& process = next->processes[p];
    if (session->found == Found::kOtherEpoch) {
      CloseMap(&process);
      *session = Session();
    } else if (session->found == Found::kStored) {
      *session = Session();
      process.last_write = process.number;
      Answer(next, p, true);
    } else if (Has(Mistake::kNoNumberPut)) {
      *session = Session();
      Answer(next, p, false);
    } else {
      session->number = NewNumber(*next);
      session->stage = Stage::kCommitSent;
    }
  }

  void HandleCommitted(State* next, Session* session) {
    const Session done = std::exchange(*session, Session());
    Process& process = next->processes[done.process];
    switch (done.work) {
      case Work::kTake:
        BecomeOwner(&process, done);
        break;
      case Work::kAsk:
        process.last_write = done.number;
        Answer(next, done.process, false);
        break;
      case Work::kRelease:
        CloseMap(&process);
        break;
      case Work::kReceipt:
        next->answered |= Bit(done.request);
        process.role = Role::kOwner;
        break;
      default:
        process.last_write = done.number;
        Answer(next, done.process, true);
    }
  }

  static void BecomeOwner(Process* process, const Session& take) {
    process->role = Role::kOwner;
    process->epoch = take.epoch;
    process->last_write = take.last_write;
    process->revision = take.revision;
    process->is_last_taker = take.is_of_last_taker;
  }

  // Ends the attempt of a process: the caller is told whether its write is stored.
  void Answer(State* next, uint8_t p, bool is_stored) {
    Process& process = next->processes[p];
    if (process.is_stored != is_stored) next->was_answer_wrong = true;
    if (!is_stored) {
      for (Session& session : next->sessions) {
        const bool is_write = session.work == Work::kWrite || session.work == Work::kTouch;
        if (is_write && session.number == process.number) session.is_denied = true;
      }
    }
    const uint8_t request = std::exchange(process.request, 0);
    process.number = 0;
    process.is_stored = false;
    process.role = Role::kOwner;
    if (!is_stored || request == 0) return;
    ++process.revision;
    if (!Has(Mistake::kReceiptApart)) {
      next->answered |= Bit(request);
    } else if (Session* const session = OpenSession(*next, p, Work::kReceipt)) {
      session->request = request;
      process.role = Role::kWriting;
    }
  }

  // OwnedMap::Settle for a broken connection, and its like.
  void HandleBreak(State* next, Session* session) const {
    const Session broken = *session;
    Disconnect(session);
    Process& process = next->processes[broken.process];
    switch (broken.work) {
      case Work::kWrite:
      case Work::kTouch:
        process.role = Role::kAsking;
        break;
      case Work::kTake:
      case Work::kRelease:
        CloseMap(&process);
        if (Has(Mistake::kTakenKept)) KeepTaken(next->row, broken, &process);
        break;
      case Work::kReceipt:
        next->answered |= Bit(broken.request);
        process.role = Role::kOwner;
        break;
      default:
        break;
    }
  }

  // The attempt had the row, and its UPDATE had returned the epoch.
  static void KeepTaken(const Row& row, const Session& broken, Process* process) {
    if (broken.work != Work::kTake || broken.stage != Stage::kCommitSent) return;
    process->epoch = row.epoch + 1;
    process->last_write = row.last_write;
  }

  // ServerLease, kRenew
  void Renew(uint8_t p) {
    const uint8_t id = rules_.server_ids[p];
    if (before_.leases[id].holder != p || before_.leases[id].lasts) return;
    State next = before_;
    next.leases[id].lasts = true;
    Emit({Kind::kRenew, p}, next);
  }

  // Opens the store: ServerLease, kTake.
  void Start(uint8_t p) {
    State next = before_;
    next.processes[p].role = Role::kIdle;
    next.leases[rules_.server_ids[p]] = {p, true};
    Emit({Kind::kStart, p}, next);
  }

  // --- What the database does.

  // Runs the next statement of a session that has arrived, if no lock is in its way.
  void Execute(uint8_t s) {
    State next = before_;
    Session& session = next.sessions[s];
    const bool is_row_needed = session.stage == Stage::kWaitsForRow ||
                               (session.stage == Stage::kSent && session.work != Work::kTake &&
                                session.work != Work::kReceipt);
    if (is_row_needed && IsRowLocked(before_)) return;
    switch (session.stage) {
      case Stage::kSent:
        ExecuteFirst(&next, &session);
        break;
      case Stage::kFindMapSent:
        StartToFindMap(next, &session);
        break;
      case Stage::kWaitsForRow:
        LockRowToTake(&next, &session);
        break;
      case Stage::kCommitSent:
        Commit(&next, &session);
        break;
      default:
        return;
    }
    DropIfDone(&session);
    Emit({Kind::kExecute, s}, next);
  }

  void ExecuteFirst(State* next, Session* session) {
    switch (session->work) {
      case Work::kWrite:
        session->stage = FitsRow(*next, *session) ? Stage::kCommitSent : Stage::kRefused;
        break;
      case Work::kTouch:
        session->stage = FitsRow(*next, *session) ? Stage::kInTransaction : Stage::kRefused;
        break;
      case Work::kAsk:
        session->stage = Stage::kInTransaction;
        session->found = ReadOutcome(*next, *session);
        break;
      case Work::kTake:
        EndSessionsOfLostOwner(next);
        session->stage = Stage::kFindMapSent;
        break;
      case Work::kRelease:
        if (next->row.epoch == session->epoch) ChangeOwner(next, kNobody);
        session->stage = Stage::kCommitted;
        break;
      default:
        next->receipts |= Bit(session->request);
        session->stage = Stage::kCommitted;
    }
  }

  // The conditions of kWrite and kAdvance.
  bool FitsRow(const State& state, const Session& session) const {
    if (Has(Mistake::kLeaseBelieved)) return true;
    if (!Has(Mistake::kEpochNotCompared) && state.row.epoch != session.epoch) return false;
    if (state.row.last_write != session.last_write) return false;
    return session.work == Work::kTouch || state.row.revision == session.revision;
  }

  static Found ReadOutcome(const State& state, const Session& session) {
    if (state.row.epoch != session.epoch) return Found::kOtherEpoch;
    const Process& process = state.processes[session.process];
    return state.row.last_write == process.number ? Found::kStored : Found::kNotStored;
  }

  static bool IsLeaseOver(const State& state) {
    return state.row.owner == kNobody || !state.leases[state.row.owner].lasts;
  }

  void EndSessionsOfLostOwner(State* next) const {
    if (Has(Mistake::kSessionsOfLostRemain) || !IsLeaseOver(*next)) return;
    for (Session& session : next->sessions) {
      const bool is_of_owner =
          session.work != Work::kNone && rules_.server_ids[session.process] == next->row.owner;
      if (is_of_owner) session.is_terminated = true;
    }
  }

  // The statement has its snapshot. Only a later one would see leases that change while it waits.
  void StartToFindMap(const State& state, Session* session) const {
    session->stage = Stage::kWaitsForRow;
    if (!Has(Mistake::kLeaseReadBeforeLock)) return;
    session->seen_owner = state.row.owner;
    session->seen_lease = !IsLeaseOver(state);
  }

  void LockRowToTake(State* next, Session* session) const {
    const uint8_t id = rules_.server_ids[session->process];
    const bool is_owned_by_living = !IsLeaseOver(*next) && next->row.owner != id;
    const bool looks_owned = Has(Mistake::kLeaseReadBeforeLock)
                                 ? LooksOwned(*next, *session) && next->row.owner != id
                                 : is_owned_by_living;
    if (is_owned_by_living && !looks_owned) next->was_living_robbed = true;
    session->stage = Stage::kInTransaction;
    session->found = looks_owned ? Found::kOwned : Found::kFree;
  }

  // PostgreSQL reads the row again if it has changed, and joins it with the lease of the snapshot.
  static bool LooksOwned(const State& state, const Session& session) {
    if (!session.has_row_changed) return session.seen_lease;
    return session.seen_owner == state.row.owner && session.seen_lease;
  }

  void Commit(State* next, Session* session) {
    switch (session->work) {
      case Work::kWrite:
        StoreEdit(next, *session);
        CommitAttempt(next, *session);
        break;
      case Work::kTouch:
        CommitAttempt(next, *session);
        break;
      case Work::kAsk:
        next->row.last_write = session->number;
        break;
      default:
        CommitTake(next, session);
    }
    NoteRowChanged(next);
    session->stage = Stage::kCommitted;
  }

  void StoreEdit(State* next, const Session& session) const {
    if (next->num_edits == kMaxEdits) return;
    next->edits[next->num_edits++] = {session.request, session.revision,
                                      session.epoch == next->row.epoch, session.is_of_last_taker,
                                      session.is_denied};
    next->row.revision = session.revision + 1;
    if (!Has(Mistake::kReceiptApart)) next->receipts |= Bit(session.request);
  }

  static void CommitAttempt(State* next, const Session& session) {
    next->row.last_write = session.number;
    if (session.is_denied) next->was_answer_wrong = true;
    Process& process = next->processes[session.process];
    if (process.number == session.number) process.is_stored = true;
  }

  void CommitTake(State* next, Session* session) const {
    if (!Has(Mistake::kEpochStays)) ++next->row.epoch;
    ChangeOwner(next, rules_.server_ids[session->process]);
    session->epoch = next->row.epoch;
    session->last_write = next->row.last_write;
    session->revision = next->row.revision;
    for (Process& process : next->processes) process.is_last_taker = false;
    for (Session& other : next->sessions) other.is_of_last_taker = false;
    session->is_of_last_taker = true;
  }

  static void ChangeOwner(State* next, uint8_t owner) {
    next->row.owner = owner;
    NoteRowChanged(next);
  }

  static void NoteRowChanged(State* next) {
    for (Session& session : next->sessions) {
      if (session.stage == Stage::kWaitsForRow) session.has_row_changed = true;
    }
  }

  // The database rolls a transaction back and ends the session: because the client's end is gone,
  // because of pg_terminate_backend, or by idle_in_transaction_session_timeout.
  void EndSession(uint8_t s) {
    State next = before_;
    Session& session = next.sessions[s];
    const bool is_idle = session.stage == Stage::kInTransaction &&
                         before_.processes[session.process].paused &&
                         !Has(Mistake::kSessionsOfLostRemain);
    if (session.is_connected && !session.is_terminated && !is_idle) return;
    if (session.stage == Stage::kBroken) return;
    session.stage = Stage::kBroken;
    DropIfDone(&session);
    Emit({Kind::kEndSession, s}, next);
  }

  // The database's clock passes the end of a lease that nobody renews.
  void Expire(uint8_t id) {
    const Lease& lease = before_.leases[id];
    if (!lease.lasts || Runs(before_.processes[lease.holder])) return;
    State next = before_;
    next.leases[id].lasts = false;
    Emit({Kind::kExpire, id}, next);
  }

  // --- Faults.

  // The lease of a process that runs ends, because it is slow to renew it.
  void Lapse(uint8_t p) {
    const uint8_t id = rules_.server_ids[p];
    const Lease& lease = before_.leases[id];
    if (before_.lapses == 0 || !lease.lasts || lease.holder != p) return;
    State next = before_;
    --next.lapses;
    next.leases[id].lasts = false;
    Emit({Kind::kLapse, p}, next);
  }

  // The connection breaks for the client: at any time, before or after the COMMIT was carried out.
  void Break(uint8_t p) {
    State next = before_;
    Session* const session = FindSession(next, p);
    if (before_.breaks == 0 || session == nullptr || session->stage == Stage::kBroken) return;
    --next.breaks;
    HandleBreak(&next, session);
    Emit({Kind::kBreak, p}, next);
  }

  void Pause(uint8_t p) {
    if (before_.pauses == 0) return;
    State next = before_;
    --next.pauses;
    next.processes[p].paused = true;
    Emit({Kind::kPause, p}, next);
  }

  void Resume(uint8_t p) {
    State next = before_;
    next.processes[p].paused = false;
    Emit({Kind::kResume, p}, next);
  }

  void Crash(uint8_t p) {
    if (before_.crashes == 0) return;
    State next = before_;
    --next.crashes;
    if (Session* const session = FindSession(next, p)) Disconnect(session);
    next.processes[p] = Process();
    Emit({Kind::kCrash, p}, next);
  }

  const Rules& rules_;
  const State& before_;
  std::vector<Step>* const steps_;
};

}  // namespace

bool IsFault(Kind kind) { return kind >= Kind::kLapse; }

State InitialState(const Rules& rules) {
  State state;
  state.breaks = rules.breaks;
  state.pauses = rules.pauses;
  state.crashes = rules.crashes;
  state.lapses = rules.lapses;
  for (uint8_t p = 0; p < rules.running; ++p) {
    state.processes[p].role = Role::kIdle;
    state.leases[rules.server_ids[p]] = {p, true};
  }
  return state;
}

void AddSteps(const Rules& rules, const State& state, std::vector<Step>* steps) {
  Stepper(rules, state, steps).AddAll();
}

}  // namespace hypermap::fence_model
