// The text of traces.
#include "tests/fleet/fence_model.h"

namespace hypermap::fence_model {
namespace {

constexpr const char* kWorks[] = {"",           "an edit", "a write in steps", "AskRow",
                                  "a takeover", "Release", "a receipt"};
constexpr const char* kNextStatements[] = {"the first statement", "FindMap (its snapshot)",
                                           "FindMap (the row is locked)", "", "COMMIT"};

std::string NameOf(uint8_t p) { return std::string("process ") + static_cast<char>('A' + p); }

std::string DescribeSession(const Session& session) {
  std::string text =
      std::string(kWorks[static_cast<int>(session.work)]) + " of " + NameOf(session.process);
  if (session.request != 0) text += " for request " + std::to_string(session.request);
  return text + (session.is_connected ? "" : ", whose connection is gone");
}

std::string DescribeHandling(const State& before, uint8_t p) {
  for (const Session& session : before.sessions) {
    if (session.work == Work::kNone || session.process != p || !session.is_connected) continue;
    constexpr const char* kAnswers[] = {"",
                                        "",
                                        "",
                                        "goes on after the lock of the row",
                                        "",
                                        "hears that it is committed",
                                        "hears that it is refused",
                                        "sees that the session is ended"};
    return NameOf(p) + " " + kAnswers[static_cast<int>(session.stage)] + ": " +
           DescribeSession(session);
  }
  return "";
}

std::string DescribeAction(const State& before, const Action& action) {
  const std::string process = NameOf(action.actor);
  switch (action.kind) {
    case Kind::kBeginTake:
      return process + " begins a takeover";
    case Kind::kBeginWrite:
      return process + " is sent request " + std::to_string(action.request);
    case Kind::kBeginTouch:
      return process + " begins a write in steps";
    case Kind::kBeginRelease:
      return process + " releases the map";
    case Kind::kBeginAsk:
      return process + " asks the row for the outcome";
    case Kind::kGiveUp:
      return process + " gives up: the outcome is unknown";
    case Kind::kHandle:
      return DescribeHandling(before, action.actor);
    case Kind::kRenew:
      return process + " renews its lease";
    case Kind::kStart:
      return process + " starts";
    case Kind::kExecute:
      return std::string("database runs ") +
             kNextStatements[static_cast<int>(before.sessions[action.actor].stage)] + ": " +
             DescribeSession(before.sessions[action.actor]);
    case Kind::kEndSession:
      return "database ends the session: " + DescribeSession(before.sessions[action.actor]);
    case Kind::kLapse:
      return process + " renews its lease too late";
    case Kind::kExpire:
      return "the lease of server " + std::to_string(action.actor) + " is over";
    case Kind::kBreak:
      return "the connection of " + process + " breaks";
    case Kind::kPause:
      return process + " is paused";
    case Kind::kResume:
      return process + " goes on after the pause";
    case Kind::kCrash:
      return process + " crashes";
  }
  return "";
}

}  // namespace

std::string Describe(const State& before, const Step& step) {
  const Row& row = step.next.row;
  std::string text = DescribeAction(before, step.action) + "  [epoch " + std::to_string(row.epoch) +
                     ", number " + std::to_string(row.last_write) + ", revision " +
                     std::to_string(row.revision);
  if (row.owner != kNobody) text += ", owner " + std::to_string(row.owner);
  return text + (IsRowLocked(step.next) ? ", locked]" : "]");
}

}  // namespace hypermap::fence_model
