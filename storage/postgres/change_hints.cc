#include "storage/postgres/change_hints.h"

#include <optional>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "base/status/status_macros.h"
#include "base/sync/start_thread.h"

namespace hypermap::storage::postgres {
namespace {

constexpr absl::Duration kPauseAfterFailure = absl::Milliseconds(500);
// Pause between two hints, so that many commits in a second don't cost a hint, and followers a
// read, each.
constexpr absl::Duration kPauseAfterHints = absl::Milliseconds(5);
// How long this takes at most to notice that it is being destroyed.
constexpr absl::Duration kWait = absl::Milliseconds(200);

constexpr char kAnnounce[] = "SELECT pg_notify('hypermap', m) FROM unnest($1::text[]) AS m";

}  // namespace

std::unique_ptr<ChangeHints> ChangeHints::Start(ConnectOptions options) {
  std::unique_ptr<ChangeHints> hints(new ChangeHints(std::move(options)));
  absl::StatusOr<std::thread> sender =
      StartThread("hm-pg-hints", [hints = hints.get()] { hints->SendUntilStopped(); });
  if (sender.ok()) hints->sender_ = *std::move(sender);
  absl::StatusOr<std::thread> listener =
      StartThread("hm-pg-listen", [hints = hints.get()] { hints->ListenUntilStopped(); });
  if (listener.ok()) hints->listener_ = *std::move(listener);
  return hints;
}

ChangeHints::~ChangeHints() {
  {
    const MutexLock lock(&mutex_);
    is_stopping_ = true;
    changed_.NotifyAll();
  }
  if (sender_.joinable()) sender_.join();
  if (listener_.joinable()) listener_.join();
}

void ChangeHints::Listen(Heard heard) {
  const MutexLock lock(&heard_mutex_);
  heard_ = std::move(heard);
}

void ChangeHints::Announce(const std::string& map) {
  const MutexLock lock(&mutex_);
  announced_.insert(map);
  changed_.NotifyAll();
}

std::set<std::string> ChangeHints::AwaitAnnouncements() {
  const MutexLock lock(&mutex_);
  while (announced_.empty() && !is_stopping_) changed_.Wait(&mutex_);
  return std::exchange(announced_, {});
}

bool ChangeHints::PauseAfterFailure() {
  const MutexLock lock(&mutex_);
  if (!is_stopping_) changed_.WaitFor(&mutex_, kPauseAfterFailure);
  return !is_stopping_;
}

absl::Status ChangeHints::Send(const std::set<std::string>& maps) {
  HYPERMAP_RETURN_IF_ERROR(Reconnect(&sender_connection_).status());
  const std::vector<absl::string_view> names(maps.begin(), maps.end());
  return sender_connection_->Query(kAnnounce, absl::MakeConstSpan(names)).status();
}

void ChangeHints::SendUntilStopped() {
  while (true) {
    const std::set<std::string> maps = AwaitAnnouncements();
    if (maps.empty()) return;
    if (Send(maps).ok()) {
      absl::SleepFor(kPauseAfterHints);
      continue;
    }
    {
      const MutexLock lock(&mutex_);
      announced_.insert(maps.begin(), maps.end());
    }
    if (!PauseAfterFailure()) return;
  }
}

absl::StatusOr<bool> ChangeHints::Reconnect(std::unique_ptr<Connection>* connection) const {
  if (*connection != nullptr && !(*connection)->is_broken()) return false;
  connection->reset();
  HYPERMAP_ASSIGN_OR_RETURN(*connection, Connection::Open(options_));
  return true;
}

absl::Status ChangeHints::ListenForAWhile() {
  HYPERMAP_ASSIGN_OR_RETURN(const bool is_new, Reconnect(&listener_connection_));
  if (is_new) {
    const absl::Status status = listener_connection_->Execute("LISTEN hypermap");
    if (!status.ok()) {
      listener_connection_.reset();
      return status;
    }
    // Hints may have been lost.
    Tell("");
  }
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<std::string> heard,
                            listener_connection_->AwaitNotification(kWait));
  if (heard) Tell(*heard);
  return absl::OkStatus();
}

void ChangeHints::ListenUntilStopped() {
  const auto is_stopping = [this] {
    const MutexLock lock(&mutex_);
    return is_stopping_;
  };
  while (!is_stopping()) {
    if (!ListenForAWhile().ok()) PauseAfterFailure();
  }
}

void ChangeHints::Tell(const std::string& map) {
  const MutexLock lock(&heard_mutex_);
  if (heard_) heard_(map);
}

}  // namespace hypermap::storage::postgres
