// The invariants of the model. Each uses the state alone.
#include <algorithm>

#include "tests/fleet/fence_model.h"

namespace hypermap::fence_model {
namespace {

bool HoldsRow(const Session& session) {
  return session.work != Work::kNone &&
         (session.stage == Stage::kInTransaction || session.stage == Stage::kCommitSent);
}

// Each edit was applied to the one before it.
bool IsOneSequence(const State& state) {
  for (uint8_t i = 0; i < state.num_edits; ++i) {
    if (state.edits[i].base != i) return false;
  }
  return state.row.revision == state.num_edits;
}

int CountEdits(const State& state, uint8_t request) {
  return static_cast<int>(
      std::count_if(state.edits.begin(), state.edits.begin() + state.num_edits,
                    [request](const Edit& edit) { return edit.request == request; }));
}

bool IsEachRequestCarriedOutOnce(const State& state) {
  for (uint8_t i = 0; i < state.num_edits; ++i) {
    if (CountEdits(state, state.edits[i].request) > 1) return false;
  }
  return true;
}

bool IsEachAnsweredEditStored(const State& state) {
  for (uint8_t request = 1; request < 8; ++request) {
    if ((state.answered & Bit(request)) != 0 && CountEdits(state, request) != 1) return false;
  }
  return true;
}

template <typename Holds>
bool AllEdits(const State& state, Holds holds) {
  return std::all_of(state.edits.begin(), state.edits.begin() + state.num_edits, holds);
}

}  // namespace

bool IsRowLocked(const State& state) {
  return std::any_of(state.sessions.begin(), state.sessions.end(), HoldsRow);
}

const char* FindViolation(const State& state) {
  if (!IsOneSequence(state)) return "edits form one sequence";
  if (!IsEachRequestCarriedOutOnce(state)) return "a request is carried out once";
  if (!IsEachAnsweredEditStored(state)) return "what was answered with OK is stored once";
  if (!AllEdits(state, [](const Edit& edit) { return !edit.was_denied; })) {
    return "what was answered as not stored is never stored";
  }
  if (!AllEdits(state, [](const Edit& edit) { return edit.had_epoch; })) {
    return "who commits has the epoch of the row";
  }
  if (!AllEdits(state, [](const Edit& edit) { return edit.was_of_last_taker; })) {
    return "only who took the map last commits";
  }
  if (state.was_answer_wrong) return "an answer is the truth";
  if (state.was_living_robbed) return "a map is not taken while its owner's lease lasts";
  return nullptr;
}

bool CanWrite(const State& state) {
  if (IsRowLocked(state)) return false;
  return std::any_of(state.processes.begin(), state.processes.end(), [&](const Process& process) {
    return process.role == Role::kOwner && !process.paused && process.epoch == state.row.epoch &&
           process.last_write == state.row.last_write && process.revision == state.row.revision;
  });
}

bool HasRunningProcess(const Rules& rules, const State& state) {
  return std::any_of(state.processes.begin(), state.processes.begin() + rules.server_ids.size(),
                     [](const Process& process) { return !process.paused; });
}

}  // namespace hypermap::fence_model
