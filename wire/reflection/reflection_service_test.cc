#include "wire/reflection/reflection_service.h"

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/descriptor_database.h>
#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/impl/rpc_method.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/slice.h>
#include <grpcpp/support/sync_stream.h>
#include <gtest/gtest.h>

#include <algorithm>
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
#include "grpc/reflection/v1/reflection.pb.h"
#include "hypermap/v1/query_service.pb.h"
#include "tests/support/random_map.h"
#include "wire/reflection/reflection_call.h"

namespace hypermap::reflection {
namespace {

using ::google::protobuf::DescriptorPool;
using ::google::protobuf::FileDescriptorProto;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

constexpr char kQueryService[] = "hypermap.v1.QueryService";
constexpr char kQueryFile[] = "hypermap/v1/query_service.proto";
constexpr const char* kNames[] = {"grpc.reflection.v1.ServerReflection",
                                  "grpc.reflection.v1alpha.ServerReflection"};
constexpr size_t kMostBytes = ReflectionCall::kMaxRequestBytes;
constexpr absl::Duration kDeadline = absl::Seconds(60);

// The tickets of all streams of a server.
class Tickets {
 public:
  struct Counts {
    int open = 0;
    int64_t bytes = 0;
    int64_t most_bytes = 0;
    std::vector<absl::Status> ends;
  };

  Admit admit(absl::Status admitted = absl::OkStatus(), int64_t most_bytes_of_stream = 1 << 20) {
    return [this, admitted = std::move(admitted), most_bytes_of_stream](auto*) {
      return std::make_unique<One>(this, admitted, most_bytes_of_stream);
    };
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
  class One final : public Ticket {
   public:
    One(Tickets* all, absl::Status admitted, int64_t most_bytes)
        : all_(all), admitted_(std::move(admitted)), most_bytes_(most_bytes) {
      all_->Change([](Counts& counts) { ++counts.open; });
    }
    ~One() override {
      all_->Change([](Counts& counts) { --counts.open; });
    }
    absl::Status admitted() const override { return admitted_; }
    absl::Status ChargeMemory(int64_t bytes) override {
      if (bytes > most_bytes_) return absl::ResourceExhaustedError("--max_request_bytes");
      all_->Change([&](Counts& counts) {
        counts.bytes += bytes;
        counts.most_bytes = std::max(counts.most_bytes, counts.bytes);
      });
      return absl::OkStatus();
    }
    void FreeMemory(int64_t bytes) override {
      all_->Change([&](Counts& counts) { counts.bytes -= bytes; });
    }
    grpc::Status Encode(const absl::Status& status) override {
      all_->Change([&](Counts& counts) { counts.ends.push_back(status); });
      return {static_cast<grpc::StatusCode>(status.raw_code()), std::string(status.message())};
    }

   private:
    Tickets* const all_;
    const absl::Status admitted_;
    const int64_t most_bytes_;
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
  explicit TestServer(Admit admit) : reflection_({kQueryService}, std::move(admit)) {
    // A file is described only if it is linked in, which this reference ensures.
    ::hypermap::v1::QueryPointRequest::descriptor();
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    reflection_.RegisterWith(&builder);
    server_ = builder.BuildAndStart();
    channel_ =
        grpc::CreateChannel(absl::StrCat("127.0.0.1:", port), grpc::InsecureChannelCredentials());
  }
  ~TestServer() {
    server_->Shutdown(std::chrono::system_clock::now());
    server_->Wait();
  }

  ReflectionService& reflection() { return reflection_; }
  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }

 private:
  ReflectionService reflection_;
  std::unique_ptr<grpc::Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
};

// A client's side of a stream, of either version.
class Stream {
 public:
  explicit Stream(TestServer& server) : Stream(server, kNames[0]) {}
  Stream(TestServer& server, const std::string& service)
      : method_(absl::StrCat("/", service, "/ServerReflectionInfo")),
        stream_(Open(server.channel().get())) {}
  ~Stream() {
    if (!finished_) context_.TryCancel(), stream_->Finish();
  }

