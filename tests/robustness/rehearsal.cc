#include "tests/robustness/rehearsal.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::robustness {
namespace {

constexpr unsigned kPatienceSeconds = 60;

void WriteAll(int fd, absl::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t size = write(fd, bytes.data(), bytes.size());
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return;
    bytes.remove_prefix(static_cast<size_t>(size));
  }
}

std::string ReadAll(int fd) {
  std::string bytes;
  char part[65536];
  while (true) {
    const ssize_t size = read(fd, part, sizeof(part));
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return bytes;
    bytes.append(part, static_cast<size_t>(size));
  }
}

// Texts with their sizes before them.
void Pack(absl::string_view text, std::string* bytes) {
  const uint64_t size = text.size();
  bytes->append(reinterpret_cast<const char*>(&size), sizeof(size));
  bytes->append(text.data(), text.size());
}

std::string Unpack(absl::string_view* bytes) {
  uint64_t size = 0;
  if (bytes->size() < sizeof(size)) return "";
  memcpy(&size, bytes->data(), sizeof(size));
  bytes->remove_prefix(sizeof(size));
  std::string text(bytes->substr(0, size));
  bytes->remove_prefix(text.size());
  return text;
}

// What a process would find that is started now, without the index of the log.
absl::StatusOr<Description> DescribeCopy(Scenario& scenario, const std::string& folder) {
  FileTree files = ReadTree(folder);
  std::erase_if(files, [](const auto& file) { return file.first.ends_with("-shm"); });
  const std::string copy = folder + ".copy";
  WriteTree(files, copy);
  absl::StatusOr<Description> description = DescribeApart(scenario, copy);
  std::filesystem::remove_all(copy);
  return description;
}

}  // namespace

absl::StatusOr<Description> DescribeApart(Scenario& scenario, const std::string& folder) {
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::string packed, RunApart([&]() -> absl::StatusOr<std::string> {
        HYPERMAP_ASSIGN_OR_RETURN(const Description description, scenario.Describe(folder));
        std::string bytes;
        for (const auto& [name, text] : description) {
          Pack(name, &bytes);
          Pack(text, &bytes);
        }
        return bytes;
      }));
  Description description;
  for (absl::string_view bytes = packed; !bytes.empty();) {
    const std::string name = Unpack(&bytes);
    description[name] = Unpack(&bytes);
  }
  return description;
}

absl::StatusOr<std::string> RunApart(absl::FunctionRef<absl::StatusOr<std::string>()> function) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return absl::ErrnoToStatus(errno, "pipe2");
  const pid_t child = fork();
  if (child == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    alarm(kPatienceSeconds);
    const absl::StatusOr<std::string> result = function();
    std::string bytes;
    Pack(result.ok() ? *result : result.status().message(), &bytes);
    const auto code = static_cast<char>(result.status().code());
    WriteAll(ends[1], std::string(1, code) + bytes);
    _exit(0);
  }
  close(ends[1]);
  const std::string bytes = ReadAll(ends[0]);
  close(ends[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || bytes.empty()) {
    return absl::InternalError(
        absl::StrCat("the process died of signal ", WIFSIGNALED(status) ? WTERMSIG(status) : 0));
  }
  absl::string_view rest = absl::string_view(bytes).substr(1);
  std::string text = Unpack(&rest);
  const auto code = static_cast<absl::StatusCode>(bytes[0]);
  if (code != absl::StatusCode::kOk) return absl::Status(code, text);
  return text;
}

bool CanFail(const SeenCall& call) {
  if (call.number == SYS_flock) return (call.arguments[1] & LOCK_UN) == 0;
  if (call.number != SYS_fcntl) return true;
  struct flock lock {};
  const auto raw = ReadMemory(call.thread, call.arguments[2], sizeof(lock));
  if (raw) memcpy(&lock, raw->data(), sizeof(lock));
  return lock.l_type != F_UNLCK;
}

void Live(const Rehearsal& rehearsal, const std::string& folder, Plant plant,
          const Teller& teller) {
  std::unique_ptr<Actor> actor = rehearsal.scenario->Start(folder);
  const int num_steps = rehearsal.scenario->num_steps();
  for (int step = 1; step <= num_steps; ++step) {
    teller.Tell(Message::Kind::kBegin, step);
    if (plant == Plant::kAcknowledgedTooEarly) teller.Tell(Message::Kind::kDone, step);
    absl::Status status;
    for (int i = 0; i < kTries; ++i) {
      status = actor->Do(step);
      if (status.ok() || plant == Plant::kErrorIsIgnored) break;
      teller.Tell(Message::Kind::kFailed, step, status.raw_code(), status.ToString());
    }
    if (!status.ok() && plant != Plant::kErrorIsIgnored) _exit(1);
    teller.Tell(Message::Kind::kDone, step);
  }
  absl::StatusOr<Description> answers;
  for (int i = 0; i < kTries; ++i) {
    answers = actor->Describe();
    if (answers.ok()) break;
    teller.Tell(Message::Kind::kFailed, num_steps, answers.status().raw_code(),
                answers.status().ToString());
  }
  // In the rehearsal the states are not known yet.
  if (static_cast<int>(rehearsal.states.size()) > num_steps) {
    const Judgement judgement = JudgeParts(answers, rehearsal.states[num_steps]);
    if (judgement.outcome != Outcome::kWhole) {
      teller.Tell(Message::Kind::kProblem, num_steps, 0, judgement.reason);
    }
  }
  // Closing is a part of every life.
  actor.reset();
  teller.Tell(Message::Kind::kEnd, num_steps);
}

