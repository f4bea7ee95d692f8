// Parts of a server-streaming rpc. Only for the sources of this folder.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_GRPC_PART_STREAM_H_
#define HYPERMAP_CLIENT_LIBS_CPP_GRPC_PART_STREAM_H_

#include <grpcpp/grpcpp.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/sync/deadline.h"
#include "client_libs/cpp/connection.h"
#include "client_libs/cpp/readers.h"
#include "wire/status.h"

namespace hypermap::client {

// Type of a stub's method for a server-streaming rpc.
template <typename Stub, typename Request, typename Message>
using OpenStream = std::unique_ptr<grpc::ClientReader<Message>> (Stub::*)(grpc::ClientContext*,
                                                                          const Request&);

// Decodes each Message of a call into a Part. The call is retried while it has returned no message.
// Keeps the connection alive.
template <typename Message, typename Part>
class GrpcPartStream : public PartStream<Part> {
 public:
  using Open = std::function<std::unique_ptr<grpc::ClientReader<Message>>(
      Server& server, grpc::ClientContext* context)>;
  using Decode = absl::StatusOr<Part> (*)(Message&& message);

  // `map` is the one that the request is about.
  GrpcPartStream(std::shared_ptr<Connection> connection, std::string map, Open open,
                 const CallOptions& options, Decode decode)
      : connection_(std::move(connection)),
        map_(std::move(map)),
        open_(std::move(open)),
        deadline_(connection_->DeadlineOf(options)),
        retries_(connection_->RetriesOf(options, deadline_)),
        decode_(decode) {
    OpenCall();
  }

  ~GrpcPartStream() override {
    if (!finished_) Cancel();
  }

  std::optional<Part> Next() override {
    if (finished_) return std::nullopt;
    Message message;
    while (!reader_->Read(&message)) {
      const grpc::Status status = reader_->Finish();
      if (begun_ || !retries_.ShallTryAgain(*server_, status, *context_)) {
        Finish(status);
        return std::nullopt;
      }
      OpenCall();
    }
    begun_ = true;
    connection_->Note(map_, message);
    absl::StatusOr<Part> part = decode_(std::move(message));
    if (!part.ok()) {
      Cancel();
      status_ = BadAnswer(part.status());
      return std::nullopt;
    }
    return *std::move(part);
  }

  const absl::Status& status() const override { return status_; }

 private:
  void OpenCall() {
    reader_.reset();
    server_ = &connection_->servers().current();
    context_ = Connection::NewContext(deadline_);
    reader_ = open_(*server_, context_.get());
  }

  void Finish(const grpc::Status& status) {
    connection_->servers().NoteEnd(*server_, status);
    status_ = wire::DecodeStatus(NamedStatus(status, *context_));
    finished_ = true;
  }

  // Tells the server to stop, and drops the messages that have arrived.
  void Cancel() {
    context_->TryCancel();
    Message ignored;
    while (reader_->Read(&ignored)) {
    }
    Finish(reader_->Finish());
  }

  std::shared_ptr<Connection> connection_;
  const std::string map_;
  const Open open_;
  const Deadline deadline_;
  Retries retries_;
  Server* server_ = nullptr;  // of the call
  std::unique_ptr<grpc::ClientContext> context_;
  std::unique_ptr<grpc::ClientReader<Message>> reader_;
  Decode decode_;
  bool begun_ = false;
  bool finished_ = false;
  absl::Status status_;
};

template <typename Stub, typename Request, typename Message, typename Part>
std::unique_ptr<PartStream<Part>> MakeGrpcPartStream(
    std::shared_ptr<Connection> connection, OpenStream<Stub, Request, Message> open,
    Request request, const CallOptions& options,
    absl::StatusOr<Part> (*decode)(Message&& message)) {
  std::string map = MapOf(request);
  return std::make_unique<GrpcPartStream<Message, Part>>(
      std::move(connection), std::move(map),
      [open, request = std::move(request)](Server& server, grpc::ClientContext* context) {
        return (server.stub<Stub>().*open)(context, request);
      },
      options, decode);
}

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_GRPC_PART_STREAM_H_
