#include "base/admission/open_streams.h"

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/support/eventually.h"

namespace hypermap::admission {
namespace {

// Receives nothing, and counts the end of the call.
class Quiet final : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  explicit Quiet(std::atomic<int>* num_done) : num_done_(num_done) {}
  void OnDone(const grpc::Status& /*status*/) override { ++*num_done_; }

 private:
  std::atomic<int>* const num_done_;
};

class NeverAnswers final : public grpc::CallbackGenericService {
  class Reactor final : public grpc::ServerGenericBidiReactor {
    void OnCancel() override { Finish(grpc::Status::CANCELLED); }
    void OnDone() override { delete this; }
  };
  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext*) override {
    return new Reactor;
  }
};

// Returns the number of streams of each connection that has some.
std::vector<int64_t> OpenStreams() {
  std::vector<int64_t> nums;
  for (const auto& [peer, num] : CountOpenStreams()) {
    if (num != 0) nums.push_back(num);
  }
  return nums;
}

bool Eventually(const std::vector<int64_t>& nums) {
  return testing::Eventually([&] { return OpenStreams() == nums; });
}

TEST(OpenStreamsTest, CallsThatSentOnlyTheirHeadersAreCountedUntilTheyEnd) {
  NeverAnswers service;
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterCallbackGenericService(&service);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  ASSERT_NE(server, nullptr);
  grpc::GenericStub stub(
      grpc::CreateChannel(absl::StrCat("127.0.0.1:", port), grpc::InsecureChannelCredentials()));
  EXPECT_TRUE(Eventually({}));
  std::deque<grpc::ClientContext> contexts;
  std::atomic<int> num_done = 0;
  std::deque<Quiet> calls;
  for (int i = 0; i < 7; ++i) {
    stub.PrepareBidiStreamingCall(&contexts.emplace_back(), "/a/b", {},
                                  &calls.emplace_back(&num_done));
    calls.back().StartCall();
  }
  EXPECT_TRUE(Eventually({7}));
  contexts.front().TryCancel();
  EXPECT_TRUE(Eventually({6}));
  for (grpc::ClientContext& context : contexts) context.TryCancel();
  EXPECT_TRUE(Eventually({}));
  // gRPC uses the reactors until they are done.
  EXPECT_TRUE(testing::Eventually([&] { return num_done == 7; }));
  server->Shutdown();
}

}  // namespace
}  // namespace hypermap::admission