  bool WriteBytes(const std::string& bytes) {
    const grpc::Slice slice(bytes);
    return stream_->Write(grpc::ByteBuffer(&slice, 1));
  }
  bool Write(const v1::ServerReflectionRequest& request) {
    return WriteBytes(request.SerializeAsString());
  }
  std::optional<v1::ServerReflectionResponse> Read() {
    grpc::ByteBuffer bytes;
    grpc::Slice slice;
    v1::ServerReflectionResponse response;
    if (!stream_->Read(&bytes) || !bytes.DumpToSingleSlice(&slice).ok()) return std::nullopt;
    EXPECT_TRUE(response.ParseFromArray(slice.begin(), static_cast<int>(slice.size())));
    return response;
  }
  v1::ServerReflectionResponse Ask(const v1::ServerReflectionRequest& request) {
    Write(request);
    const std::optional<v1::ServerReflectionResponse> response = Read();
    EXPECT_TRUE(response.has_value());
    return response.value_or(v1::ServerReflectionResponse());
  }
  void WritesDone() { stream_->WritesDone(); }
  void Cancel() { context_.TryCancel(); }
  // Reads the remaining answers.
  grpc::Status Finish() {
    while (Read()) {
    }
    finished_ = true;
    return stream_->Finish();
  }

 private:
  using Bytes = grpc::ByteBuffer;

  std::unique_ptr<grpc::ClientReaderWriter<Bytes, Bytes>> Open(grpc::Channel* channel) {
    context_.set_deadline(std::chrono::system_clock::now() + absl::ToChronoSeconds(kDeadline));
    const grpc::internal::RpcMethod method(method_.c_str(),
                                           grpc::internal::RpcMethod::BIDI_STREAMING);
    return std::unique_ptr<grpc::ClientReaderWriter<Bytes, Bytes>>(
        grpc::internal::ClientReaderWriterFactory<Bytes, Bytes>::Create(channel, method,
                                                                        &context_));
  }

