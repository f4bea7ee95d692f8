// Tests of what all rpcs do with the bytes of a request, whatever the rpc. A new rpc is tested by
// itself, because the rpcs are those of the descriptors.
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <future>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "hypermap/v1/catalog_service.pb.h"
#include "hypermap/v1/edit_service.pb.h"
#include "hypermap/v1/exploration_service.pb.h"
#include "hypermap/v1/ingest_service.pb.h"
#include "hypermap/v1/query_service.pb.h"
#include "hypermap/v1/robot_service.pb.h"
#include "hypermap/v1/watch_service.pb.h"
#include "server/services/testing/held_pool.h"
#include "server/services/testing/test_server.h"
#include "tests/support/eventually.h"

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;

grpc::ByteBuffer BufferOf(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return grpc::ByteBuffer(&slice, 1);
}

// The paths of all rpcs.
std::vector<std::string> AllRpcs() {
  std::vector<std::string> paths;
  for (const google::protobuf::FileDescriptor* file :
       {v1::CreateMapRequest::descriptor()->file(), v1::ApplyEditsRequest::descriptor()->file(),
        v1::ClaimGoalRequest::descriptor()->file(), v1::ObserveRequest::descriptor()->file(),
        v1::QueryPointRequest::descriptor()->file(), v1::ReportRequest::descriptor()->file(),
        v1::WatchRequest::descriptor()->file()}) {
    for (int i = 0; i < file->service_count(); ++i) {
      const google::protobuf::ServiceDescriptor& service = *file->service(i);
      for (int j = 0; j < service.method_count(); ++j) {
        paths.push_back(absl::StrCat("/", service.full_name(), "/", service.method(j)->name()));
      }
    }
  }
  return paths;
}

class RequestBytesTest : public ::testing::Test {
 protected:
  static Limits SmallMessages() {
    Limits limits;
    limits.max_message_bytes = 64 << 10;
    return limits;
  }

  RequestBytesTest() { server_.MakeMap("site", LayerOfCups("cups", 1)); }

  // Sends the messages, and returns the status with which the call ends.
  grpc::Status StatusOf(const std::string& rpc, const std::vector<std::string>& messages) {
    grpc::GenericStub stub(server_.channel());
    grpc::ClientContext context;
    grpc::CompletionQueue queue;
    const auto stream = stub.PrepareCall(&context, rpc, &queue);
    const auto wait = [&] {
      void* tag = nullptr;
      bool ok = false;
      return queue.Next(&tag, &ok) && ok;
    };
    stream->StartCall(nullptr);
    wait();
    for (const std::string& message : messages) {
      stream->Write(BufferOf(message), nullptr);
      wait();
    }
    stream->WritesDone(nullptr);
    wait();
    grpc::ByteBuffer answer;
    do {
      stream->Read(&answer, nullptr);
    } while (wait());
    grpc::Status status;
    stream->Finish(&status, nullptr);
    wait();
    return status;
  }

  // A call may give its charge back shortly after the client has got the status.
  int64_t used() { return server_.budgets().request_bytes.used(); }

  TestServer server_{SmallMessages()};
};

TEST_F(RequestBytesTest, BytesThatAreNoMessageAreInvalid) {
  for (const std::string& rpc : AllRpcs()) {
    const grpc::Status status = StatusOf(rpc, {"\xff"});
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << rpc;
    EXPECT_THAT(status.error_message(), HasSubstr("the request is not a hypermap.v1.")) << rpc;
  }
  // As the second message of a stream, too: the stream does not end as if it were complete.
  v1::ImportMapRequest header;
  header.mutable_header()->set_map("imported");
  header.mutable_header()->set_create_map(true);
  const grpc::Status status =
      StatusOf("/hypermap.v1.CatalogService/ImportMap", {header.SerializeAsString(), "\xff"});
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("the request is not a hypermap.v1."));
}

TEST_F(RequestBytesTest, MessagesThatTakeFarMoreMemoryThanBytesAreRefused) {
  // Unknown fields of two bytes each, which take sixteen when they are parsed.
  std::string dense;
  while (dense.size() < 1'000'000) dense += std::string("\x78\x00", 2);
  for (const std::string& rpc : AllRpcs()) {
    const grpc::Status status = StatusOf(rpc, {dense});
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED)
        << rpc << " " << status.error_message();
  }
  EXPECT_TRUE(testing::Eventually([this] { return used() == 0; })) << used();
}

