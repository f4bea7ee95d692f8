#include "base/admission/refusals.h"

#include <cstddef>

#include "absl/strings/ascii.h"
#include "absl/strings/cord.h"
#include "base/sync/steady_time.h"

namespace hypermap::admission {
namespace {

constexpr char kTryLaterPayload[] = "hypermap/try-later";
constexpr absl::Duration kLogPeriod = absl::Seconds(10);
constexpr char kNoFlag[] = "a limit";
// Messages may have text that a client chose, which must not fill the table.
constexpr size_t kMaxFlags = 64;

// Returns the first flag that the message names.
std::string FlagIn(absl::string_view message) {
  const size_t begin = message.find("--");
  if (begin == message.npos) return kNoFlag;
  size_t end = begin + 2;
  while (end < message.size() && (absl::ascii_isalnum(message[end]) || message[end] == '_')) ++end;
  return std::string(message.substr(begin, end - begin));
}

}  // namespace

absl::Status TryLater(absl::string_view message) {
  absl::Status status = absl::ResourceExhaustedError(message);
  status.SetPayload(kTryLaterPayload, absl::Cord());
  return status;
}

bool IsTryLater(const absl::Status& status) {
  return status.GetPayload(kTryLaterPayload).has_value();
}

void Refusals::Count(const absl::Status& status) {
  if (!absl::IsResourceExhausted(status)) return;
  const SteadyTime now = SteadyTime::Now();
  const std::string message(status.message());
  Line line{FlagIn(message), 0, message};
  {
    const MutexLock lock(&mutex_);
    if (IsTryLater(status)) overloaded_ = now;
    if (entries_.size() >= kMaxFlags && !entries_.contains(line.flag)) line.flag = kNoFlag;
    Entry& entry = entries_[line.flag];
    line.count = ++entry.count;
    if (now < entry.logged + kLogPeriod) return;
    entry.logged = now;
  }
  log_(line);
}

int64_t Refusals::NumOf(const std::string& flag) const {
  const MutexLock lock(&mutex_);
  const auto it = entries_.find(flag);
  return it == entries_.end() ? 0 : it->second.count;
}

std::map<std::string, int64_t> Refusals::Numbers() const {
  std::map<std::string, int64_t> numbers;
  const MutexLock lock(&mutex_);
  for (const auto& [flag, entry] : entries_) numbers[flag] = entry.count;
  return numbers;
}

bool Refusals::IsOverloaded(absl::Duration within) const {
  const MutexLock lock(&mutex_);
  return SteadyTime::Now() < overloaded_ + within;
}

}  // namespace hypermap::admission