  const std::string method_;
  grpc::ClientContext context_;
  const std::unique_ptr<grpc::ClientReaderWriter<Bytes, Bytes>> stream_;
  bool finished_ = false;
};

v1::ServerReflectionRequest ListServices() {
  v1::ServerReflectionRequest request;
  request.set_list_services("*");
  return request;
}

v1::ServerReflectionRequest Symbol(const std::string& name) {
  v1::ServerReflectionRequest request;
  request.set_host("robot.local");
  request.set_file_containing_symbol(name);
  return request;
}

v1::ServerReflectionRequest FileNamed(const std::string& name) {
  v1::ServerReflectionRequest request;
  request.set_file_by_filename(name);
  return request;
}

v1::ServerReflectionRequest Extension(const std::string& type, int number) {
  v1::ServerReflectionRequest request;
  request.mutable_file_containing_extension()->set_containing_type(type);
  request.mutable_file_containing_extension()->set_extension_number(number);
  return request;
}

v1::ServerReflectionRequest ExtensionNumbers(const std::string& type) {
  v1::ServerReflectionRequest request;
  request.set_all_extension_numbers_of_type(type);
  return request;
}

// A request for an unknown symbol, of this many bytes: at least 16 KiB + 4.
v1::ServerReflectionRequest RequestOfSize(size_t size) {
  v1::ServerReflectionRequest request;
  request.set_file_containing_symbol(std::string(size - 4, 'x'));
  EXPECT_EQ(request.ByteSizeLong(), size);
  return request;
}

std::vector<FileDescriptorProto> FilesOf(const v1::ServerReflectionResponse& response) {
  std::vector<FileDescriptorProto> files;
  for (const std::string& encoded : response.file_descriptor_response().file_descriptor_proto()) {
    EXPECT_TRUE(files.emplace_back().ParseFromString(encoded));
  }
  return files;
}

std::vector<std::string> FileNamesOf(const v1::ServerReflectionResponse& response) {
  std::vector<std::string> names;
  for (const FileDescriptorProto& file : FilesOf(response)) names.push_back(file.name());
  return names;
}

int NumThreads() {
  const std::filesystem::directory_iterator tasks("/proc/self/task");
  return static_cast<int>(std::distance(begin(tasks), end(tasks)));
}

// The tests of all that does not depend on the version run with both.
class ReflectionOf : public ::testing::TestWithParam<const char*> {
 protected:
  Tickets tickets_;
  TestServer server_{tickets_.admit()};
};

INSTANTIATE_TEST_SUITE_P(Names, ReflectionOf, ::testing::ValuesIn(kNames),
                         [](const auto& info) { return info.index == 0 ? "V1" : "V1Alpha"; });

TEST_P(ReflectionOf, ListsAllServices) {
  Stream stream(server_, GetParam());
  const v1::ServerReflectionResponse response = stream.Ask(ListServices());
  std::vector<std::string> names;
  for (const auto& service : response.list_services_response().service()) {
    names.push_back(service.name());
  }
  EXPECT_THAT(names, ElementsAre(kQueryService, kNames[0], kNames[1]));
  EXPECT_EQ(response.original_request().list_services(), "*");
}

TEST_P(ReflectionOf, DescribesEachServiceThatItLists) {
  Stream stream(server_, GetParam());
  const v1::ServerReflectionResponse listed = stream.Ask(ListServices());
  for (const auto& service : listed.list_services_response().service()) {
    SCOPED_TRACE(service.name());
    EXPECT_THAT(FilesOf(stream.Ask(Symbol(service.name()))), Not(IsEmpty()));
  }
}

TEST_P(ReflectionOf, FileOfASymbolComesOnceWithAllItsImports) {
  Stream stream(server_, GetParam());
  // The file with its imports can be built without any other.
  for (int i = 0; i < 2; ++i) {
    const v1::ServerReflectionResponse response = stream.Ask(Symbol(kQueryService));
    std::vector<FileDescriptorProto> files = FilesOf(response);
    ASSERT_THAT(files, SizeIs(::testing::Gt(1)));
    EXPECT_EQ(files[0].name(), kQueryFile);
    EXPECT_EQ(response.valid_host(), "robot.local");
    EXPECT_EQ(response.original_request().SerializeAsString(),
              Symbol(kQueryService).SerializeAsString());

    google::protobuf::SimpleDescriptorDatabase database;
    for (const FileDescriptorProto& file : files) EXPECT_TRUE(database.Add(file)) << file.name();
    DescriptorPool pool(&database);
    const google::protobuf::ServiceDescriptor* const service =
        pool.FindServiceByName(kQueryService);
    ASSERT_NE(service, nullptr);
    EXPECT_EQ(service->DebugString(),
              DescriptorPool::generated_pool()->FindServiceByName(kQueryService)->DebugString());
  }
}

TEST_P(ReflectionOf, FilesAreFoundByAllTheirSymbolsAndByTheirNames) {
  Stream stream(server_, GetParam());
  const std::vector<std::string> names = FileNamesOf(stream.Ask(FileNamed(kQueryFile)));
  EXPECT_EQ(names.front(), kQueryFile);
  for (const char* symbol : {"hypermap.v1.QueryService.QueryPoint", "hypermap.v1.QueryPointRequest",
                             "hypermap.v1.QueryPointRequest.point"}) {
    SCOPED_TRACE(symbol);
    EXPECT_EQ(FileNamesOf(stream.Ask(Symbol(symbol))), names);
  }
  EXPECT_THAT(FileNamesOf(stream.Ask(FileNamed("hypermap/v1/geometry.proto"))),
              ElementsAre("hypermap/v1/geometry.proto"));
}

TEST_P(ReflectionOf, UnknownNamesAreNotFoundAndTheStreamGoesOn) {
  Stream stream(server_, GetParam());
  for (const auto& request :
       {Symbol("hypermap.v1.NoService"), Symbol(""), Symbol("."), Symbol(std::string(3, '\0')),
        FileNamed("hypermap/v1/none.proto"), FileNamed("../../etc/passwd"),
        Extension("hypermap.v1.Point", 1), Extension("google.protobuf.MessageOptions", 99'999),
        Extension("hypermap.v1.None", 1), ExtensionNumbers("hypermap.v1.None")}) {
    SCOPED_TRACE(request.ShortDebugString());
    const v1::ServerReflectionResponse response = stream.Ask(request);
    EXPECT_EQ(response.error_response().error_code(), grpc::StatusCode::NOT_FOUND);
    EXPECT_THAT(response.error_response().error_message(), HasSubstr("no "));
    EXPECT_EQ(response.valid_host(), request.host());
    EXPECT_EQ(response.original_request().SerializeAsString(), request.SerializeAsString());
  }
  EXPECT_THAT(FilesOf(stream.Ask(Symbol(kQueryService))), Not(IsEmpty()));
  stream.WritesDone();
  EXPECT_TRUE(stream.Finish().ok());
}

TEST_P(ReflectionOf, TypesHaveTheExtensionsThatAreLinkedIn) {
  Stream stream(server_, GetParam());
  const v1::ServerReflectionResponse response = stream.Ask(ExtensionNumbers("hypermap.v1.Point"));
  EXPECT_EQ(response.all_extension_numbers_response().base_type_name(), "hypermap.v1.Point");
  EXPECT_THAT(response.all_extension_numbers_response().extension_number(), IsEmpty());
}

TEST_P(ReflectionOf, RequestWithoutAQuestionIsInvalid) {
  Stream stream(server_, GetParam());
  const v1::ServerReflectionResponse response = stream.Ask({});
  EXPECT_EQ(response.error_response().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(response.error_response().error_message(), HasSubstr("message_request"));
}

TEST_P(ReflectionOf, BytesThatAreNoRequestEndTheStream) {
  for (const char* bytes : {"\x22\x05x", "\xff\xff\xff", "\x22\x01\xff"}) {
    SCOPED_TRACE(::testing::PrintToString(std::string(bytes)));
    Stream stream(server_, GetParam());
    stream.WriteBytes(bytes);
    const grpc::Status status = stream.Finish();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(status.error_message(), HasSubstr("ServerReflectionRequest"));
  }
}

TEST_P(ReflectionOf, RequestThatIsTooLargeEndsTheStream) {
  Stream large(server_, GetParam());
  const v1::ServerReflectionResponse response = large.Ask(RequestOfSize(kMostBytes));
  EXPECT_EQ(response.error_response().error_code(), grpc::StatusCode::NOT_FOUND);

  // These bytes are no request either, which would be INVALID_ARGUMENT if they were parsed.
  for (const size_t size : {kMostBytes + 1, size_t{3} << 20}) {
    Stream stream(server_, GetParam());
    stream.WriteBytes(std::string(size, '\xff'));
    const grpc::Status status = stream.Finish();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_THAT(status.error_message(), HasSubstr(absl::StrCat(kMostBytes)));
  }
}

class Reflection : public ::testing::Test {
 protected:
  Tickets tickets_;
};

TEST_F(Reflection, RequestsAreAnsweredInOrderAndOneAtATime) {
  TestServer server(tickets_.admit());
  Stream stream(server);
  constexpr int kRequests = 100;
  constexpr size_t kBytes = 60'000;
  const auto request = [](int i) {
    v1::ServerReflectionRequest made = RequestOfSize(kBytes);
    made.set_host(absl::StrCat(i));
    return made;
  };
  std::thread writer([&] {
    for (int i = 0; i < kRequests; ++i) EXPECT_TRUE(stream.Write(request(i)));
    stream.WritesDone();
  });
  // The client does not read yet.
  tickets_.WaitUntil([](const auto& counts) { return counts.most_bytes > 0; });
  for (int i = 0; i < kRequests; ++i) {
    const std::optional<v1::ServerReflectionResponse> response = stream.Read();
    ASSERT_TRUE(response.has_value());
    EXPECT_EQ(response->valid_host(), absl::StrCat(i));
  }
  writer.join();
  EXPECT_TRUE(stream.Finish().ok());
  EXPECT_LE(tickets_.counts().most_bytes, int64_t{4} * (kBytes + 8));
  EXPECT_EQ(tickets_.counts().bytes, 0);
}

TEST_F(Reflection, RequestWhoseMemoryIsNotToBeHadEndsTheStream) {
  TestServer server(tickets_.admit(absl::OkStatus(), 1 << 17));
  Stream stream(server);
  EXPECT_TRUE(stream.Ask(RequestOfSize(1 << 15)).has_error_response());
  stream.Write(RequestOfSize((1 << 15) + 1));
  const grpc::Status status = stream.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(status.error_message(), "--max_request_bytes");
}

TEST_F(Reflection, StreamThatIsNotAdmittedEndsUnread) {
  TestServer server(tickets_.admit(absl::ResourceExhaustedError("--max_calls")));
  Stream stream(server);
  stream.Write(ListServices());
  EXPECT_FALSE(stream.Read().has_value());
  const grpc::Status status = stream.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(status.error_message(), "--max_calls");
  tickets_.WaitUntilNoneIsOpen();
}

TEST_F(Reflection, OpenStreamsTakeNoThreads) {
  constexpr int kStreams = 500;
  TestServer server(tickets_.admit());
  std::vector<std::unique_ptr<Stream>> streams;
  const auto open = [&](int num) {
    for (int i = 0; i < num; ++i) {
      streams.push_back(std::make_unique<Stream>(server, kNames[i % 2]));
      EXPECT_TRUE(streams.back()->Ask(ListServices()).has_list_services_response());
    }
  };
  open(10);  // gRPC starts its own threads.
  const int before = NumThreads();
  open(kStreams);
  EXPECT_EQ(tickets_.counts().open, kStreams + 10);
  // gRPC may start some more, depending on the number of processors.
  EXPECT_LT(NumThreads(), before + kStreams / 5);
  for (const auto& stream : streams) {
    EXPECT_TRUE(stream->Ask(Symbol(kQueryService)).has_file_descriptor_response());
  }
  streams.clear();
  tickets_.WaitUntilNoneIsOpen();
}

TEST_F(Reflection, CancelledStreamsEnd) {
  TestServer server(tickets_.admit());
  constexpr int kRounds = 20;
  for (int i = 0; i < kRounds; ++i) {
    Stream idle(server);
    EXPECT_TRUE(idle.Ask(ListServices()).has_list_services_response());
    idle.Cancel();
    EXPECT_EQ(idle.Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  tickets_.WaitUntilNoneIsOpen();
  // The ticket is told, so that floods of cancelled calls can be counted.
  const std::vector<absl::Status> ends = tickets_.counts().ends;
  EXPECT_THAT(ends, SizeIs(kRounds));
  EXPECT_THAT(ends, Each(::testing::ResultOf(absl::IsCancelled, true)));
}

TEST_F(Reflection, StreamWhoseClientDoesNotReadEndsWhenItIsCancelled) {
  TestServer server(tickets_.admit());
  Stream stream(server);
  std::thread writer([&] {
    while (stream.Write(RequestOfSize(60'000))) {
    }
  });
  tickets_.WaitUntil([](const auto& counts) { return counts.bytes > 0; });
  stream.Cancel();
  writer.join();
  tickets_.WaitUntilNoneIsOpen();
  EXPECT_EQ(tickets_.counts().bytes, 0);
}

TEST_F(Reflection, StopEndsOpenStreamsAndRefusesNewOnes) {
  TestServer server(tickets_.admit());
  Stream open(server);
  EXPECT_TRUE(open.Ask(ListServices()).has_list_services_response());
  server.reflection().Stop();
  EXPECT_EQ(open.Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  Stream late(server);
  EXPECT_EQ(late.Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  tickets_.WaitUntilNoneIsOpen();
}

TEST_F(Reflection, StreamsThatBeginAndAreCancelledDuringStopEnd) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(absl::StrCat("HYPERMAP_TEST_SEED=", seed));
  hypermap::testing::Rng rng(seed);
  TestServer server(tickets_.admit());
  std::vector<std::thread> clients;
  for (int i = 0; i < 4; ++i) {
    clients.emplace_back([&server, seed_of_client = rng()] {
      hypermap::testing::Rng choices(seed_of_client);
      bool stopped = false;
      while (!stopped) {
        Stream stream(server, kNames[choices() % 2]);
        if (choices() % 3 != 0) {
          stream.Write(Symbol(kQueryService));
          if (choices() % 2 == 0) stream.Read();
        }
        if (choices() % 2 == 0) stream.Cancel();
        stream.WritesDone();
        stopped = stream.Finish().error_code() == grpc::StatusCode::UNAVAILABLE;
      }
    });
  }
  tickets_.WaitUntil([](const auto& counts) { return counts.ends.size() > 100; });
  server.reflection().Stop();
  for (std::thread& client : clients) client.join();
  tickets_.WaitUntilNoneIsOpen();
}

TEST_F(Reflection, RandomRequestsAreAnswered) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(absl::StrCat("HYPERMAP_TEST_SEED=", seed));
  hypermap::testing::Rng rng(seed);
  TestServer server(tickets_.admit());
  Stream stream(server);
  const std::string names[] = {kQueryService, kQueryFile, "google.protobuf.FieldOptions",
                               "hypermap.v1.Point.x", "grpc.reflection.v1.ErrorResponse"};
  for (int i = 0; i < 2000; ++i) {
    std::string name = names[rng() % std::size(names)];
    for (uint64_t changes = rng() % 4; changes > 0 && !name.empty(); --changes) {
      const size_t at = rng() % name.size();
      switch (rng() % 3) {
        case 0:
          name[at] = static_cast<char>(rng() % 128);
          break;
        case 1:
          name.erase(at);
          break;
        default:
          name.insert(at, name.substr(at / 2));
      }
    }
    const v1::ServerReflectionRequest requests[] = {Symbol(name), FileNamed(name),
                                                    ExtensionNumbers(name),
                                                    Extension(name, static_cast<int>(rng()))};
    const v1::ServerReflectionRequest& request = requests[rng() % std::size(requests)];
    const v1::ServerReflectionResponse response = stream.Ask(request);
    EXPECT_EQ(response.original_request().SerializeAsString(), request.SerializeAsString());
    EXPECT_NE(response.message_response_case(),
              v1::ServerReflectionResponse::MESSAGE_RESPONSE_NOT_SET);
  }
}

}  // namespace
}  // namespace hypermap::reflection
