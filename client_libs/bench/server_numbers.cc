#include "client_libs/bench/server_numbers.h"

#include <netdb.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "base/status/status_macros.h"
#include "base/sync/deadline.h"
#include "base/sync/start_thread.h"

namespace hypermap::bench {
namespace {

constexpr absl::Duration kTimeout = absl::Seconds(5);
// The kernel's time of boot, on which the start of a process is based, may change by a second.
constexpr double kStartJitter_s = 1.0;
constexpr size_t kMaxAnswerBytes = size_t{16} << 20U;

absl::StatusOr<double> ValueOf(const std::vector<absl::string_view>& lines,
                               absl::string_view name) {
  for (absl::string_view line : lines) {
    double value = 0.0;
    if (absl::ConsumePrefix(&line, name) && absl::ConsumePrefix(&line, " ") &&
        absl::SimpleAtod(line, &value)) {
      return value;
    }
  }
  return absl::NotFoundError(absl::StrCat("the server's metrics have no ", name));
}

struct HostAndPort {
  std::string host;
  std::string port;
};

absl::StatusOr<HostAndPort> ParseAddress(absl::string_view address) {
  absl::ConsumePrefix(&address, "http://");
  address = address.substr(0, address.find('/'));
  const size_t colon = address.rfind(':');
  if (colon == absl::string_view::npos || colon == 0 || colon + 1 == address.size()) {
    return absl::InvalidArgumentError("--metrics: must be HOST:PORT");
  }
  absl::string_view host = address.substr(0, colon);
  if (absl::ConsumePrefix(&host, "[")) absl::ConsumeSuffix(&host, "]");
  return HostAndPort{std::string(host), std::string(address.substr(colon + 1))};
}

// Returns a connected socket with timeouts.
absl::StatusOr<int> Connect(const HostAndPort& address, absl::Duration timeout) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(address.host.c_str(), address.port.c_str(), &hints, &found) != 0) {
    return absl::UnavailableError(absl::StrCat("--metrics: no such host as ", address.host));
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owner(found, &freeaddrinfo);
  const timeval limit = absl::ToTimeval(timeout);
  for (const addrinfo* a = found; a != nullptr; a = a->ai_next) {
    const int fd = socket(a->ai_family, a->ai_socktype | SOCK_CLOEXEC, a->ai_protocol);
    if (fd < 0) continue;
    setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
    if (connect(fd, a->ai_addr, a->ai_addrlen) == 0) return fd;
    close(fd);
  }
  return absl::UnavailableError("--metrics: the server does not answer");
}

}  // namespace

absl::StatusOr<ServerSample> ParseServerSample(absl::string_view text) {
  const std::vector<absl::string_view> lines = absl::StrSplit(text, '\n');
  ServerSample sample;
  HYPERMAP_ASSIGN_OR_RETURN(sample.started_s, ValueOf(lines, "process_start_time_seconds"));
  HYPERMAP_ASSIGN_OR_RETURN(sample.cpu_s, ValueOf(lines, "process_cpu_seconds_total"));
  HYPERMAP_ASSIGN_OR_RETURN(const double bytes, ValueOf(lines, "process_resident_memory_bytes"));
  HYPERMAP_ASSIGN_OR_RETURN(const double threads, ValueOf(lines, "process_threads"));
  HYPERMAP_ASSIGN_OR_RETURN(const double files, ValueOf(lines, "process_open_fds"));
  sample.resident_bytes = static_cast<int64_t>(bytes);
  sample.threads = static_cast<int64_t>(threads);
  sample.open_files = static_cast<int64_t>(files);
  return sample;
}

absl::StatusOr<std::string> GetMetrics(const std::string& address, absl::Duration timeout) {
  HYPERMAP_ASSIGN_OR_RETURN(const HostAndPort parsed, ParseAddress(address));
  const Deadline deadline(timeout);
  HYPERMAP_ASSIGN_OR_RETURN(const int fd, Connect(parsed, timeout));
  const absl::Cleanup close_fd = [fd] { close(fd); };
  // HTTP/1.0: the server closes the connection after the answer, which has no chunks.
  const std::string request =
      absl::StrCat("GET /metrics HTTP/1.0\r\nHost: ", parsed.host, "\r\nConnection: close\r\n\r\n");
  if (send(fd, request.data(), request.size(), MSG_NOSIGNAL) !=
      static_cast<ssize_t>(request.size())) {
    return absl::UnavailableError("--metrics: the request could not be sent");
  }
  std::string answer;
  char piece[16384];
  ssize_t size = 0;
  while (!deadline.has_passed() && answer.size() < kMaxAnswerBytes &&
         (size = recv(fd, piece, sizeof piece, 0)) > 0) {
    answer.append(piece, static_cast<size_t>(size));
  }
  const size_t body = answer.find("\r\n\r\n");
  if (size != 0 || body == std::string::npos) {
    return absl::UnavailableError("--metrics: the answer is not complete");
  }
  if (!absl::StrContains(absl::string_view(answer).substr(0, answer.find('\r')), " 200")) {
    return absl::UnavailableError(absl::StrCat("--metrics: ", answer.substr(0, answer.find('\r'))));
  }
  return answer.substr(body + 4);
}

absl::StatusOr<ServerSample> GetServerSample(const std::string& address, absl::Duration timeout) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string text, GetMetrics(address, timeout));
  return ParseServerSample(text);
}

void ServerNumbers::Add(const ServerSample& sample, SteadyTime at) {
  if (num_samples == 0) {
    first = sample;
    first_at = at;
  } else if (sample.started_s > last.started_s + kStartJitter_s || sample.cpu_s < last.cpu_s) {
    ++num_restarts;
    cpu_s += sample.cpu_s;
  } else {
    cpu_s += sample.cpu_s - last.cpu_s;
  }
  ++num_samples;
  elapsed_s = absl::ToDoubleSeconds(at - first_at);
  last = sample;
  max_resident_bytes = std::max(max_resident_bytes, sample.resident_bytes);
  max_threads = std::max(max_threads, sample.threads);
  max_open_files = std::max(max_open_files, sample.open_files);
}

ServerSampler::ServerSampler(std::string address, absl::Duration interval)
    : address_(std::move(address)), interval_(interval) {}

ServerSampler::~ServerSampler() { Stop(); }

absl::Status ServerSampler::Start() {
  HYPERMAP_ASSIGN_OR_RETURN(thread_, StartThread("hm-load-metrics", [this] { Run(); }));
  return absl::OkStatus();
}

void ServerSampler::Stop() {
  if (!thread_.joinable()) return;
  {
    const MutexLock lock(&mutex_);
    stopped_ = true;
    stop_.NotifyAll();
  }
  thread_.join();
}

ServerNumbers ServerSampler::numbers() const {
  const MutexLock lock(&mutex_);
  return numbers_;
}

void ServerSampler::Run() {
  bool stopped = false;
  do {
    Sample();
    const Deadline deadline(interval_);
    const MutexLock lock(&mutex_);
    stopped = stopped_;
    while (!stopped_ && !deadline.has_passed()) stop_.WaitFor(&mutex_, deadline.left());
  } while (!stopped);
}

void ServerSampler::Sample() {
  const absl::StatusOr<ServerSample> sample = GetServerSample(address_, kTimeout);
  const MutexLock lock(&mutex_);
  if (sample.ok()) {
    numbers_.Add(*sample, SteadyTime::Now());
  } else {
    ++numbers_.num_failures;
  }
}

}  // namespace hypermap::bench
