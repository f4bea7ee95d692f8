// Watches with `coalesce`, whose messages may contain those of several commits.
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/services/testing/test_server.h"
#include "server/watch/watch_tuning.h"

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;

class WatchCoalesceTest : public ::testing::Test {
 protected:
  WatchCoalesceTest() { server_.MakeMap("site", LayerOfCups("cups", 2)); }

  static v1::WatchRequest Request(Revision start, bool coalesce) {
    v1::WatchRequest request;
    request.mutable_scope()->set_map("site");
    request.set_start_revision(start);
    request.set_coalesce(coalesce);
    return request;
  }

  MapSession& session() { return **server_.site().Find("site"); }
  Revision PutCup(double x) {
    hypermap::PutObject put{"cups", {}, ""};
    put.object.label = "cup";
    put.object.shape = Polygon::FromBox({{x, 0}, {x + 1, 1}});
    const auto receipt = session().SubmitAndWait({{{std::move(put)}}, "test", ""});
    EXPECT_TRUE(receipt.ok()) << receipt.status();
    return receipt.ok() ? receipt->revision : 0;
  }

  // Reads the messages of a watch as they come, until they cover revision `until`.
  std::vector<v1::WatchResponse> Read(const v1::WatchRequest& request, Revision until) {
    grpc::ClientContext context;
    const auto reader = server_.watch->Watch(&context, request);
    std::vector<v1::WatchResponse> messages;
    for (Revision told = -1; told < until;) {
      v1::WatchResponse message;
      if (!reader->Read(&message)) {
        ADD_FAILURE() << reader->Finish().error_message();
        return messages;
      }
      told = message.coalesced().empty() ? message.revision()
                                         : message.coalesced().rbegin()->revision();
      messages.push_back(std::move(message));
    }
    context.TryCancel();
    reader->Finish();
    return messages;
  }

  TestServer server_;
};

// The bytes of each message with changes, coalesced messages taken apart.
std::vector<std::string> Single(const std::vector<v1::WatchResponse>& messages) {
  std::vector<std::string> single;
  const auto take = [&](const v1::WatchResponse& message) {
    if (message.changes_size() > 0) single.push_back(message.SerializeAsString());
  };
  for (const v1::WatchResponse& message : messages) {
    take(message);
    for (const v1::WatchResponse& one : message.coalesced()) take(one);
  }
  return single;
}

TEST_F(WatchCoalesceTest, MessagesComeTogetherWhereThatWasAskedFor) {
  Revision newest = 1;
  for (int i = 0; i < 600; ++i) newest = PutCup(i);
  const auto single = Read(Request(1, false), newest);
  const auto coalesced = Read(Request(1, true), newest);
  EXPECT_GE(single.size(), 600u);
  EXPECT_LT(coalesced.size(), 10u);
  EXPECT_EQ(Single(single), Single(coalesced));
  for (const v1::WatchResponse& message : single) EXPECT_EQ(message.coalesced_size(), 0);
  for (const v1::WatchResponse& message : coalesced) {
    EXPECT_LE(static_cast<size_t>(message.coalesced_size()), WatchTuning().max_coalesced_messages);
    if (message.coalesced().empty()) continue;
    EXPECT_EQ(message.revision(), 0);
    EXPECT_EQ(message.changes_size(), 0);
    EXPECT_FALSE(message.has_time());
  }
}

TEST_F(WatchCoalesceTest, AChangeOfAQuietMapIsAMessage) {
  grpc::ClientContext context;
  const auto reader = server_.watch->Watch(&context, Request(1, true));
  v1::WatchResponse message;
  for (int i = 0; i < 5; ++i) {
    const Revision revision = PutCup(i);
    do {
      ASSERT_TRUE(reader->Read(&message));
    } while (message.changes_size() == 0);
    EXPECT_EQ(message.revision(), revision);
    EXPECT_EQ(message.coalesced_size(), 0);
  }
  context.TryCancel();
  reader->Finish();
}

TEST_F(WatchCoalesceTest, ManyWatchesOfABusyMapAreToldAlike) {
  constexpr int kWatches = 12;
  constexpr int kWriters = 3;
  constexpr int kEdits = 400;
  std::vector<std::thread> threads;
  std::vector<std::vector<std::string>> told(kWatches);
  for (int i = 0; i < kWatches; ++i) {
    threads.emplace_back([&, i] {
      // Each watch is ended several times, and resumes from the last revision that it got.
      for (Revision at = 1; at < 1 + kWriters * kEdits;) {
        const Revision until = std::min<Revision>(at + 100 + 37 * i, 1 + kWriters * kEdits);
        const auto messages = Read(Request(at, i % 2 == 0), until);
        ASSERT_FALSE(messages.empty());
        for (std::string& single : Single(messages)) told[i].push_back(std::move(single));
        const v1::WatchResponse& last = messages.back();
        at = last.coalesced().empty() ? last.revision() : last.coalesced().rbegin()->revision();
      }
    });
  }
  for (int i = 0; i < kWriters; ++i) {
    threads.emplace_back([&] {
      for (int edit = 0; edit < kEdits; ++edit) PutCup(edit);
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(told[0].size(), static_cast<size_t>(kWriters * kEdits));
  for (const auto& one : told) EXPECT_EQ(one, told[0]);
}

TEST_F(WatchCoalesceTest, AWatchThatGathersIsEndedLikeAnyOther) {
  grpc::ClientContext cancelled_context, closed_context;
  const auto cancelled = server_.watch->Watch(&cancelled_context, Request(1, true));
  const auto closed = server_.watch->Watch(&closed_context, Request(1, true));
  std::atomic<bool> done = false;
  Revision newest = 1;
  std::thread writer([&] {
    for (int i = 0; !done; ++i) newest = PutCup(i);
  });
  v1::WatchResponse message;
  Revision told = 1;
  const auto told_by = [](const v1::WatchResponse& m) {
    return m.coalesced().empty() ? m.revision() : m.coalesced().rbegin()->revision();
  };
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(cancelled->Read(&message));
    ASSERT_TRUE(closed->Read(&message));
    told = told_by(message);
  }
  cancelled_context.TryCancel();
  while (cancelled->Read(&message)) {
  }
  EXPECT_EQ(cancelled->Finish().error_code(), grpc::StatusCode::CANCELLED);
  session().feed().Close();
  while (closed->Read(&message)) told = told_by(message);
  const grpc::Status status = closed->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(status.error_message(), HasSubstr(absl::StrCat("resume from revision ", told)));
  done = true;
  writer.join();
}

TEST_F(WatchCoalesceTest, BytesThatAreNoRequestAreRefused) {
  const grpc::Slice slice(std::string("\x0a\xff"));
  const grpc::ByteBuffer request(&slice, 1);
  grpc::ByteBuffer response;
  grpc::ClientContext context;
  // Shared, because the waiting thread may go on before set_value has returned.
  const auto answered = std::make_shared<std::promise<grpc::Status>>();
  grpc::GenericStub(server_.channel())
      .UnaryCall(&context, "/hypermap.v1.WatchService/Watch", {}, &request, &response,
                 [answered](grpc::Status status) { answered->set_value(std::move(status)); });
  const grpc::Status status = answered->get_future().get();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("WatchRequest"));
}

}  // namespace
}  // namespace hypermap::server
