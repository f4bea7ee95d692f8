// A gRPC server with no work behind it, on the same API as hypermapd, to measure the cost of the
// transport.
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <signal.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>

#include "absl/flags/flag.h"
#include "absl/flags/parse.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "tests/bench/server/floor.grpc.pb.h"

ABSL_FLAG(std::string, listen, "127.0.0.1:0", "HOST:PORT");

namespace hypermap::bench {
namespace {

// Number of points that objects cover in a batch of 256, at the density of the generated site.
constexpr int kHits = 51;

void Fill(int num_bytes, AnswerResponse* response) {
  response->mutable_bytes()->assign(static_cast<size_t>(std::max(0, num_bytes)), 'x');
}

class OneMessage : public grpc::ServerWriteReactor<AnswerResponse> {
 public:
  explicit OneMessage(int num_bytes) {
    Fill(num_bytes, &response_);
    StartWriteAndFinish(&response_, grpc::WriteOptions(), grpc::Status::OK);
  }
  void OnDone() override { delete this; }

 private:
  AnswerResponse response_;
};

class ColumnsStream : public grpc::ServerBidiReactor<ColumnsRequest, ColumnsResponse> {
 public:
  ColumnsStream() {
    for (int i = 0; i < kHits; ++i) {
      response_.add_points(i * 5);
      response_.add_object_ids(500'000 + i);
      response_.add_labels(i);
      response_.add_existences(0.9F);
    }
    StartRead(&request_);
  }
  void OnReadDone(bool ok) override {
    if (!ok) return Finish(grpc::Status::OK);
    StartWrite(&response_);
  }
  void OnWriteDone(bool ok) override {
    if (ok) StartRead(&request_);
  }
  void OnDone() override { delete this; }

 private:
  ColumnsRequest request_;
  ColumnsResponse response_;
};

class FanOutStream : public grpc::ServerWriteReactor<grpc::ByteBuffer> {
 public:
  FanOutStream(const FanOutRequest& request) : left_(request.num_messages()) {
    AnswerResponse response;
    Fill(request.num_bytes(), &response);
    const grpc::Slice slice(response.SerializeAsString());
    message_ = grpc::ByteBuffer(&slice, 1);
    OnWriteDone(true);
  }
  void OnWriteDone(bool ok) override {
    if (!ok || left_-- <= 0) return Finish(grpc::Status::OK);
    StartWrite(&message_);
  }
  void OnDone() override { delete this; }

 private:
  int64_t left_;
  grpc::ByteBuffer message_;
};

class Floor final
    : public FloorService::WithRawCallbackMethod_FanOut<FloorService::WithCallbackMethod_Columns<
          FloorService::WithCallbackMethod_StreamedAnswer<FloorService::WithCallbackMethod_Answer<
              FloorService::WithCallbackMethod_Empty<FloorService::Service>>>>> {
 public:
  grpc::ServerUnaryReactor* Empty(grpc::CallbackServerContext* context, const EmptyRequest*,
                                  EmptyResponse*) override {
    return Done(context);
  }
  grpc::ServerUnaryReactor* Answer(grpc::CallbackServerContext* context,
                                   const AnswerRequest* request,
                                   AnswerResponse* response) override {
    Fill(request->num_bytes(), response);
    return Done(context);
  }
  grpc::ServerWriteReactor<AnswerResponse>* StreamedAnswer(grpc::CallbackServerContext*,
                                                           const AnswerRequest* request) override {
    return new OneMessage(request->num_bytes());
  }
  grpc::ServerBidiReactor<ColumnsRequest, ColumnsResponse>* Columns(
      grpc::CallbackServerContext*) override {
    return new ColumnsStream();
  }
  grpc::ServerWriteReactor<grpc::ByteBuffer>* FanOut(grpc::CallbackServerContext*,
                                                     const grpc::ByteBuffer* bytes) override {
    FanOutRequest request;
    grpc::ByteBuffer copy = *bytes;
    grpc::SerializationTraits<FanOutRequest>::Deserialize(&copy, &request);
    return new FanOutStream(request);
  }

 private:
  static grpc::ServerUnaryReactor* Done(grpc::CallbackServerContext* context) {
    grpc::ServerUnaryReactor* const reactor = context->DefaultReactor();
    reactor->Finish(grpc::Status::OK);
    return reactor;
  }
};

int Serve() {
  Floor floor;
  const std::string listen = absl::GetFlag(FLAGS_listen);
  const std::string host = listen.substr(0, listen.rfind(':') + 1);
  int port = 0;
  grpc::ServerBuilder builder;
  builder.AddListeningPort(listen, grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&floor);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  if (!server || port == 0) {
    std::fprintf(stderr, "floor_server: cannot listen on %s\n", listen.c_str());
    return EXIT_FAILURE;
  }
  std::printf("floor_server ready on %s%d\n", host.c_str(), port);
  std::fflush(stdout);
  server->Wait();
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace hypermap::bench

int main(int argc, char** argv) {
  absl::ParseCommandLine(argc, argv);
  // Same setting as in hypermapd.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  return hypermap::bench::Serve();
}
