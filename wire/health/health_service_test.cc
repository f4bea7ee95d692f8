#include "wire/health/health_service.h"

#include <gmock/gmock.h>
#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/impl/client_unary_call.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/support/channel_arguments.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "tests/support/random_map.h"
#include "wire/health/messages.h"

namespace hypermap::health {
namespace {

using ::grpc::health::v1::HealthCheckRequest;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

constexpr char kQuery[] = "hypermap.v1.QueryService";
constexpr char kEdit[] = "hypermap.v1.EditService";
constexpr char kUnknown[] = "hypermap.v1.NoService";
constexpr ServingStatus kServing = HealthCheckResponse::SERVING;
constexpr ServingStatus kNotServing = HealthCheckResponse::NOT_SERVING;
constexpr ServingStatus kServiceUnknown = HealthCheckResponse::SERVICE_UNKNOWN;
constexpr absl::Duration kDeadline = absl::Seconds(60);

// The tickets of all calls of a server.
class Tickets {
 public:
  struct Counts {
    int open = 0;
    std::vector<absl::Status> ends;
  };

  reflection::Admit admit(const absl::Status& admitted = absl::OkStatus()) {
    return [this, admitted](auto*) { return std::make_unique<One>(this, admitted); };
  }

  Counts counts() {
    MutexLock lock(&mutex_);
    return counts_;
  }
  // Waits until the counts are as wanted.
  void WaitUntil(const std::function<bool(const Counts&)>& wanted) {
    MutexLock lock(&mutex_);
    const auto deadline = std::chrono::steady_clock::now() + absl::ToChronoSeconds(kDeadline);
    while (!wanted(counts_)) {
      ASSERT_LT(std::chrono::steady_clock::now(), deadline);
      changed_.WaitFor(&mutex_, absl::Seconds(1));
    }
  }
  void WaitUntilNoneIsOpen() {
    WaitUntil([](const Counts& counts) { return counts.open == 0; });
  }

 private:
  class One final : public reflection::Ticket {
   public:
    One(Tickets* all, absl::Status admitted) : all_(all), admitted_(std::move(admitted)) {
      all_->Change([](Counts& counts) { ++counts.open; });
    }
    ~One() override {
      all_->Change([](Counts& counts) { --counts.open; });
    }
    absl::Status admitted() const override { return admitted_; }
    absl::Status ChargeMemory(int64_t /*bytes*/) override { return absl::OkStatus(); }
    void FreeMemory(int64_t /*bytes*/) override {}
    grpc::Status Encode(const absl::Status& status) override {
      all_->Change([&](Counts& counts) { counts.ends.push_back(status); });
      return {static_cast<grpc::StatusCode>(status.raw_code()), std::string(status.message())};
    }

   private:
    Tickets* const all_;
    const absl::Status admitted_;
  };

  void Change(const std::function<void(Counts&)>& change) {
    MutexLock lock(&mutex_);
    change(counts_);
    changed_.NotifyAll();
  }

  Mutex mutex_;
  CondVar changed_;
  Counts counts_ ABSL_GUARDED_BY(mutex_);
};

class TestServer {
 public:
  explicit TestServer(reflection::Admit admit) : health_(std::move(admit)) {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    health_.RegisterWith(&builder);
    server_ = builder.BuildAndStart();
    channel_ = NewChannel({});
  }
  ~TestServer() {
    server_->Shutdown(std::chrono::system_clock::now());
    server_->Wait();
  }

  HealthService& health() { return health_; }
  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }
  // A channel with connections of its own.
  std::shared_ptr<grpc::Channel> NewChannel(grpc::ChannelArguments arguments) const {
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    return grpc::CreateCustomChannel(absl::StrCat("127.0.0.1:", port_),
                                     grpc::InsecureChannelCredentials(), arguments);
  }