TEST_F(RequestBytesTest, LargeMessagesAreChargedUntilTheyAreAnswered) {
  // Fewer of them are accepted, one after the other.
  std::string dense;
  while (dense.size() < 20'000) dense += std::string("\x78\x00", 2);
  for (const std::string& rpc : AllRpcs()) {
    const grpc::Status status = StatusOf(rpc, {dense});
    EXPECT_NE(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED)
        << rpc << " " << status.error_message();
  }
  EXPECT_TRUE(testing::Eventually([this] { return used() == 0; })) << used();
}

TEST_F(RequestBytesTest, LargeMessagesAreCountedAndParsedByWorkers) {
  v1::ListMapsRequest request;
  request.GetReflection()->MutableUnknownFields(&request)->AddLengthDelimited(
      15, std::string(100'000, 'x'));
  const std::string bytes = request.SerializeAsString();
  v1::QueryPointRequest small;
  small.mutable_scope()->set_map("site");
  small.mutable_point();
  WorkerPools& workers = server_.workers();
  for (const std::string& rpc : AllRpcs()) {
    SCOPED_TRACE(rpc);
    std::list<HeldPool> held;
    for (WorkerPool* pool : {&workers.questions, &workers.long_questions, &workers.watches,
                             &workers.writes, &workers.long_writes, &workers.openings,
                             &workers.files, &workers.uploads, &workers.explorations}) {
      held.emplace_back(*pool);
    }
    std::future<grpc::Status> status =
        std::async(std::launch::async, [&] { return StatusOf(rpc, {bytes}); });
    // A message that was counted would hold more.
    EXPECT_TRUE(testing::Eventually([&] { return used() > 0; }));
    EXPECT_EQ(used(), static_cast<int64_t>(bytes.size()));
    // gRPC's threads answer others meanwhile.
    v1::QueryPointResponse response;
    grpc::ClientContext context;
    EXPECT_TRUE(server_.query->QueryPoint(&context, small, &response).ok());
    held.clear();
    const grpc::Status ended = status.get();
    EXPECT_NE(ended.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << ended.error_message();
    EXPECT_TRUE(testing::Eventually([this] { return used() == 0; })) << used();
  }
}

// A stream whose first message the server keeps.
class KeptMessageTest : public RequestBytesTest {
 protected:
  void Open(const std::string& rpc, const std::vector<std::string>& messages) {
    stub_.emplace(server_.channel());
    stream_ = stub_->PrepareCall(&context_, rpc, &queue_);
    stream_->StartCall(nullptr);
    Wait();
    for (const std::string& message : messages) {
      stream_->Write(BufferOf(message), nullptr);
      Wait();
    }
  }
  void ReadAnswer() {
    grpc::ByteBuffer answer;
    stream_->Read(&answer, nullptr);
    Wait();
    EXPECT_GT(answer.Length(), 0);
  }
  void Cancel() {
    context_.TryCancel();
    grpc::Status status;
    stream_->Finish(&status, nullptr);
    Wait();
  }

 private:
  void Wait() {
    void* tag = nullptr;
    bool ok = false;
    queue_.Next(&tag, &ok);
  }

  std::optional<grpc::GenericStub> stub_;
  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> stream_;
};

TEST_F(KeptMessageTest, TheScopeOfAStreamOfPointsIsChargedUntilItEnds) {
  v1::QueryPointsRequest opening, points;
  opening.mutable_opening()->mutable_scope()->set_map("site");
  for (int i = 0; i < 500; ++i) opening.mutable_opening()->mutable_scope()->add_layers("cups");
  points.add_xs(0);
  points.add_ys(0);
  Open("/hypermap.v1.QueryService/QueryPoints",
       {opening.SerializeAsString(), points.SerializeAsString()});
  ReadAnswer();
  EXPECT_GE(used(), static_cast<int64_t>(opening.opening().scope().SpaceUsedLong()));
  Cancel();
  EXPECT_TRUE(testing::Eventually([this] { return used() == 0; })) << used();
}

TEST_F(KeptMessageTest, TheHeaderOfAnImportIsChargedUntilItEnds) {
  v1::ImportMapRequest header, chunk;
  header.mutable_header()->set_map("imported");
  header.mutable_header()->set_request_id(std::string(30'000, 'x'));
  chunk.mutable_chunk()->set_file_name("map.geojson");
  chunk.mutable_chunk()->set_data("{");
  Open("/hypermap.v1.CatalogService/ImportMap",
       {header.SerializeAsString(), chunk.SerializeAsString()});
  EXPECT_TRUE(testing::Eventually([this] { return server_.budgets().scratch_bytes.used() > 0; }));
  EXPECT_GE(used(), 30'000);
  Cancel();
  EXPECT_TRUE(testing::Eventually([this] { return used() == 0; })) << used();
}

}  // namespace
}  // namespace hypermap::server
