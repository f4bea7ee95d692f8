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
// statement, sends an answer, or is at work; statements of maps are too short for compiling to pay.
constexpr char kSettings[] =
    "-c idle_in_transaction_session_timeout=10s"
    " -c tcp_keepalives_idle=5 -c tcp_keepalives_interval=2 -c tcp_keepalives_count=3"
    " -c tcp_user_timeout=10s"
    " -c client_connection_check_interval=2s"
    " -c jit=off";

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

// The hosts of the target, which are separated by commas.
int CountHosts(const ParsedTarget& target) {
  const std::string addresses = ValueOf(target, "hostaddr");
  const std::string hosts = addresses.empty() ? ValueOf(target, "host") : addresses;
  return 1 + static_cast<int>(std::count(hosts.begin(), hosts.end(), ','));
}

struct Keyword {
  const char* name;
  std::string value;
};

// The keywords of a connection, of which libpq takes the last one of each name: those before dbname
// are defaults, which the target may set otherwise.
std::vector<Keyword> KeywordsOf(const ConnectOptions& options, const ParsedTarget& target) {
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

}  // namespace

absl::StatusOr<Handle> Connect(const ConnectOptions& options) {
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  const ParsedTarget target(PQconninfoParse(options.target.c_str(), nullptr));
  // libpq's own message would repeat parts of the target, which may be the password.
  if (target == nullptr) {
    return absl::FailedPreconditionError("the target of the database is no connection string");
  }
  Handle handle = StartConnecting(KeywordsOf(options, target));
  if (handle == nullptr) return absl::ResourceExhaustedError("no memory for a connection");
  // Notices would be printed.
  PQsetNoticeReceiver(
      handle.get(), [](void*, const PGresult*) {}, nullptr);
  if (PQstatus(handle.get()) == CONNECTION_BAD) return ConnectError(handle.get());
  PQsetErrorVerbosity(handle.get(), PQERRORS_VERBOSE);
  HYPERMAP_RETURN_IF_ERROR(
      FinishConnecting(handle.get(), options.connect_timeout * CountHosts(target)));
  PQsetErrorVerbosity(handle.get(), PQERRORS_DEFAULT);
  if (PQsetnonblocking(handle.get(), 1) != 0) return ConnectError(handle.get());
  AllowBusySessions(PQsocket(handle.get()), options.response_timeout);
  return handle;
}

}  // namespace hypermap::storage::postgres
