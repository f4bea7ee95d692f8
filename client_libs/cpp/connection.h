// The servers of a client, and what its calls share. Only for the sources of this folder.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_CONNECTION_H_
#define HYPERMAP_CLIENT_LIBS_CPP_CONNECTION_H_

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "base/sync/deadline.h"
#include "client_libs/cpp/backoff.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/seen_revisions.h"
#include "client_libs/cpp/servers.h"
#include "wire/scope.h"
#include "wire/status.h"

namespace hypermap::client {

// Decides about the retries of one call. A retry goes to another server, if there is one.
class Retries {
 public:
  // Allows retries for `retry_for` from now, and until all servers have been tried, at most until
  // `deadline`.
  Retries(std::shared_ptr<Servers> servers, absl::Duration retry_for, const Deadline& deadline)
      : servers_(std::move(servers)),
        deadline_(deadline),
        until_(std::min(retry_for, deadline.left())),
        num_untried_(servers_->size() - 1) {}

  // After an attempt that ended with `status`, of which `context` is the context: waits and returns
  // true if the call should be retried. It should if `server` was UNAVAILABLE, or refused the call
  // for the time being; then waits as long as the server asks for.
  bool ShallTryAgain(const Server& server, const grpc::Status& status,
                     const grpc::ClientContext& context);

 private:
  // Waits and returns true if there is time for that until `end`.
  bool Wait(absl::Duration pause, const Deadline& end);

  std::shared_ptr<Servers> servers_;
  Deadline deadline_;
  Deadline until_;
  size_t num_untried_;
  Backoff backoff_;
};

// The status of a call that has ended. If the server failed, its message ends with the name of the
// call in the server's log.
grpc::Status NamedStatus(const grpc::Status& status, const grpc::ClientContext& context);

// The name of the map that a request is about; empty if it is about none.
template <typename Request>
std::string MapOf(const Request& request) {
  if constexpr (requires { request.scope(); }) {
    return request.scope().map();
  } else if constexpr (requires { request.map(); }) {
    return request.map();
  } else {
    return "";
  }
}

// Thread safe.
class Connection {
 public:
  Connection(const std::string& targets, const ClientOptions& options);

  const ClientOptions& options() const { return options_; }
  Servers& servers() const { return *servers_; }
  SeenRevisions& seen() { return seen_; }

  // The deadline of a call that begins now. It covers all attempts of the call.
  Deadline DeadlineOf(const CallOptions& options) const;
  Retries RetriesOf(const CallOptions& options, const Deadline& deadline) const;
  // Makes the context of one attempt.
  static std::unique_ptr<grpc::ClientContext> NewContext(const Deadline& deadline);

  // Makes attempts, which take a Server& and a grpc::ClientContext& and return a grpc::Status,
  // until one must not be followed by another.
  template <typename Attempt>
  absl::Status Retry(const CallOptions& options, Attempt attempt) const {
    const Deadline deadline = DeadlineOf(options);
    Retries retries = RetriesOf(options, deadline);
    while (true) {
      Server& server = servers_->current();
      const std::unique_ptr<grpc::ClientContext> context = NewContext(deadline);
      const grpc::Status status = attempt(server, *context);
      if (status.ok()) return absl::OkStatus();
      if (!retries.ShallTryAgain(server, status, *context)) {
        return wire::DecodeStatus(NamedStatus(status, *context));
      }
    }
  }

  // Makes a unary call, with retries.
  template <typename Stub, typename Request, typename Response>
  absl::StatusOr<Response> Call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&,
                                                             Response*),
                                const Request& request, const CallOptions& options) {
    const std::string map = MapOf(request);
    const SeenRevision seen = seen_.Find(map);
    Response response;
    absl::Status status = Retry(options, [&](Server& server, grpc::ClientContext& context) {
      response.Clear();
      const grpc::Status answered = (server.stub<Stub>().*method)(&context, request, &response);
      return answered.ok() ? CheckNotOutdated(seen, request, response) : answered;
    });
    if (!status.ok()) return status;
    Note(map, response);
    return response;
  }

  // Remembers the revision that an answer about the map names, if it names one.
  template <typename Response>
  void Note(const std::string& map, const Response& response) {
    seen_.Note(map, NewestIn(response));
  }

  // Writes the revision that a question about the map asks for, and the one that was seen.
  template <typename Question>
  void EncodeAsOf(const std::string& map, AsOf as_of, Question* question) const {
    const SeenRevision seen = seen_.Find(map);
    as_of.seen_revision = seen.revision;
    as_of.seen_incarnation = seen.incarnation;
    if (as_of != AsOf()) wire::EncodeAsOf(as_of, question->mutable_as_of());
  }

 private:
  // UNAVAILABLE, so that the call is repeated, if the answer to a question without as_of is of an
  // earlier revision than was seen before the call. (A mutation that is repeated gets its old
  // answer.)
  template <typename Request, typename Response>
  static grpc::Status CheckNotOutdated(const SeenRevision& seen, const Request& /*request*/,
                                       const Response& response) {
    if constexpr (
        !requires(Request r) { r.request_id(); } && !requires(Request r) { r.as_of(); }) {
      const SeenRevision newest = NewestIn(response);
      if (newest.IsBefore(seen)) {
        return {grpc::StatusCode::UNAVAILABLE,
                absl::StrCat("the server has the map at revision ", newest.revision,
                             ", the client has seen ", seen.revision)};
      }
    }
    return grpc::Status::OK;
  }

  ClientOptions options_;
  std::shared_ptr<Servers> servers_;
  SeenRevisions seen_;
};

// The request id of a mutation: the caller's, or a new one.
inline std::string RequestIdOf(const CallOptions& options) {
  return options.request_id.empty() ? NewRequestId() : options.request_id;
}

// The error for an answer whose decoding failed with `status`.
inline absl::Status BadAnswer(const absl::Status& status) {
  return absl::InternalError(absl::StrCat("the server's answer: ", status.message()));
}

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_CONNECTION_H_
