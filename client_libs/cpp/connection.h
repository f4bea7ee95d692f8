// The channel to a server, and what its calls share. Only for the sources of this folder.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_CONNECTION_H_
#define HYPERMAP_CLIENT_LIBS_CPP_CONNECTION_H_

#include <grpcpp/grpcpp.h>

#include <algorithm>
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
#include "hypermap/v1/access_service.grpc.pb.h"
#include "hypermap/v1/catalog_service.grpc.pb.h"
#include "hypermap/v1/edit_service.grpc.pb.h"
#include "hypermap/v1/exploration_service.grpc.pb.h"
#include "hypermap/v1/ingest_service.grpc.pb.h"
#include "hypermap/v1/query_service.grpc.pb.h"
#include "hypermap/v1/robot_service.grpc.pb.h"
#include "hypermap/v1/watch_service.grpc.pb.h"
#include "wire/status.h"

namespace hypermap::client {

// Decides about the retries of one call.
class Retries {
 public:
  // Allows retries for `retry_for` from now, at most until `deadline`.
  Retries(std::shared_ptr<grpc::Channel> channel, absl::Duration retry_for,
          const Deadline& deadline)
      : channel_(std::move(channel)), until_(std::min(retry_for, deadline.left())) {}

  // After an attempt that ended with `status`: waits and returns true if the call should be
  // retried.
  bool ShallTryAgain(const grpc::Status& status);
  // The same, also for a call that the server refused for the time being, of which `context` is the
  // context: waits as long as the server asks for.
  bool ShallTryAgain(const grpc::Status& status, const grpc::ClientContext& context);

 private:
  // Waits and returns true if there is time for that.
  bool Wait(absl::Duration pause);

  std::shared_ptr<grpc::Channel> channel_;
  Deadline until_;
  Backoff backoff_;
};

// The status of a call that has ended. If the server failed, its message ends with the name of the
// call in the server's log.
grpc::Status NamedStatus(const grpc::Status& status, const grpc::ClientContext& context);

// Thread safe.
class Connection {
 public:
  Connection(const std::string& target, const ClientOptions& options);

  v1::AccessService::Stub& access() { return *access_; }
  v1::CatalogService::Stub& catalog() { return *catalog_; }
  v1::QueryService::Stub& query() { return *query_; }
  v1::EditService::Stub& edit() { return *edit_; }
  v1::ExplorationService::Stub& exploration() { return *exploration_; }
  v1::IngestService::Stub& ingest() { return *ingest_; }
  v1::RobotService::Stub& robots() { return *robots_; }
  v1::WatchService::Stub& watch() { return *watch_; }

  const ClientOptions& options() const { return options_; }
  grpc::Channel& channel() { return *channel_; }

  // The deadline of a call that begins now. It covers all attempts of the call.
  Deadline DeadlineOf(const CallOptions& options) const;
  Retries RetriesOf(const CallOptions& options, const Deadline& deadline) const;
  // Makes the context of one attempt.
  static std::unique_ptr<grpc::ClientContext> NewContext(const Deadline& deadline);

  // Makes a unary call, with retries.
  template <typename Stub, typename Request, typename Response>
  absl::StatusOr<Response> Call(Stub& stub,
                                grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&,
                                                             Response*),
                                const Request& request, const CallOptions& options) const {
    const Deadline deadline = DeadlineOf(options);
    Retries retries = RetriesOf(options, deadline);
    while (true) {
      const std::unique_ptr<grpc::ClientContext> context = NewContext(deadline);
      Response response;
      const grpc::Status status = (stub.*method)(context.get(), request, &response);
      if (status.ok()) return response;
      if (!retries.ShallTryAgain(status, *context)) {
        return wire::DecodeStatus(NamedStatus(status, *context));
      }
    }
  }

 private:
  ClientOptions options_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::AccessService::Stub> access_;
  std::unique_ptr<v1::CatalogService::Stub> catalog_;
  std::unique_ptr<v1::QueryService::Stub> query_;
  std::unique_ptr<v1::EditService::Stub> edit_;
  std::unique_ptr<v1::ExplorationService::Stub> exploration_;
  std::unique_ptr<v1::IngestService::Stub> ingest_;
  std::unique_ptr<v1::RobotService::Stub> robots_;
  std::unique_ptr<v1::WatchService::Stub> watch_;
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
