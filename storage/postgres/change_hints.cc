#include "storage/postgres/change_hints.h"

#include <optional>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "base/sync/start_thread.h"

namespace hypermap::storage::postgres {
namespace {

constexpr absl::Duration kPauseAfterFailure = absl::Milliseconds(500);
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

void ChangeHints::SendUntilStopped() {
  std::unique_ptr<Connection> connection;
  while (true) {
    const std::set<std::string> maps = AwaitAnnouncements();
    if (maps.empty()) return;
    if (connection == nullptr || connection->is_broken()) {
      absl::StatusOr<std::unique_ptr<Connection>> opened = Connection::Open(options_);
      // Followers look for themselves now and then.
      if (!opened.ok()) {
        if (!PauseAfterFailure()) return;
        continue;
      }
      connection = *std::move(opened);
    }
    const std::vector<absl::string_view> names(maps.begin(), maps.end());
    connection->Query(kAnnounce, absl::MakeConstSpan(names)).status().IgnoreError();
  }
}

void ChangeHints::ListenUntilStopped() {
  std::unique_ptr<Connection> connection;
  while (true) {
    {
      const MutexLock lock(&mutex_);
      if (is_stopping_) return;
    }
    if (connection == nullptr || connection->is_broken()) {
      absl::StatusOr<std::unique_ptr<Connection>> opened = Connection::Open(options_);
      absl::Status status = opened.status();
      if (status.ok()) status = (*opened)->Execute("LISTEN hypermap");
      if (!status.ok()) {
        if (!PauseAfterFailure()) return;
        continue;
      }
      connection = *std::move(opened);
      // Hints may have been lost.
      Tell("");
    }
    const absl::StatusOr<std::optional<std::string>> heard = connection->AwaitNotification(kWait);
    if (heard.ok() && heard->has_value()) Tell(**heard);
  }
}

void ChangeHints::Tell(const std::string& map) {
  const MutexLock lock(&heard_mutex_);
  if (heard_) heard_(map);
}

}  // namespace hypermap::storage::postgres
