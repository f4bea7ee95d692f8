#include "base/admission/connection_listener.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/time/clock.h"
#include "base/admission/client_host.h"
#include "base/admission/memory.h"
#include "base/status/status_macros.h"
#include "base/sync/start_thread.h"
#include "base/sync/steady_time.h"

namespace hypermap::admission {
namespace {

// Period of the look at memory and at connections that are open. New connections don't make it
// shorter: under a flood of them, the looks would take a processor.
constexpr absl::Duration kPeriod = absl::Milliseconds(20);
// Number of connections that are accepted in a row before open ones are looked at again.
constexpr int kMaxAccepted = 64;
constexpr int kNiceness = -10;
// ShutDownLargest leaves a connection with fewer unexplained bytes alone. If the server explains
// none, kMinBusyBytes is the same for the bytes that a connection receives in one period.
constexpr int64_t kMinUnexplainedBytes = 8 << 10;
constexpr int64_t kMinBusyBytes = 64 << 10;
// ShutDownLargest shuts down nothing if all connections together have less than this part of the
// memory in unexplained bytes: something else takes the memory then.
constexpr int64_t kMinPart = 16;
// Period of counting unexplained bytes while memory is not short.
constexpr absl::Duration kAccountPeriod = absl::Milliseconds(200);
// Shortest period of counting open streams, which takes at most one part in kStreamsPart of the
// thread's time.
constexpr absl::Duration kStreamsPeriod = absl::Milliseconds(20);
constexpr int kStreamsPart = 4;
// A connection with fewer streams without a message is not shut down for them.
constexpr int64_t kMinUnknownStreams = 100;
// gRPC takes some 100 µs of a processor to begin and to end a stream without a message. For each
// one that was shut down, new connections of its host wait five times as long, so that such streams
// take a fifth of one processor; but never longer than kMaxWaitForStreams.
constexpr absl::Duration kWaitPerStream = absl::Microseconds(500);
constexpr absl::Duration kMaxWaitForStreams = absl::Seconds(10);
// Number of stalled connections that are shut down in one look, and the time until the next such
// look: it takes gRPC some time to free their memory.
constexpr int kMaxStalled = 16;
constexpr absl::Duration kStalledPeriod = absl::Milliseconds(200);
constexpr absl::Duration kLargestPeriod = absl::Milliseconds(100);
constexpr absl::string_view kCancelledCalls = "they flood the server with cancelled calls";
constexpr absl::Duration kRemovalPeriod = absl::Milliseconds(200);
// Time that a new connection of a host that has flooded waits for each of its floods.
constexpr absl::Duration kHoldPerFlood = absl::Milliseconds(100);
constexpr int kMaxHolds = 8;
// A host without floods for this time is suspected no longer.
constexpr absl::Duration kSuspicion = absl::Minutes(1);
// Pace of new connections of a host.
constexpr double kConnectionsPerSecond = 200;
constexpr double kBurst = 1000;
// The same for a host that has flooded: when several of its connections had to wait, each may have
// the next flood ready. One after another, so that a flood of one is seen before several are there.
constexpr double kSuspectsPerSecond = 20;
constexpr double kSuspectsBurst = 1;
constexpr absl::Duration kLogPeriod = absl::Seconds(10);
// Returning freed memory to the system takes locks of the allocator.
constexpr absl::Duration kReturnPeriod = absl::Seconds(5);
constexpr absl::Duration kReturnPeriodAfterShutDown = absl::Milliseconds(500);
// Freed memory is returned while this much more is resident than there once was. The time between
// two returns doubles while they free little, because the memory is in use.
constexpr int64_t kPeakBytes = int64_t{64} << 20;
constexpr absl::Duration kMinPeakPeriod = absl::Seconds(2);
constexpr absl::Duration kMaxPeakPeriod = absl::Minutes(5);
// Time in which memory that the server keeps no longer is freed.
constexpr absl::Duration kFreeingPeriod = absl::Seconds(1);

FileDescriptor OpenSpare() { return FileDescriptor(open("/dev/null", O_RDONLY | O_CLOEXEC)); }

void AppendPeer(std::string* text, const ShutDownPeer& peer) { text->append(peer.peer); }

bool IsClosedByPeer(int socket) {
  pollfd polled{socket, POLLRDHUP, 0};
  return poll(&polled, 1, 0) == 1 && polled.revents != 0;
}

bool LacksResources(int error) {
  return error == EMFILE || error == ENFILE || error == ENOBUFS || error == ENOMEM;
}

// Returns whether the period has passed since `last`; if so, sets it to now.
bool IsDue(SteadyTime* last, absl::Duration period) {
  const SteadyTime now = SteadyTime::Now();
  if (now < *last + period) return false;
  *last = now;
  return true;
}

// Returns whether a line may be logged, and counts it as logged then.
bool MayLog(SteadyTime* last) { return IsDue(last, kLogPeriod); }

}  // namespace

absl::StatusOr<std::unique_ptr<ConnectionListener>> ConnectionListener::Start(
    ConnectionListenerOptions options) {
  HYPERMAP_ASSIGN_OR_RETURN(ListeningSockets listening, Listen(options.address));
  // Opens the file that it reads, while there are descriptors.
  ResidentMemory();
  FileDescriptor wake(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
  if (!wake.is_open()) return absl::ErrnoToStatus(errno, "eventfd");
  std::unique_ptr<ConnectionListener> listener(
      new ConnectionListener(std::move(options), std::move(listening), std::move(wake)));
  HYPERMAP_ASSIGN_OR_RETURN(listener->handover_, Handover::Start(listener->options_.accept));
  HYPERMAP_ASSIGN_OR_RETURN(
      listener->thread_,
      StartThread("hm-listener", [started = listener.get()] { started->Run(); }));
  return listener;
}

ConnectionListener::ConnectionListener(ConnectionListenerOptions options,
                                       ListeningSockets listening, FileDescriptor wake)
    : options_(std::move(options)),
      address_(std::move(listening.address)),
      listeners_(std::move(listening.sockets)),
      connections_(options_.limits),
      pace_(kConnectionsPerSecond, kBurst),
      pace_of_suspects_(kSuspectsPerSecond, kSuspectsBurst),
      spare_(OpenSpare()),
      peak_period_(kMinPeakPeriod),
      wake_(std::move(wake)) {}

ConnectionListener::~ConnectionListener() { Stop(); }

void ConnectionListener::Stop() {
  if (!thread_.joinable()) return;
  stopping_ = true;
  const uint64_t one = 1;
  // Can't fail: the counter is far from its end.
  [[maybe_unused]] const ssize_t written = write(wake_.get(), &one, sizeof one);
  thread_.join();
  handover_.reset();
}

void ConnectionListener::Run() {
  // So that a flood is seen while it keeps the processors busy. Needs a privilege; without it, the
  // thread works as well.
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNiceness);
  std::vector<pollfd> polled;
  for (const FileDescriptor& listener : listeners_) polled.push_back({listener.get(), POLLIN, 0});
  polled.push_back({wake_.get(), POLLIN, 0});
  while (!stopping_) {
    poll(polled.data(), polled.size(), TimeToNextLook_ms());
    for (size_t i = 0; i + 1 < polled.size(); ++i) {
      if (polled[i].revents != 0 && !stopping_) AcceptSome(polled[i].fd);
    }
    if (IsDue(&looked_, kPeriod)) Look();
  }
  listeners_.clear();
  held_.clear();
}

int ConnectionListener::TimeToNextLook_ms() const {
  const bool has_connections = connections_.size() > 0;
  // Without connections there is nothing to look at, but memory may have to be returned.
  if (!has_connections && !has_peak_) return -1;
  const SteadyTime next = has_connections ? looked_ + kPeriod : peak_returned_ + peak_period_;
  const absl::Duration left = next - SteadyTime::Now();
  const auto most_ms = absl::ToInt64Milliseconds(has_connections ? kPeriod : kMaxPeakPeriod);
  // Rounded up.
  return static_cast<int>(std::clamp<int64_t>(absl::ToInt64Milliseconds(left) + 1, 0, most_ms));
}

void ConnectionListener::Look() {
  connections_.RemoveClosed(kRemovalPeriod);
  num_open_ = connections_.size();
  GuardFloods();
  ReleaseHeld();
  handover_->Attend();
  AccountBytes();
  if (options_.max_resident_bytes > 0) GuardMemory();
}

void ConnectionListener::GuardFloods() {
  std::vector<ShutDownPeer> floods = connections_.ShutDownFloods();
  for (ShutDownPeer& flood : connections_.ShutDown(options_.floods(), kCancelledCalls)) {
    floods.push_back(std::move(flood));
  }
  for (const ShutDownPeer& flood : floods) Suspected(flood.host);
  ReportShutDown(floods);
}

ConnectionListener::Suspect& ConnectionListener::Suspected(const std::string& host) {
  // Bounds the suspects of a flood from many hosts.
  const SteadyTime oldest = SteadyTime::Now() - kSuspicion;
  absl::erase_if(suspects_, [&](const auto& known) { return known.second.last_flood < oldest; });
  Suspect& suspect = suspects_[host];
  suspect.num_floods = std::min(suspect.num_floods + 1, kMaxHolds);
  suspect.last_flood = SteadyTime::Now();
  return suspect;
}

absl::Duration ConnectionListener::WaitAfterFloods(const std::string& host) {
  const auto suspect = suspects_.find(host);
  if (suspect == suspects_.end()) return absl::ZeroDuration();
  const Suspect& known = suspect->second;
  if (SteadyTime::Now() > known.last_flood + kSuspicion) {
    suspects_.erase(suspect);
    return absl::ZeroDuration();
  }
  return known.num_floods * kHoldPerFlood;
}

void ConnectionListener::AcceptOrHold(FileDescriptor socket, const std::string& host) {
  const absl::Duration wait = WaitAfterFloods(host);
  if (wait == absl::ZeroDuration() && pace_.Take(host, SteadyTime::Now())) {
    return handover_->Give(std::move(socket));
  }
  connections_.SetHeld(socket.get(), true);
  held_.push_back({std::move(socket), host, SteadyTime::Now() + wait});
}

void ConnectionListener::ReleaseHeld() {
  if (held_.empty()) return;
  const SteadyTime now = SteadyTime::Now();
  std::deque<Held> waiting;
  for (Held& held : std::exchange(held_, {})) {
    if (IsClosedByPeer(held.socket.get())) continue;
    const bool is_suspect = WaitAfterFloods(held.host) > absl::ZeroDuration();
    const bool waits = now < held.until || (is_suspect && now < suspects_[held.host].streams_until);
    Pace& pace = is_suspect ? pace_of_suspects_ : pace_;
    // A flood is shut down only after its wait: a client that is told later comes again later.
    if (!waits && HasManyResets(held.socket.get())) {
      Suspected(held.host);
      ++num_shut_down_;
    } else if (waits || !pace.Take(held.host, now)) {
      waiting.push_back(std::move(held));
    } else {
      connections_.SetHeld(held.socket.get(), false);
      handover_->Give(std::move(held.socket));
    }
  }
  held_ = std::move(waiting);
}

void ConnectionListener::AcceptSome(int listener) {
  for (int i = 0; i < kMaxAccepted && !stopping_; ++i) {
    sockaddr_storage peer{};
    socklen_t length = sizeof peer;
    FileDescriptor socket(accept4(listener, reinterpret_cast<sockaddr*>(&peer), &length,
                                  SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (!socket.is_open()) {
      // The connection was closed before it was accepted.
      if (errno == ECONNABORTED || errno == EINTR) continue;
      if (LacksResources(errno) && RefuseWithSpare(listener)) continue;
      return;
    }
    if (const absl::Status status = connections_.Add(socket.get(), peer); !status.ok()) {
      Refuse(std::string(status.message()));
      continue;
    }
    AcceptOrHold(std::move(socket), HostOf(peer));
  }
}

bool ConnectionListener::RefuseWithSpare(int listener) {
  const std::string reason(absl::ErrnoToStatus(errno, "accept").message());
  spare_.Close();
  const bool accepted =
      FileDescriptor(accept4(listener, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC)).is_open();
  spare_ = OpenSpare();
  if (accepted) {
    Refuse(reason);
  } else {
    // The connection still waits, so that poll would return at once, again and again.
    absl::SleepFor(kPeriod);
  }
  return accepted;
}

void ConnectionListener::Refuse(const std::string& reason) {
  if (MayLog(&refusal_logged_)) {
    options_.log(absl::StrCat("connections are refused: ", reason,
                              "; refused before: ", num_refused_.load()));
  }
  ++num_refused_;
}

void ConnectionListener::ReportShutDown(const std::vector<ShutDownPeer>& peers,
                                        absl::string_view more) {
  absl::flat_hash_map<absl::string_view, std::vector<ShutDownPeer>> by_reason;
  for (const ShutDownPeer& peer : peers) by_reason[peer.reason].push_back(peer);
  for (const auto& [reason, shut_down] : by_reason) {
    const auto [logged, is_new] = shutdown_logged_.try_emplace(reason, SteadyTime::InfinitePast());
    if (!MayLog(&logged->second)) continue;
    options_.log(absl::StrCat("connections were shut down, because ", reason, more, ": ",
                              absl::StrJoin(shut_down, ", ", AppendPeer)));
  }
  num_shut_down_ += static_cast<int64_t>(peers.size());
}

void ConnectionListener::AccountBytes() {
  if (!IsDue(&accounted_, is_memory_short_ ? absl::ZeroDuration() : kAccountPeriod)) return;
  if (!options_.take_explained) {
    if (is_memory_short_) connections_.AccountUnexplained();
    return;
  }
  // Before the received bytes are counted, so that the explained ones are among them.
  connections_.Account(options_.take_explained());
  if (options_.max_unexplained_bytes == 0 ||
      connections_.MostUnexplainedBytes() <= options_.max_unexplained_bytes) {
    return;
  }
  // Forgets messages that were given up.
  if (options_.open_streams) connections_.AccountStreams(options_.open_streams());
  ReportShutDown(connections_.ShutDownBeyond(options_.max_unexplained_bytes));
}

int64_t ConnectionListener::KeptBytes() {
  const int64_t kept = options_.kept_bytes();
  const SteadyTime now = SteadyTime::Now();
  // Content that was dropped is freed within kFreeingPeriod, and stays resident until it is
  // returned to the system. Until then the earlier, larger value counts, so that no connection is
  // shut down for it.
  const bool has_fallen = kept < most_kept_ - options_.max_resident_bytes / 8;
  if (!has_fallen) kept_fell_ = now;
  if (now - kept_fell_ > kFreeingPeriod) {
    ReturnFreedMemory();
    most_kept_ = kept;
  }
  most_kept_ = std::max(most_kept_, kept);
  return most_kept_;
}

void ConnectionListener::ReturnAfterPeak(int64_t resident) {
  least_resident_ = std::min(least_resident_, resident);
  has_peak_ = resident > least_resident_ + kPeakBytes;
  if (!has_peak_ || !IsDue(&peak_returned_, peak_period_)) return;
  ReturnFreedMemory();
  const bool has_freed = ResidentMemory() < resident - kPeakBytes / 8;
  peak_period_ = has_freed ? kMinPeakPeriod : std::min(2 * peak_period_, kMaxPeakPeriod);
}

void ConnectionListener::GuardMemory() {
  const int64_t total = ResidentMemory();
  ReturnAfterPeak(total);
  const int64_t kept = KeptBytes();
  // `resident` is the memory that connections may have caused; `most` is the memory that they may
  // cause: the limit without the kept memory, and at least half of the limit.
  const int64_t resident = total - kept;
  const int64_t most =
      std::max(options_.max_resident_bytes - kept, options_.max_resident_bytes / 2);
  // Counts before the bound is reached, so that the connections that are busy then are known.
  is_memory_short_ = resident > most / 4 * 3;
  GuardStreams(resident, most);
  if (resident > most / 4 && SteadyTime::Now() - streams_shut_down_ < kReturnPeriod) ReturnMemory();
  if (resident <= most / 2) return;
  const std::string more = absl::StrCat(", and ", total, " bytes of memory are in use");
  if (IsDue(&stalled_shut_down_, kStalledPeriod)) {
    ReportShutDown(connections_.ShutDownStalled(kMaxStalled), more);
  }
  if (resident <= most / 16 * 15) return;
  if (largest_shut_down_ + kLargestPeriod < SteadyTime::Now()) {
    const std::vector<ShutDownPeer> peers =
        connections_.ShutDownLargest(options_.take_explained ? kMinUnexplainedBytes : kMinBusyBytes,
                                     options_.take_explained ? most / kMinPart : 0);
    ReportShutDown(peers, more);
    if (!peers.empty()) largest_shut_down_ = SteadyTime::Now();
  }
  ReturnMemory();
}

void ConnectionListener::GuardStreams(int64_t resident, int64_t most) {
  const SteadyTime begin = SteadyTime::Now();
  const bool has_suspects = begin - streams_shut_down_ < kSuspicion;
  if (!options_.open_streams || (resident <= most / 8 && !has_suspects)) return;
  if (begin < streams_due_) return;
  connections_.AccountStreams(options_.open_streams());
  const absl::Duration taken = SteadyTime::Now() - begin;
  streams_due_ = begin + std::max(kStreamsPeriod, taken * kStreamsPart);
  // When a connection is shut down, gRPC passes its open streams to the server as calls, which need
  // as much memory again. Therefore the streams that are still open are added to what is resident.
  const bool all = resident + connections_.BytesOfUnknownStreams() > most / 8 * 3;
  const auto is_guarded = [&](const std::string& host) {
    if (all) return true;
    const auto suspect = suspects_.find(host);
    return suspect != suspects_.end() && begin - suspect->second.streams_until < kSuspicion;
  };
  const std::vector<ShutDownPeer> peers =
      connections_.ShutDownStreams(kMinUnknownStreams, is_guarded);
  for (const ShutDownPeer& peer : peers) {
    Suspect& suspect = Suspected(peer.host);
    suspect.streams_until =
        std::min(std::max(suspect.streams_until, begin) + peer.num_unknown_streams * kWaitPerStream,
                 begin + kMaxWaitForStreams);
  }
  if (!peers.empty()) streams_shut_down_ = begin;
  ReportShutDown(peers, absl::StrCat(", and ", resident, " bytes of memory are in use"));
}

void ConnectionListener::ReturnMemory() {
  // Below the bound, memory is kept for reuse. What was shut down is freed soon after.
  const absl::Duration since = SteadyTime::Now() - std::max(largest_shut_down_, streams_shut_down_);
  const bool after_shutdown = since > kLargestPeriod && since < kReturnPeriod;
  if (!IsDue(&memory_returned_, after_shutdown ? kReturnPeriodAfterShutDown : kReturnPeriod)) {
    return;
  }
  ReturnFreedMemory();
}

}  // namespace hypermap::admission
