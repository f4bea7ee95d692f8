// The parts of a streaming rpc. Only for the sources of this folder.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_GRPC_SOURCE_H_
#define HYPERMAP_CLIENT_LIBS_CPP_GRPC_SOURCE_H_

#include <grpcpp/grpcpp.h>

#include <memory>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client_libs/cpp/connection.h"
#include "client_libs/cpp/readers.h"
#include "wire/status.h"

namespace hypermap::client {

// Decodes each Message of a call into a Part. Keeps the connection alive.
template <typename Message, typename Part>
class GrpcSource : public PartSource<Part> {
 public:
  using Decode = absl::StatusOr<Part> (*)(Message message);

  GrpcSource(std::shared_ptr<Connection> connection, std::unique_ptr<grpc::ClientContext> context,
             std::unique_ptr<grpc::ClientReader<Message>> reader, Decode decode)
      : connection_(std::move(connection)),
        context_(std::move(context)),
        reader_(std::move(reader)),
        decode_(decode) {}

  ~GrpcSource() override {
    if (!finished_) Cancel();
  }

  std::optional<Part> Next() override {
    if (finished_) return std::nullopt;
    Message message;
    if (!reader_->Read(&message)) {
      Finish();
      return std::nullopt;
    }
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
  void Finish() {
    status_ = wire::DecodeStatus(reader_->Finish());
    finished_ = true;
  }

  // Tells the server to stop; what it had sent is dropped.
  void Cancel() {
    context_->TryCancel();
    Message ignored;
    while (reader_->Read(&ignored)) {
    }
    Finish();
  }

  std::shared_ptr<Connection> connection_;
  std::unique_ptr<grpc::ClientContext> context_;
  std::unique_ptr<grpc::ClientReader<Message>> reader_;
  Decode decode_;
  bool finished_ = false;
  absl::Status status_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_GRPC_SOURCE_H_