 private:
  HealthService health_;
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
};

std::string RequestFor(const std::string& service) {
  HealthCheckRequest request;
  request.set_service(service);
  return request.SerializeAsString();
}

grpc::ByteBuffer Bytes(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return grpc::ByteBuffer(&slice, 1);
}

ServingStatus StatusIn(const grpc::ByteBuffer& bytes) {
  grpc::Slice slice;
  HealthCheckResponse response;
  EXPECT_TRUE(bytes.DumpToSingleSlice(&slice).ok());
  EXPECT_TRUE(response.ParseFromArray(slice.begin(), static_cast<int>(slice.size())));
  return response.status();
}

// Calls Check with these bytes as the request.
grpc::Status CheckBytes(TestServer& server, const std::string& bytes,
                        grpc::ByteBuffer* response = nullptr) {
  const grpc::internal::RpcMethod method("/grpc.health.v1.Health/Check",
                                         grpc::internal::RpcMethod::NORMAL_RPC);
  grpc::ClientContext context;
  grpc::ByteBuffer unused;
  return grpc::internal::BlockingUnaryCall<grpc::ByteBuffer, grpc::ByteBuffer>(
      server.channel().get(), method, &context, Bytes(bytes), response ? response : &unused);
}

ServingStatus Check(TestServer& server, const std::string& service) {
  grpc::ByteBuffer response;
  const grpc::Status status = CheckBytes(server, RequestFor(service), &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return status.ok() ? StatusIn(response) : HealthCheckResponse::UNKNOWN;
}

// A client's side of a Watch rpc.
class Watch {
 public:
  Watch(TestServer& server, const std::string& service)
      : Watch(server.channel(), RequestFor(service)) {}
  Watch(const std::shared_ptr<grpc::Channel>& channel, const std::string& request)
      : channel_(channel),
        stream_(grpc::internal::ClientReaderFactory<grpc::ByteBuffer>::Create(
            channel.get(),
            grpc::internal::RpcMethod("/grpc.health.v1.Health/Watch",
                                      grpc::internal::RpcMethod::SERVER_STREAMING),
            &context_, Bytes(request))) {}
  ~Watch() {
    if (!finished_) context_.TryCancel(), stream_->Finish();
  }

  // Waits until the server has begun to send the first status.
  void AwaitBegin() { stream_->WaitForInitialMetadata(); }
  std::optional<ServingStatus> Read() {
    grpc::ByteBuffer bytes;
    if (!stream_->Read(&bytes)) return std::nullopt;
    return StatusIn(bytes);
  }
  // Reads until the end.
  std::vector<ServingStatus> ReadAll() {
    std::vector<ServingStatus> all;
    while (const std::optional<ServingStatus> status = Read()) all.push_back(*status);
    return all;
  }
  void Cancel() { context_.TryCancel(); }
  // REQUIRES: all was read, or the watch was cancelled.
  grpc::Status Finish() {
    finished_ = true;
    return stream_->Finish();
  }

 private:
  const std::shared_ptr<grpc::Channel> channel_;
  grpc::ClientContext context_;
  const std::unique_ptr<grpc::ClientReader<grpc::ByteBuffer>> stream_;
  bool finished_ = false;
};

// Calls Watch with these bytes as the request, which are to be refused.
grpc::Status WatchBytes(TestServer& server, const std::string& bytes) {
  Watch watch(server.channel(), bytes);
  EXPECT_THAT(watch.ReadAll(), IsEmpty());
  return watch.Finish();
}

int NumThreads() {
  const std::filesystem::directory_iterator tasks("/proc/self/task");
  return static_cast<int>(std::distance(begin(tasks), end(tasks)));
}

class Health : public ::testing::Test {
 protected:
  Tickets tickets_;
};

TEST_F(Health, CheckTellsTheStatusOfTheServerAndOfEachService) {
  TestServer server(tickets_.admit());
  EXPECT_EQ(Check(server, ""), kServing);
  server.health().SetServingStatus(kQuery, true);
  server.health().SetServingStatus(kEdit, false);
  EXPECT_EQ(Check(server, kQuery), kServing);
  EXPECT_EQ(Check(server, kEdit), kNotServing);
  EXPECT_EQ(Check(server, ""), kServing);
  server.health().SetServingStatus(kQuery, false);
  server.health().SetServingStatus("", false);
  EXPECT_EQ(Check(server, kQuery), kNotServing);
  EXPECT_EQ(Check(server, ""), kNotServing);
}

TEST_F(Health, CheckOfAnUnknownServiceIsNotFound) {
  TestServer server(tickets_.admit());
  for (const std::string& service : {std::string(kUnknown), std::string(kMaxNameBytes, 'x')}) {
    EXPECT_EQ(CheckBytes(server, RequestFor(service)).error_code(), grpc::StatusCode::NOT_FOUND);
  }
  // A watch does not make it known.
  Watch watch(server, kUnknown);
  EXPECT_EQ(watch.Read(), kServiceUnknown);
  EXPECT_EQ(CheckBytes(server, RequestFor(kUnknown)).error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(Health, WatchTellsTheStatusNowAndItsChanges) {
  TestServer server(tickets_.admit());
  server.health().SetServingStatus(kQuery, false);
  Watch whole(server, "");
  Watch query(server, kQuery);
  EXPECT_EQ(whole.Read(), kServing);
  EXPECT_EQ(query.Read(), kNotServing);
  for (int i = 0; i < 100; ++i) {
    server.health().SetServingStatus(kQuery, true);
    EXPECT_EQ(query.Read(), kServing);
    server.health().SetServingStatus(kQuery, false);
    EXPECT_EQ(query.Read(), kNotServing);
  }
  server.health().SetServingStatus("", false);
  EXPECT_EQ(whole.Read(), kNotServing);
}

TEST_F(Health, WatchOfAnUnknownServiceGoesOnUntilItIsKnown) {
  TestServer server(tickets_.admit());
  Watch watch(server, kUnknown);
  EXPECT_EQ(watch.Read(), kServiceUnknown);
  {
    Watch other(server, kUnknown);
    EXPECT_EQ(other.Read(), kServiceUnknown);
  }
  tickets_.WaitUntil([](const auto& counts) { return counts.open == 1; });
  server.health().SetServingStatus(kUnknown, true);
  EXPECT_EQ(watch.Read(), kServing);
}

TEST_F(Health, SameStatusIsNotSentTwice) {
  TestServer server(tickets_.admit());
  Watch watch(server, "");
  EXPECT_EQ(watch.Read(), kServing);
  for (int i = 0; i < 10; ++i) server.health().SetServingStatus("", true);
  for (int i = 0; i < 10; ++i) server.health().SetServingStatus("", false);
  server.health().Stop();
  EXPECT_THAT(watch.ReadAll(), ElementsAre(kNotServing));
}

TEST_F(Health, RequestThatIsTooLargeIsRefusedUnparsed) {
  TestServer server(tickets_.admit());
  // These bytes are no request either, which is found only if they are parsed.
  const std::string parsed(kMaxRequestBytes, '\xff');
  EXPECT_EQ(CheckBytes(server, parsed).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(WatchBytes(server, parsed).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  for (const size_t size : {kMaxRequestBytes + 1, size_t{3} << 20}) {
    SCOPED_TRACE(size);
    const std::string bytes(size, '\xff');
    for (const grpc::Status& status : {CheckBytes(server, bytes), WatchBytes(server, bytes)}) {
      EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
      EXPECT_THAT(status.error_message(), HasSubstr(absl::StrCat(kMaxRequestBytes)));
    }
  }
}

TEST_F(Health, MalformedRequestsAreInvalid) {
  TestServer server(tickets_.admit());
  const std::string unknown_field("\x12\x01x");
  EXPECT_TRUE(CheckBytes(server, unknown_field).ok());
  for (const char* bytes : {"\x0a\x05x", "\xff\xff\xff", "\x0a\x01\xff"}) {
    SCOPED_TRACE(::testing::PrintToString(std::string(bytes)));
    for (const grpc::Status& status : {CheckBytes(server, bytes), WatchBytes(server, bytes)}) {
      EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
      EXPECT_THAT(status.error_message(), HasSubstr("HealthCheckRequest"));
    }
  }
}

TEST_F(Health, NameThatIsTooLongIsInvalid) {
  TestServer server(tickets_.admit());
  Watch longest(server, std::string(kMaxNameBytes, 'x'));
  EXPECT_EQ(longest.Read(), kServiceUnknown);
  const std::string bytes = RequestFor(std::string(kMaxNameBytes + 1, 'x'));
  for (const grpc::Status& status : {CheckBytes(server, bytes), WatchBytes(server, bytes)}) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(status.error_message(), HasSubstr(absl::StrCat(kMaxNameBytes)));
  }
}

TEST_F(Health, CallsThatAreNotAdmittedEndUnread) {
  TestServer server(tickets_.admit(absl::ResourceExhaustedError("--max_calls")));
  for (const std::string& bytes : {RequestFor(""), std::string("\xff\xff\xff")}) {
    for (const grpc::Status& status : {CheckBytes(server, bytes), WatchBytes(server, bytes)}) {
      EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
      EXPECT_EQ(status.error_message(), "--max_calls");
    }
  }
  tickets_.WaitUntilNoneIsOpen();
}

TEST_F(Health, EachCallHasATicketUntilItsEnd) {
  TestServer server(tickets_.admit());
  {
    Watch first(server, "");
    Watch second(server, kUnknown);
    EXPECT_EQ(first.Read(), kServing);
    EXPECT_EQ(second.Read(), kServiceUnknown);
    EXPECT_EQ(tickets_.counts().open, 2);
    EXPECT_EQ(Check(server, ""), kServing);
    EXPECT_THAT(tickets_.counts().ends, ElementsAre(absl::OkStatus()));
    tickets_.WaitUntil([](const auto& counts) { return counts.open == 2; });
  }
  tickets_.WaitUntilNoneIsOpen();
  EXPECT_THAT(tickets_.counts().ends, SizeIs(3));
}

// A channel on which one message of a stream can't be sent before the client reads.
std::shared_ptr<grpc::Channel> SlowChannel(const TestServer& server) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 5);
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  return server.NewChannel(arguments);
}

TEST_F(Health, WatchThatIsNotReadHoldsOneMessageAndTheNewestStatus) {
  TestServer server(tickets_.admit());
  Watch watch(SlowChannel(server), RequestFor(""));
  watch.AwaitBegin();
  Watch reader(server, "");
  EXPECT_EQ(reader.Read(), kServing);
  for (int i = 0; i < 1000; ++i) {
    const bool serving = i % 2 != 0;
    server.health().SetServingStatus("", serving);
    EXPECT_EQ(reader.Read(), serving ? kServing : kNotServing);
  }
  server.health().SetServingStatus("", false);
  server.health().Stop();
  EXPECT_THAT(watch.ReadAll(), ElementsAre(kServing, kNotServing));
  EXPECT_EQ(watch.Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(Health, WatchThatIsNotReadEndsWhenItIsCancelled) {
  TestServer server(tickets_.admit());
  Watch watch(SlowChannel(server), RequestFor(""));
  tickets_.WaitUntil([](const auto& counts) { return counts.open == 1; });
  server.health().SetServingStatus("", false);
  watch.Cancel();
  EXPECT_EQ(watch.Finish().error_code(), grpc::StatusCode::CANCELLED);
  tickets_.WaitUntilNoneIsOpen();
}

TEST_F(Health, OpenWatchesTakeNoThreads) {
  constexpr int kWatches = 500;
  TestServer server(tickets_.admit());
  std::vector<std::unique_ptr<Watch>> watches;
  const auto open = [&](int num) {
    for (int i = 0; i < num; ++i) {
      watches.push_back(std::make_unique<Watch>(server, ""));
      EXPECT_EQ(watches.back()->Read(), kServing);
    }
  };
  open(10);  // gRPC starts its own threads.
  const int before = NumThreads();
  open(kWatches);
  EXPECT_EQ(tickets_.counts().open, kWatches + 10);
  // gRPC may start some more, depending on the number of processors.
  EXPECT_LT(NumThreads(), before + kWatches / 5);
  server.health().SetServingStatus("", false);
  for (const auto& watch : watches) EXPECT_EQ(watch->Read(), kNotServing);
  EXPECT_LT(NumThreads(), before + kWatches / 5);
  watches.clear();
  tickets_.WaitUntilNoneIsOpen();
}

TEST_F(Health, CancelledWatchesEnd) {
  TestServer server(tickets_.admit());
  constexpr int kRounds = 20;
  for (int i = 0; i < kRounds; ++i) {
    Watch watch(server, i % 2 == 0 ? "" : kUnknown);
    EXPECT_TRUE(watch.Read().has_value());
    watch.Cancel();
    EXPECT_EQ(watch.Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  tickets_.WaitUntilNoneIsOpen();
  // The ticket is told, so that floods of cancelled calls can be counted.
  EXPECT_THAT(tickets_.counts().ends, SizeIs(kRounds));
  EXPECT_THAT(tickets_.counts().ends, Each(::testing::ResultOf(absl::IsCancelled, true)));
}

TEST_F(Health, ForgottenServiceIsUnknown) {
  TestServer server(tickets_.admit());
  server.health().Forget(kQuery);
  server.health().SetServingStatus(kQuery, true);
  Watch watch(server, kQuery);
  EXPECT_EQ(watch.Read(), kServing);
  server.health().Forget(kQuery);
  EXPECT_EQ(watch.Read(), kServiceUnknown);
  EXPECT_EQ(CheckBytes(server, RequestFor(kQuery)).error_code(), grpc::StatusCode::NOT_FOUND);
  server.health().SetServingStatus(kQuery, false);
  EXPECT_EQ(watch.Read(), kNotServing);
}

TEST_F(Health, StopTellsNotServingAndEndsWatches) {
  TestServer server(tickets_.admit());
  server.health().SetServingStatus(kQuery, true);
  server.health().SetServingStatus(kEdit, false);
  const struct {
    std::string service;
    ServingStatus before;
    std::vector<ServingStatus> then;
  } cases[] = {{"", kServing, {kNotServing}},
               {kQuery, kServing, {kNotServing}},
               {kEdit, kNotServing, {}},
               {kUnknown, kServiceUnknown, {}}};
  std::vector<std::unique_ptr<Watch>> watches;
  for (const auto& one : cases) {
    watches.push_back(std::make_unique<Watch>(server, one.service));
    EXPECT_EQ(watches.back()->Read(), one.before);
  }
  server.health().Stop();
  for (size_t i = 0; i < watches.size(); ++i) {
    SCOPED_TRACE(cases[i].service);
    EXPECT_EQ(watches[i]->ReadAll(), cases[i].then);
    EXPECT_EQ(watches[i]->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  }
  tickets_.WaitUntilNoneIsOpen();
}

TEST_F(Health, NothingIsServingAfterStop) {
  TestServer server(tickets_.admit());
  server.health().SetServingStatus(kQuery, true);
  server.health().Stop();
  server.health().SetServingStatus(kQuery, true);
  server.health().SetServingStatus(kEdit, true);
  server.health().Stop();
  for (const char* service : {"", kQuery, kEdit}) {
    SCOPED_TRACE(service);
    EXPECT_EQ(Check(server, service), kNotServing);
    Watch late(server, service);
    EXPECT_THAT(late.ReadAll(), ElementsAre(kNotServing));
    EXPECT_EQ(late.Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  }
  EXPECT_EQ(CheckBytes(server, RequestFor(kUnknown)).error_code(), grpc::StatusCode::NOT_FOUND);
  tickets_.WaitUntilNoneIsOpen();
}

TEST_F(Health, ClientsOfGrpcFollowTheHealthOfAService) {
  TestServer server(tickets_.admit());
  server.health().SetServingStatus(kQuery, true);
  grpc::ChannelArguments arguments;
  arguments.SetServiceConfigJSON(absl::StrCat(
      R"({"loadBalancingConfig": [{"round_robin": {}}], "healthCheckConfig": {"serviceName": ")",
      kQuery, "\"}}"));
  const std::shared_ptr<grpc::Channel> channel = server.NewChannel(arguments);
  const auto deadline = [] {
    return std::chrono::system_clock::now() + absl::ToChronoSeconds(kDeadline);
  };
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(channel->WaitForConnected(deadline()));
    server.health().SetServingStatus(kQuery, false);
    EXPECT_TRUE(channel->WaitForStateChange(GRPC_CHANNEL_READY, deadline()));
    server.health().SetServingStatus(kQuery, true);
  }
  EXPECT_TRUE(channel->WaitForConnected(deadline()));
}

// A watch that is read to its end tells no status twice in a row, and NOT_SERVING at last.
void ExpectToEndWithStop(Watch& watch) {
  const std::vector<ServingStatus> statuses = watch.ReadAll();
  EXPECT_EQ(std::adjacent_find(statuses.begin(), statuses.end()), statuses.end());
  ASSERT_THAT(statuses, Not(IsEmpty()));
  EXPECT_EQ(statuses.back(), kNotServing);
  EXPECT_EQ(watch.Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
}

// Opens watches, reads a few statuses of each, and cancels most. The others are read to their ends.
void WatchAtRandom(TestServer& server, uint64_t seed) {
  constexpr int kWatches = 200;
  hypermap::testing::Rng choices(seed);
  std::vector<std::unique_ptr<Watch>> kept;
  for (int i = 0; i < kWatches; ++i) {
    auto watch = std::make_unique<Watch>(server, choices() % 2 == 0 ? "" : kQuery);
    if (i % 20 == 0) {
      kept.push_back(std::move(watch));
      continue;
    }
    for (uint64_t reads = choices() % 3; reads > 0; --reads) watch->Read();
    watch->Cancel();
    watch->Finish();
  }
  for (const auto& watch : kept) ExpectToEndWithStop(*watch);
}

TEST_F(Health, WatchesThatBeginAndAreCancelledDuringChangesAndStopEnd) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(absl::StrCat("HYPERMAP_TEST_SEED=", seed));
  hypermap::testing::Rng rng(seed);
  TestServer server(tickets_.admit());
  server.health().SetServingStatus(kQuery, true);
  std::atomic<bool> done = false;
  std::vector<std::thread> changes;
  for (int i = 0; i < 2; ++i) {
    changes.emplace_back([&, seed_of_changes = rng()] {
      hypermap::testing::Rng choices(seed_of_changes);
      while (!done) {
        server.health().SetServingStatus(choices() % 2 == 0 ? "" : kQuery, choices() % 2 == 0);
        std::this_thread::yield();
      }
    });
  }
  std::vector<std::thread> clients;
  for (int i = 0; i < 4; ++i) {
    clients.emplace_back([&, seed_of_client = rng()] { WatchAtRandom(server, seed_of_client); });
  }
  tickets_.WaitUntil([](const auto& counts) { return counts.ends.size() > 100; });
  server.health().Stop();
  for (std::thread& client : clients) client.join();
  done = true;
  for (std::thread& change : changes) change.join();
  tickets_.WaitUntilNoneIsOpen();
}

}  // namespace
}  // namespace hypermap::health