namespace {

// Follows the process of a rehearsal.
class Rehearser {
 public:
  Rehearser(Scenario* scenario, std::string folder, Plant plant, std::vector<Description> known)
      : folder_(std::move(folder)), plant_(plant), finds_states_(known.empty()) {
    rehearsal_.scenario = scenario;
    rehearsal_.states = std::move(known);
  }

  absl::StatusOr<Rehearsal> Run() {
    HYPERMAP_RETURN_IF_ERROR(Prepare());
    // The child has a rehearsal without states.
    const Rehearsal unfinished{rehearsal_.scenario, {}, {}, {}, {}, nullptr, {}};
    const Ending ending = Supervise(
        {.child = [&](const Teller& teller) { Live(unfinished, folder_, plant_, teller); },
         .folder = folder_,
         .on_call = [this](const SeenCall& call) { return See(call); },
         .on_message = [this](const Message& message) { Hear(message); }});
    HYPERMAP_RETURN_IF_ERROR(problem_);
    if (ending.kind != Ending::Kind::kExited || !has_ended_) {
      return absl::InternalError(absl::StrCat("the process ends with ", ending.number));
    }
    rehearsal_.after = ReadTree(folder_);
    return std::move(rehearsal_);
  }

 private:
  absl::Status Prepare() {
    WriteTree({}, folder_);
    const auto prepared = RunApart([&]() -> absl::StatusOr<std::string> {
      HYPERMAP_RETURN_IF_ERROR(rehearsal_.scenario->Prepare(folder_));
      return "";
    });
    HYPERMAP_RETURN_IF_ERROR(prepared.status());
    rehearsal_.before = ReadTree(folder_);
    DescribeState();
    rehearsal_.record = std::make_unique<Recorder>(folder_);
    Note();
    return absl::OkStatus();
  }

  void DescribeState() {
    if (!finds_states_) return;
    auto description = DescribeCopy(*rehearsal_.scenario, folder_);
    if (!description.ok() && problem_.ok()) problem_ = description.status();
    rehearsal_.states.push_back(description.value_or(Description()));
  }

  void Note() {
    rehearsal_.record->AddNote(static_cast<int64_t>(rehearsal_.progress.size()));
    rehearsal_.progress.push_back(now_);
  }

  Answer See(const SeenCall& call) {
    Answer answer;
    const Plant mistake = call.is_folder ? Plant::kFolderSyncIsLeftOut : Plant::kFileSyncIsLeftOut;
    if (call.call == FileCall::kSync && plant_ == mistake) answer.kind = Answer::Kind::kPretend;
    if (CanFail(call)) rehearsal_.calls.push_back({call.call, now_.begun, call.path});
    rehearsal_.record->Add(call, answer);
    return answer;
  }

  void Hear(const Message& message) {
    if (message.kind == Message::Kind::kBegin) now_.begun = message.step;
    if (message.kind == Message::Kind::kDone && now_.done < message.step) {
      now_.done = message.step;
      DescribeState();
    }
    if (message.kind == Message::Kind::kFailed && problem_.ok()) {
      problem_ = absl::InternalError(absl::StrCat("step ", message.step, ": ", message.text));
    }
    has_ended_ = has_ended_ || message.kind == Message::Kind::kEnd;
    Note();
  }

  const std::string folder_;
  const Plant plant_;
  const bool finds_states_;
  Rehearsal rehearsal_;
  absl::Status problem_;
  Progress now_;
  bool has_ended_ = false;
};

}  // namespace

absl::StatusOr<Rehearsal> Rehearse(Scenario* scenario, const std::string& folder, Plant plant,
                                   std::vector<Description> known) {
  auto rehearsal = Rehearser(scenario, folder, plant, std::move(known)).Run();
  if (rehearsal.ok()) return rehearsal;
  return absl::Status(rehearsal.status().code(), absl::StrCat("scenario ", scenario->name(), ": ",
                                                              rehearsal.status().message()));
}

Judgement JudgeFolder(const Rehearsal& rehearsal, const std::string& folder, const Progress& known,
                      bool lost_power) {
  const absl::StatusOr<std::string> judged = RunApart([&]() -> absl::StatusOr<std::string> {
    Scenario& scenario = *rehearsal.scenario;
    Judgement judgement =
        Judge(scenario.Describe(folder), rehearsal.states, known.done, known.begun, !lost_power);
    if (judgement.outcome == Outcome::kWhole) {
      if (const absl::Status status = scenario.GoOn(folder); !status.ok()) {
        judgement = {Outcome::kWedged, absl::StrCat("the next change: ", status.ToString())};
      }
    }
    return static_cast<char>(judgement.outcome) + judgement.reason;
  });
  if (!judged.ok()) return {Outcome::kWedged, judged.status().ToString()};
  return {static_cast<Outcome>((*judged)[0]), judged->substr(1)};
}

}  // namespace hypermap::robustness
