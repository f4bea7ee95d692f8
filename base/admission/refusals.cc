#include "base/admission/refusals.h"

#include <cstddef>

#include "absl/strings/ascii.h"
#include "absl/strings/cord.h"
#include "absl/time/clock.h"

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

// Whether less than `period` has passed since `last`, by a clock that may be set.
bool IsWithin(absl::Duration period, absl::Time last, absl::Time now) {
  return now >= last && now < last + period;
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
  const absl::Time now = absl::Now();
  const std::string message(status.message());
  Line line{FlagIn(message), 0, message};
  {
    const MutexLock lock(&mutex_);
    if (IsTryLater(status)) overloaded_ = now;
    if (entries_.size() >= kMaxFlags && !entries_.contains(line.flag)) line.flag = kNoFlag;
    Entry& entry = entries_[line.flag];
    line.count = ++entry.count;
    if (IsWithin(kLogPeriod, entry.logged, now)) return;
    entry.logged = now;
  }
  log_(line);
}

int64_t Refusals::NumOf(const std::string& flag) const {
  const MutexLock lock(&mutex_);
  const auto it = entries_.find(flag);
  return it == entries_.end() ? 0 : it->second.count;
}

bool Refusals::IsOverloaded(absl::Duration within) const {
  const absl::Time now = absl::Now();
  const MutexLock lock(&mutex_);
  return IsWithin(within, overloaded_, now);
}

}  // namespace hypermap::admission
