#include "tests/robustness/life.h"

#include <algorithm>

#include "absl/strings/str_cat.h"

namespace hypermap::robustness {
namespace {

// Errors that tell that a retry makes sense.
bool MayPass(int code) {
  const auto status = static_cast<absl::StatusCode>(code);
  return status == absl::StatusCode::kUnavailable ||
         status == absl::StatusCode::kResourceExhausted ||
         status == absl::StatusCode::kFailedPrecondition;
}

}  // namespace

Life RunLife(const Rehearsal& rehearsal, const std::string& folder, Plant plant,
             FaultyCalls* faulty, Recorder* recorder, std::vector<Progress>* notes) {
  Life life;
  int errors = 0;
  const auto note = [&] {
    if (recorder == nullptr) return;
    recorder->AddNote(static_cast<int64_t>(notes->size()));
    notes->push_back(life.progress);
  };
  note();
  Supervised supervised;
  supervised.folder = folder;
  supervised.child = [&](const Teller& teller) { Live(rehearsal, folder, plant, teller); };
  supervised.on_call = [&](const SeenCall& call) {
    const Answer answer = faulty->Next(call);
    if (recorder != nullptr) {
      Answer recorded = answer;
      // A program that believes in a failed sync goes on as if there were none.
      if (answer.kind == Answer::Kind::kPretend) recorded.kind = Answer::Kind::kFail;
      recorder->Add(call, recorded);
    }
    return answer;
  };
  supervised.on_message = [&](const Message& message) {
    switch (message.kind) {
      case Message::Kind::kBegin:
        life.progress.begun = message.step;
        errors = 0;
        break;
      case Message::Kind::kDone:
        life.progress.done = std::max(life.progress.done, message.step);
        break;
      case Message::Kind::kFailed:
        if (++errors >= kErrorsUntilMended) faulty->Mend();
        if (!MayPass(message.code)) {
          life.problem = absl::StrCat("step ", message.step, " fails with ", message.text);
        }
        break;
      case Message::Kind::kProblem:
        life.problem = message.text;
        break;
      case Message::Kind::kEnd:
        life.has_ended = true;
        break;
    }
    note();
  };
  life.ending = Supervise(supervised);
  return life;
}

Judgement JudgeLife(const Life& life) {
  if (life.ending.kind == Ending::Kind::kHangs) return {Outcome::kWedged, "the process hangs"};
  if (life.ending.kind == Ending::Kind::kDied) {
    return {Outcome::kWedged, absl::StrCat("the process dies of signal ", life.ending.number)};
  }
  if (!life.problem.empty()) return {Outcome::kWrong, life.problem};
  return {};
}

}  // namespace hypermap::robustness
