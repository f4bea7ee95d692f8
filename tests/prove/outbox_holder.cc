#include "tests/prove/outbox_holder.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <utility>
#include <variant>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "tests/prove/model.h"

namespace hypermap::prove {
namespace {

constexpr char kWord[] = "hold-outbox";

Observation SeenAt(absl::Time stamp) {
  Detection chair;
  chair.scores = {{"chair", 0.9}};
  chair.hull = Polygon::FromBox({{2.0, 0.5}, {2.6, 1.1}});
  chair.cells.frame_from_cells = PlanarTransform(2.0, 0.5, 0.0);
  chair.cells.resolution_m = 0.1;
  for (int row = 0; row < 6; ++row) chair.cells.spans.push_back({row, 0, 6});
  chair.height = {0.2, 0.7};
  chair.num_points = 400;
  chair.range_m = 1.5;
  chair.weight = 0.8;

  Observation observation;
  observation.robot = kRobot;
  observation.stamp = stamp;
  // The camera is at a height of 0.8 m and looks along x.
  observation.pose.frame_from_camera.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  observation.pose.frame_from_camera.translation() << -1.0, 0.0, 0.8;
  observation.detections.push_back(std::move(chair));
  return observation;
}

// Writes a line with one system call, so that it is written completely or not at all.
void Say(const std::string& line) {
  if (write(STDOUT_FILENO, line.data(), line.size()) < 0) _exit(EXIT_FAILURE);
}

absl::Status Hold(const std::string& file, const std::string& server, int first, int end,
                  absl::Time begin) {
  client::OutboxOptions options;
  options.delivered = [](const client::Delivery& delivery) {
    const Told told = ToldOf(delivery);
    Say(absl::StrCat("told ", delivery.ticket, " ", told.is_edit ? 1 : 0, " ", told.number, " ",
                     told.revision, "\n"));
  };
  const auto outbox = client::Outbox::Open(client::Client(server), file, options);
  HYPERMAP_RETURN_IF_ERROR(outbox.status());
  for (int i = first; i < end; ++i) {
    const absl::StatusOr<client::Ticket> ticket = PutNth(**outbox, i, begin);
    HYPERMAP_RETURN_IF_ERROR(ticket.status());
    Say("put\n");
  }
  return (*outbox)->AwaitEmpty(absl::Hours(1));
}

}  // namespace

std::string LabelOfEdit(int i) { return absl::StrCat("edit ", i); }

absl::StatusOr<client::Ticket> PutNth(client::Outbox& outbox, int i, absl::Time begin) {
  if (!IsEdit(i)) return outbox.Put(kMap, kSeen, SeenAt(begin + absl::Milliseconds(i)));
  SemanticObject object;
  object.label = LabelOfEdit(i);
  object.shape = Polygon::FromBox({{1.0, 1.0}, {2.0, 2.0}});
  return outbox.Put(kMap, {{PutObject{kQueued, object, ""}}});
}

Told ToldOf(const client::Delivery& delivery) {
  if (const auto* edit = std::get_if<client::EditAnswer>(&delivery.answer)) {
    return {true, edit->object_ids.front(), edit->revision};
  }
  const auto& acknowledgement = std::get<client::Acknowledgement>(delivery.answer);
  const bool is_new = acknowledgement.outcome == client::ObservationOutcome::kAccepted;
  return {false, acknowledgement.sequence, is_new ? acknowledgement.revision : 0};
}

absl::StatusOr<OutboxHolder> OutboxHolder::Start(const std::string& file, const std::string& server,
                                                 int first, int end, absl::Time begin) {
  const std::vector<std::string> command = {"/proc/self/exe",
                                            kWord,
                                            file,
                                            server,
                                            absl::StrCat(first),
                                            absl::StrCat(end),
                                            absl::StrCat(absl::ToUnixMillis(begin))};
  std::vector<char*> argv;
  for (const std::string& word : command) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return absl::ErrnoToStatus(errno, "pipe");
  const pid_t pid = fork();
  if (pid < 0) return absl::ErrnoToStatus(errno, "fork");
  if (pid == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    dup2(ends[1], STDOUT_FILENO);
    execv(argv[0], argv.data());
    _exit(127);
  }
  close(ends[1]);
  return OutboxHolder(pid, ends[0]);
}

OutboxHolder::OutboxHolder(OutboxHolder&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)),
      output_(std::exchange(other.output_, -1)),
      line_(std::move(other.line_)),
      num_put_(other.num_put_),
      told_(std::move(other.told_)) {}

OutboxHolder::~OutboxHolder() {
  if (pid_ > 0) Kill();
}

bool OutboxHolder::Read() {
  char c = 0;
  line_.clear();
  while (read(output_, &c, 1) == 1 && c != '\n') line_ += c;
  if (c != '\n') return false;
  const std::vector<std::string> words = absl::StrSplit(line_, ' ');
  if (words[0] == "put") ++num_put_;
  int64_t ticket = 0, is_edit = 0, number = 0, revision = 0;
  if (words.size() == 5 && absl::SimpleAtoi(words[1], &ticket) &&
      absl::SimpleAtoi(words[2], &is_edit) && absl::SimpleAtoi(words[3], &number) &&
      absl::SimpleAtoi(words[4], &revision)) {
    told_[ticket] = {is_edit != 0, number, revision};
  }
  return true;
}

void OutboxHolder::Kill() {
  kill(pid_, SIGKILL);
  while (Read()) {
  }
  waitpid(pid_, nullptr, 0);
  close(output_);
  pid_ = -1;
}

std::optional<int> HoldOutbox(int argc, char** argv) {
  if (argc != 7 || std::strcmp(argv[1], kWord) != 0) return std::nullopt;
  int first = 0, end = 0;
  int64_t begin_ms = 0;
  if (!absl::SimpleAtoi(argv[4], &first) || !absl::SimpleAtoi(argv[5], &end) ||
      !absl::SimpleAtoi(argv[6], &begin_ms)) {
    return EXIT_FAILURE;
  }
  const absl::Status status = Hold(argv[2], argv[3], first, end, absl::FromUnixMillis(begin_ms));
  if (status.ok()) return EXIT_SUCCESS;
  std::fprintf(stderr, "%s: %s\n", kWord, status.ToString().c_str());
  return EXIT_FAILURE;
}

}  // namespace hypermap::prove
