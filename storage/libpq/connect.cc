#include "storage/libpq/connect.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "base/sync/deadline.h"
#include "storage/libpq/errors.h"
#include "storage/libpq/poll_interval.h"

namespace hypermap::storage::postgres {
namespace {

// Settings of the sessions that are one's own, in the order: a transaction that nobody goes on with
// ends; so does one whose client's machine or network is gone, whether the server waits for a
// statement, sends an answer, or is at work; statements of maps are too short for compiling to pay,
// and for planning them anew for each array of keys; and a plan that is kept would read all of a
// table that was small when it was made.
constexpr char kSettings[] =
    "-c idle_in_transaction_session_timeout=10s"
    " -c tcp_keepalives_idle=5 -c tcp_keepalives_interval=2 -c tcp_keepalives_count=3"
    " -c tcp_user_timeout=10s"
    " -c client_connection_check_interval=2s"
    " -c jit=off -c plan_cache_mode=force_generic_plan -c enable_seqscan=off";

struct FreeOptions {
  void operator()(PQconninfoOption* options) const { PQconninfoFree(options); }
};
using ParsedTarget = std::unique_ptr<PQconninfoOption, FreeOptions>;

// The value that the target gives to a keyword; empty if it gives none.
std::string ValueOf(const ParsedTarget& target, absl::string_view keyword) {
  for (const PQconninfoOption* option = target.get(); option->keyword != nullptr; ++option) {
    if (keyword == option->keyword) return option->val == nullptr ? "" : option->val;
  }
  return "";
}

struct Keyword {
  const char* name;
  std::string value;
};

// Hosts of a target that libpq tries in one attempt.
struct Attempt {
  int num_hosts = 1;
  std::vector<Keyword> host;  // in place of the target's hosts; empty: all of them
};

// The elements that are separated by commas.
std::vector<std::string> ListOf(const ParsedTarget& target, absl::string_view keyword) {
  const std::string value = ValueOf(target, keyword);
  if (value.empty()) return {};
  return absl::StrSplit(value, ',');
}

// An attempt for each host: libpq itself goes on with the next one if a host can't be reached, but
// not if the connection is taken and then ended or never answered, as by a proxy whose database has
// died, or by a machine that hangs.
std::vector<Attempt> AttemptsOf(const ParsedTarget& target) {
  const std::vector<std::string> hosts = ListOf(target, "host");
  const std::vector<std::string> addresses = ListOf(target, "hostaddr");
  const std::vector<std::string> ports = ListOf(target, "port");
  const size_t num = std::max({hosts.size(), addresses.size(), size_t{1}});
  const bool fit = (hosts.size() == num || hosts.empty()) &&
                   (addresses.size() == num || addresses.empty()) &&
                   (ports.size() == num || ports.size() <= 1);
  // libpq refuses lists that don't fit, and asks all hosts for a standby before it takes the
  // primary.
  if (num == 1 || !fit || ValueOf(target, "target_session_attrs") == "prefer-standby") {
    return {{static_cast<int>(num), {}}};
  }
  std::vector<Attempt> attempts(num);
  for (size_t i = 0; i < num; ++i) {
    if (!hosts.empty()) attempts[i].host.push_back({"host", hosts[i]});
    if (!addresses.empty()) attempts[i].host.push_back({"hostaddr", addresses[i]});
    if (!ports.empty()) attempts[i].host.push_back({"port", ports[ports.size() == 1 ? 0 : i]});
  }
  return attempts;
}

// The keywords of a connection, of which libpq takes the last one of each name: those before dbname
// are defaults, which the target may set otherwise.
std::vector<Keyword> KeywordsOf(const ConnectOptions& options, const ParsedTarget& target,
                                const Attempt& attempt) {
  std::vector<Keyword> keywords = {
      {"application_name", options.application_name},
      {"keepalives_idle", "5"},
      {"keepalives_interval", "2"},
      {"keepalives_count", "3"},
      // Also bounds the wait for a host that does not answer, so that the next one is tried.
      {"tcp_user_timeout", absl::StrCat(absl::ToInt64Milliseconds(options.connect_timeout))},
      {"dbname", options.target},
      {"client_encoding", "UTF8"},
  };
  if (options.prepares) {
    keywords.push_back({"options", absl::StrCat(ValueOf(target, "options"), " ", kSettings)});
  }
  keywords.insert(keywords.end(), attempt.host.begin(), attempt.host.end());
  return keywords;
}

Handle StartConnecting(const std::vector<Keyword>& keywords) {
  std::vector<const char*> names, values;
  for (const Keyword& keyword : keywords) {
    names.push_back(keyword.name);
    values.push_back(keyword.value.c_str());
  }
  names.push_back(nullptr);
  values.push_back(nullptr);
  return Handle(PQconnectStartParams(names.data(), values.data(), /*expand_dbname=*/1));
}

// Verbose messages have the SQLSTATE between the severity and the text, as in "FATAL:  3D000: ". A
// failed connection has no result that would tell it otherwise.
std::string SqlStateIn(absl::string_view message) {
  constexpr size_t kLength = 5;
  for (size_t at = message.find(":  "); at != absl::string_view::npos;
       at = message.find(":  ", at + 1)) {
    const absl::string_view state = message.substr(at + 3, kLength);
    if (state.size() == kLength && absl::StartsWith(message.substr(at + 3 + kLength), ": ") &&
        std::all_of(state.begin(), state.end(), [](unsigned char c) {
          return absl::ascii_isdigit(c) || absl::ascii_isupper(c);
        })) {
      return std::string(state);
    }
  }
  return "";
}

// libpq's message for a failed connection has a line for each host, and more that starts with a tab
// or tells a place in PostgreSQL's sources.
std::string OneLine(absl::string_view message) {
  const std::vector<absl::string_view> lines =
      absl::StrSplit(message, '\n', [](absl::string_view line) {
        return !line.empty() && line[0] != '\t' && !absl::StartsWith(line, "LOCATION:");
      });
  return absl::StrJoin(lines, "; ");
}

absl::Status ConnectError(PGconn* handle) {
  const std::string message = OneLine(PQerrorMessage(handle));
  const std::string sqlstate = SqlStateIn(message);
  if (!sqlstate.empty()) return DatabaseError(sqlstate, message);
  // The password is missing on this side.
  if (PQconnectionNeedsPassword(handle) != 0) return absl::FailedPreconditionError(message);
  return absl::UnavailableError(message);
}

absl::Status FinishConnecting(PGconn* handle, absl::Duration timeout) {
  const Deadline deadline(timeout);
  PostgresPollingStatusType next = PGRES_POLLING_WRITING;
  while (next != PGRES_POLLING_OK) {
    if (next == PGRES_POLLING_FAILED) return ConnectError(handle);
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    if (deadline.has_passed()) {
      return absl::UnavailableError(
          absl::StrCat("the database did not answer within ", absl::FormatDuration(timeout)));
    }
    pollfd polled{PQsocket(handle),
                  static_cast<int16_t>(next == PGRES_POLLING_READING ? POLLIN : POLLOUT), 0};
    if (poll(&polled, 1, PollMilliseconds(deadline.left())) > 0) next = PQconnectPoll(handle);
  }
  return absl::OkStatus();
}

// From now on data may wait for as long as a statement may take: while a session is busy, it has no
// room for what a pipeline sends, and acknowledges nothing of it.
void AllowBusySessions(int socket, absl::Duration response_timeout) {
  const int64_t milliseconds = absl::ToInt64Milliseconds(response_timeout);
  const auto timeout =
      static_cast<unsigned>(std::clamp<int64_t>(milliseconds, 1, std::numeric_limits<int>::max()));
  // Sockets of another kind than TCP have no such limit.
  static_cast<void>(setsockopt(socket, IPPROTO_TCP, TCP_USER_TIMEOUT, &timeout, sizeof(timeout)));
}

absl::StatusOr<Handle> Try(const ConnectOptions& options, const ParsedTarget& target,
                           const Attempt& attempt) {
  Handle handle = StartConnecting(KeywordsOf(options, target, attempt));
  if (handle == nullptr) return absl::ResourceExhaustedError("no memory for a connection");
  // Notices would be printed.
  PQsetNoticeReceiver(
      handle.get(), [](void*, const PGresult*) {}, nullptr);
  if (PQstatus(handle.get()) == CONNECTION_BAD) return ConnectError(handle.get());
  PQsetErrorVerbosity(handle.get(), PQERRORS_VERBOSE);
  HYPERMAP_RETURN_IF_ERROR(
      FinishConnecting(handle.get(), options.connect_timeout * attempt.num_hosts));
  PQsetErrorVerbosity(handle.get(), PQERRORS_DEFAULT);
  if (PQsetnonblocking(handle.get(), 1) != 0) return ConnectError(handle.get());
  AllowBusySessions(PQsocket(handle.get()), options.response_timeout);
  return handle;
}

// What no host answered: UNAVAILABLE if any of them may answer otherwise later.
absl::Status Together(const absl::Status& before, const absl::Status& more) {
  if (before.ok()) return more;
  if (!absl::IsUnavailable(before) && !absl::IsUnavailable(more)) return before;
  return absl::UnavailableError(absl::StrCat(before.message(), "; ", more.message()));
}

}  // namespace

absl::StatusOr<Handle> Connect(const ConnectOptions& options) {
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  const ParsedTarget target(PQconninfoParse(options.target.c_str(), nullptr));
  // libpq's own message would repeat parts of the target, which may be the password.
  if (target == nullptr) {
    return absl::FailedPreconditionError("the target of the database is no connection string");
  }
  absl::Status error;
  for (const Attempt& attempt : AttemptsOf(target)) {
    absl::StatusOr<Handle> handle = Try(options, target, attempt);
    if (handle.ok()) return handle;
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    error = Together(error, handle.status());
  }
  return error;
}

}  // namespace hypermap::storage::postgres
