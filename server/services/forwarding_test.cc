// Tests of requests to a server that is not the owner of their map: it passes on those that only
// the owner can answer, and the caller does not notice.
#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client_libs/cpp/client.h"
#include "server/services/testing/test_server.h"
#include "tests/support/eventually.h"
#include "wire/observation.h"
#include "wire/time.h"

namespace hypermap::server {
namespace {

using ::hypermap::testing::Eventually;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr char kAuthor[] = "x-hypermap-author";

grpc::ByteBuffer BytesOf(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return grpc::ByteBuffer(&slice, 1);
}

// Sets the map of a request, wherever the request names it. Returns false if it names none.
bool SetMap(google::protobuf::Message* request, const std::string& map) {
  const auto* const reflection = request->GetReflection();
  const auto* const field = request->GetDescriptor()->FindFieldByName("map");
  if (field != nullptr && field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_STRING) {
    reflection->SetString(request, field, map);
    return true;
  }
  for (const char* const part : {"scope", "opening", "header"}) {
    const auto* const message = request->GetDescriptor()->FindFieldByName(part);
    if (message == nullptr) continue;
    if (SetMap(reflection->MutableMessage(request, message), map)) return true;
  }
  return false;
}

// A request of an rpc that names the map and nothing else; nullopt if it names no map.
std::optional<std::string> RequestAbout(const RpcInfo& info, const std::string& map) {
  using google::protobuf::DescriptorPool;
  using google::protobuf::MessageFactory;
  if (!info.least) return std::nullopt;  // health and reflection
  const auto* const service =
      DescriptorPool::generated_pool()->FindServiceByName(std::string(info.service));
  const auto* const method = service->FindMethodByName(std::string(info.method));
  const std::unique_ptr<google::protobuf::Message> request(
      MessageFactory::generated_factory()->GetPrototype(method->input_type())->New());
  if (!SetMap(request.get(), map)) return std::nullopt;
  return request->SerializeAsString();
}

// Sends one message. A stream that would go on ends after its first answer, or soon without one.
grpc::Status StatusOf(TestServer& server, const std::string& path, const std::string& request) {
  grpc::GenericStub stub(server.channel());
  grpc::ClientContext context;
  const bool goes_on = absl::StrContains(path, "Watch") || absl::StrContains(path, "Replicate");
  if (goes_on) context.set_deadline(absl::ToChronoTime(absl::Now() + absl::Milliseconds(300)));
  grpc::CompletionQueue queue;
  const auto stream = stub.PrepareCall(&context, path, &queue);
  const auto wait = [&] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  stream->StartCall(nullptr);
  wait();
  stream->Write(BytesOf(request), nullptr);
  wait();
  stream->WritesDone(nullptr);
  wait();
  grpc::ByteBuffer answer;
  stream->Read(&answer, nullptr);
  if (wait() && goes_on) context.TryCancel();
  grpc::Status status;
  stream->Finish(&status, nullptr);
  wait();
  return status;
}

// Two servers with a map "site": that of `owner_` has content, and `other_` follows it so far
// behind that its map is empty.
class ForwardingTest : public ::testing::Test {
 protected:
  ForwardingTest() {
    owner_.MakeMap("site", LayerOfCups("cups", 3));
    EXPECT_TRUE(other_.site().Create({"site", "map", ""}).ok());
    SetOwner(other_, owner_.address());
  }
  // Its calls to the owner end before the owner does.
  ~ForwardingTest() override { other_.Shutdown(absl::Seconds(10)); }

  static MapSession& SessionOf(TestServer& server) { return **server.site().Find("site"); }
  static void SetOwner(TestServer& server, std::optional<std::string> address) {
    SessionOf(server).SetOwner(std::move(address));
  }

  static v1::ApplyEditsRequest PutCup(const std::string& request_id) {
    v1::ApplyEditsRequest request;
    request.set_map("site");
    request.set_request_id(request_id);
    v1::PutObject& put = *request.add_edits()->mutable_put_object();
    put.set_layer("cups");
    put.mutable_object()->set_label("cup");
    put.mutable_object()->mutable_shape()->mutable_point()->set_x(1);
    return request;
  }
  static grpc::Status Apply(TestServer& server, const v1::ApplyEditsRequest& request,
                            v1::ApplyEditsResponse* response,
                            absl::Duration timeout = absl::Seconds(30)) {
    grpc::ClientContext context;
    context.set_deadline(absl::ToChronoTime(absl::Now() + timeout));
    return server.edit->ApplyEdits(&context, request, response);
  }
  static int64_t Forwarded(const TestServer& server, Rpc rpc) {
    return server.meters().Read(rpc).forwarded;
  }
  static int64_t Ended(const TestServer& server, Rpc rpc, absl::StatusCode code) {
    return server.meters().Read(rpc).ended[static_cast<size_t>(code)];
  }
  // All that the calls of a server have charged is given back.
  static bool HoldsNothing(TestServer& server) {
    return Eventually([&] {
      return server.budgets().request_bytes.used() == 0 && server.budgets().calls.used() == 0;
    });
  }

  TestServer owner_;
  TestServer other_;
};

TEST_F(ForwardingTest, EachRpcIsAnsweredByTheServerThatItsRowNames) {
  for (const RpcInfo& info : AllRpcs()) {
    const std::optional<std::string> request = RequestAbout(info, "site");
    if (!request || info.rpc == Rpc::kDeleteMap) continue;
    const std::string path = absl::StrCat("/", info.service, "/", info.method);
    const int64_t began = owner_.meters().Read(info.rpc).began;
    const grpc::Status status = StatusOf(other_, path, *request);
    const int64_t expected = info.answered_by == AnsweredBy::kOwner ? 1 : 0;
    EXPECT_EQ(Forwarded(other_, info.rpc), expected) << path;
    EXPECT_EQ(owner_.meters().Read(info.rpc).began - began, expected) << path;
    EXPECT_THAT(status.error_message(), Not(HasSubstr("is owned by"))) << path;
    if (expected == 0) continue;
    const grpc::Status direct = StatusOf(owner_, path, *request);
    EXPECT_EQ(status.error_code(), direct.error_code()) << path << ": " << status.error_message();
    EXPECT_EQ(status.error_message(), direct.error_message()) << path;
  }
  EXPECT_TRUE(HoldsNothing(other_));
  EXPECT_TRUE(HoldsNothing(owner_));
}

TEST_F(ForwardingTest, ADeletedMapIsGoneAtItsOwner) {
  client::Client client(other_.address());
  EXPECT_TRUE(client.DeleteMap("site").ok());
  EXPECT_TRUE(absl::IsNotFound(owner_.site().Find("site").status()));
  EXPECT_TRUE(other_.site().Find("site").ok());
}

TEST_F(ForwardingTest, AnEditHasTheSameReceiptByWhicheverServerItIsRepeated) {
  v1::ApplyEditsResponse first, again, direct;
  const v1::ApplyEditsRequest request = PutCup("r1");
  ASSERT_TRUE(Apply(other_, request, &first).ok());
  ASSERT_TRUE(Apply(other_, request, &again).ok());
  ASSERT_TRUE(Apply(owner_, request, &direct).ok());
  EXPECT_EQ(first.SerializeAsString(), direct.SerializeAsString());
  EXPECT_EQ(again.SerializeAsString(), direct.SerializeAsString());
  EXPECT_EQ(direct.incarnation(), SessionOf(owner_).incarnation());
  EXPECT_EQ(SessionOf(owner_).snapshot()->FindLayer("cups")->Size(), 4);
  EXPECT_EQ(SessionOf(other_).snapshot()->revision, 0);
  EXPECT_EQ(Forwarded(other_, Rpc::kApplyEdits), 2);
  EXPECT_EQ(Ended(other_, Rpc::kApplyEdits, absl::StatusCode::kOk), 2);
}

TEST_F(ForwardingTest, ConditionsAreThoseOfTheOwner) {
  v1::ApplyEditsRequest request = PutCup("");
  v1::LayerVersion& condition = *request.add_if_layers();
  condition.set_layer("cups");
  condition.set_version(SessionOf(owner_).snapshot()->LayerVersionOf("cups"));
  v1::ApplyEditsResponse response;
  EXPECT_TRUE(Apply(other_, request, &response).ok());
  EXPECT_EQ(Apply(other_, request, &response).error_code(), grpc::StatusCode::ABORTED);
  request = PutCup("");
  request.set_incarnation(SessionOf(owner_).incarnation());
  EXPECT_TRUE(Apply(other_, request, &response).ok());
  request.set_incarnation(SessionOf(other_).incarnation());
  EXPECT_EQ(Apply(other_, request, &response).error_code(), grpc::StatusCode::ABORTED);
}

TEST_F(ForwardingTest, LayersAndTransformsAreThoseOfTheOwner) {
  client::Client client(other_.address());
  LayerSpec spec;
  spec.name = "shelves";
  const auto made = client.CreateLayer("site", spec);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_TRUE(client.SetTransform("site", {"map", "dock", PlanarTransform(1, 2, 0)}).ok());
  EXPECT_TRUE(client.DeleteLayer("site", "cups").ok());
  const SnapshotPtr snapshot = SessionOf(owner_).snapshot();
  EXPECT_NE(snapshot->FindLayer("shelves"), nullptr);
  EXPECT_EQ(snapshot->FindLayer("cups"), nullptr);
  EXPECT_TRUE(snapshot->frames.Lookup("map", "dock").ok());
  // Questions are answered here.
  EXPECT_TRUE(client.ListLayers("site")->layers.empty());
}

TEST_F(ForwardingTest, TheAuthorIsTheCallerAndNotTheServerThatPassesTheCallOn) {
  grpc::ClientContext context, named;
  named.AddMetadata(kAuthor, "anna");
  v1::ApplyEditsResponse response;
  ASSERT_TRUE(other_.edit->ApplyEdits(&context, PutCup(""), &response).ok());
  ASSERT_TRUE(other_.edit->ApplyEdits(&named, PutCup(""), &response).ok());
  grpc::ClientContext asks;
  v1::ListRevisionsRequest request;
  request.set_map("site");
  v1::ListRevisionsResponse revisions;
  ASSERT_TRUE(owner_.watch->ListRevisions(&asks, request, &revisions).ok());
  ASSERT_GE(revisions.revisions_size(), 2);
  std::vector<std::string> authors;
  for (const auto& revision : revisions.revisions()) authors.push_back(revision.author());
  EXPECT_THAT(authors, Contains("anna"));
  // Without a name it is the caller's address, which only the other server sees.
  EXPECT_THAT(authors, Contains(AllOf(StartsWith("ipv4:127.0.0.1:"), Not(owner_.address()))));
}

TEST_F(ForwardingTest, TheNameOfTheCallIsKept) {
  grpc::ClientContext context;
  context.AddMetadata("x-request-id", "call-7");
  v1::ApplyEditsResponse response;
  ASSERT_TRUE(other_.edit->ApplyEdits(&context, PutCup(""), &response).ok());
  const auto& trailing = context.GetServerTrailingMetadata();
  ASSERT_EQ(trailing.count("x-request-id"), 1);
  EXPECT_EQ(trailing.find("x-request-id")->second, "call-7");
}

TEST_F(ForwardingTest, RobotsAreThoseThatReportToTheOwner) {
  v1::ReportRequest report;
  report.set_map("site");
  report.mutable_report()->set_robot("cart");
  wire::EncodeTime(absl::Now(), report.mutable_report()->mutable_stamp());
  report.mutable_report()->mutable_pose()->set_x(3);
  grpc::ClientContext reports, lists, watches;
  v1::ReportResponse reported;
  ASSERT_TRUE(other_.robots->Report(&reports, report, &reported).ok());
  EXPECT_EQ(reported.outcome(), v1::REPORT_OUTCOME_ACCEPTED);
  v1::ListRobotsRequest list;
  list.set_map("site");
  v1::ListRobotsResponse listed;
  ASSERT_TRUE(other_.robots->ListRobots(&lists, list, &listed).ok());
  EXPECT_EQ(listed.robots_size(), 1);
  EXPECT_EQ(SessionOf(owner_).robots().List().size(), 1);

  v1::WatchRobotsRequest watch;
  watch.set_map("site");
  const auto reader = other_.robots->WatchRobots(&watches, watch);
  v1::WatchRobotsResponse first, second;
  ASSERT_TRUE(reader->Read(&first));
  // The stream goes on as the owner's does.
  grpc::ClientContext again;
  report.mutable_report()->set_robot("truck");
  ASSERT_TRUE(owner_.robots->Report(&again, report, &reported).ok());
  ASSERT_TRUE(reader->Read(&second));
  EXPECT_THAT(second.ShortDebugString(), HasSubstr("truck"));
  watches.TryCancel();
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(Eventually(
      [&] { return Ended(owner_, Rpc::kWatchRobots, absl::StatusCode::kCancelled) == 1; }));
  EXPECT_TRUE(HoldsNothing(other_));
}

TEST_F(ForwardingTest, ExplorationsAreThoseOfTheOwner) {
  EditBatch floor = LayerOfCells("walls", 10, 20);
  std::get<WriteCells>(floor.edits[1]).values.assign(200, 0.0);
  ASSERT_TRUE(SessionOf(owner_).SubmitAndWait({std::move(floor), "test", ""}).ok());
  v1::StartExplorationRequest start;
  start.set_map("site");
  start.set_occupancy_layer("walls");
  start.set_exploration_layer("seen");
  start.set_request_id("s1");
  v1::Ring& outer = *start.mutable_area()->mutable_outer();
  for (const Point& p : {Point{0, 0}, Point{20, 0}, Point{20, 10}, Point{0, 10}}) {
    outer.add_xs(p.x);
    outer.add_ys(p.y);
  }
  v1::StartExplorationResponse started, again;
  grpc::ClientContext starts, repeats, claims, gets;
  const grpc::Status status = other_.exploration->StartExploration(&starts, start, &started);
  ASSERT_TRUE(status.ok()) << status.error_message();
  ASSERT_TRUE(owner_.exploration->StartExploration(&repeats, start, &again).ok());
  EXPECT_EQ(again.exploration().id(), started.exploration().id());
  v1::ClaimGoalRequest claim;
  claim.set_map("site");
  claim.set_robot("cart");
  claim.mutable_pose()->set_x(1.5);
  claim.mutable_pose()->set_y(1.5);
  v1::ClaimGoalResponse claimed;
  ASSERT_TRUE(other_.exploration->ClaimGoal(&claims, claim, &claimed).ok());
  EXPECT_TRUE(claimed.has_goal());
  v1::GetExplorationRequest get;
  get.set_map("site");
  v1::GetExplorationResponse got;
  ASSERT_TRUE(other_.exploration->GetExploration(&gets, get, &got).ok());
  EXPECT_EQ(got.revision(), claimed.revision());
}

TEST_F(ForwardingTest, ACopyOfTheMapIsOneOfTheOwners) {
  Limits limits;
  limits.max_chunk_bytes = 1;
  TestServer owner(limits), other(limits);
  owner.MakeMap("site", LayerOfCups("cups", 3));
  other.MakeMap("site", LayerOfCups("cups", 1));
  SetOwner(other, owner.address());
  const auto backup_of = [](TestServer& server) {
    grpc::ClientContext context;
    v1::BackupMapRequest request;
    request.set_map("site");
    const auto reader = server.catalog->BackupMap(&context, request);
    std::string file;
    for (const v1::BackupMapResponse& response : ReadAll(*reader)) file += response.data();
    const grpc::Status status = reader->Finish();
    EXPECT_TRUE(status.ok()) << status.error_message();
    return file;
  };
  EXPECT_EQ(backup_of(other), backup_of(owner));
  EXPECT_TRUE(HoldsNothing(other));
}

TEST_F(ForwardingTest, AServerThatStopsEndsTheStreamsThatItPassesOn) {
  v1::WatchRobotsRequest watch;
  watch.set_map("site");
  grpc::ClientContext watches, observes;
  const auto reader = other_.robots->WatchRobots(&watches, watch);
  v1::WatchRobotsResponse first;
  ASSERT_TRUE(reader->Read(&first));
  const auto stream = other_.ingest->Observe(&observes);
  v1::ObserveRequest request;
  request.mutable_opening()->set_map("site");
  request.mutable_opening()->set_layer("cups");
  v1::ObserveResponse response;
  ASSERT_TRUE(stream->Write(request));
  ASSERT_TRUE(stream->Read(&response));
  // A stream that went on would be cut off after the grace.
  other_.Shutdown(absl::Minutes(1));
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_FALSE(reader->Read(&first));
  reader->Finish();
  EXPECT_TRUE(Eventually([&] { return owner_.budgets().calls.used() == 0; }));
}

// A stream of observations through the server that is not the owner.
class ForwardedObserveTest : public ForwardingTest {
 protected:
  ForwardedObserveTest() : stream_(other_.ingest->Observe(&context_)) {
    v1::ObserveRequest request;
    request.mutable_opening()->set_map("site");
    request.mutable_opening()->set_layer("cups");
    stream_->Write(request);
  }

  static v1::ObserveRequest See(int64_t sequence, const std::string& label = "") {
    Observation observation;
    observation.robot = "cart";
    observation.sequence = sequence;
    observation.stamp = absl::FromUnixSeconds(1'700'000'000 + sequence);
    observation.free_space = Polygon::FromBox({{0, 0}, {2, 2}});
    if (!label.empty()) {
      observation.detections.push_back({{{label, 0.9}}, Polygon::FromBox({{0, 0}, {1, 1}})});
    }
    v1::ObserveRequest request;
    wire::EncodeObservation(observation, request.add_observations());
    return request;
  }

  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::ObserveRequest, v1::ObserveResponse>> stream_;
};

TEST_F(ForwardedObserveTest, AcknowledgementsComeAsTheOwnerGivesThem) {
  v1::ObserveResponse response;
  ASSERT_TRUE(stream_->Read(&response));
  EXPECT_EQ(response.opened().strategy(), "tally");
  EXPECT_EQ(response.opened().incarnation(), SessionOf(owner_).incarnation());
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(stream_->Write(See(i)));
    ASSERT_TRUE(stream_->Read(&response));
    ASSERT_EQ(response.acknowledgements_size(), 1);
    EXPECT_EQ(response.acknowledgements(0).sequence(), i);
    EXPECT_EQ(response.acknowledgements(0).outcome(), v1::OBSERVATION_OUTCOME_ACCEPTED);
  }
  stream_->WritesDone();
  EXPECT_FALSE(stream_->Read(&response));
  EXPECT_TRUE(stream_->Finish().ok());
  EXPECT_EQ(Ended(other_, Rpc::kObserve, absl::StatusCode::kOk), 1);
  EXPECT_TRUE(HoldsNothing(other_));
}

TEST_F(ForwardedObserveTest, CommandsAndExplanationsAreThoseOfTheOwner) {
  ASSERT_TRUE(stream_->Write(See(0, "chair")));
  v1::ObserveResponse response;
  do {
    ASSERT_TRUE(stream_->Read(&response));
  } while (response.acknowledgements().empty());
  EXPECT_EQ(response.acknowledgements(0).outcome(), v1::OBSERVATION_OUTCOME_ACCEPTED);

  client::Client client(other_.address()), direct(owner_.address());
  const ObjectId id = SessionOf(owner_).snapshot()->FindSemantic("cups")->Objects().back()->id;
  const auto explained = client.ExplainObject("site", "cups", id);
  ASSERT_TRUE(explained.ok()) << explained.status();
  EXPECT_EQ(explained->events.size(), direct.ExplainObject("site", "cups", id)->events.size());
  EXPECT_TRUE(client.RebuildLayer("site", "cups", "", "").ok());
  const PoseCorrection correction{"cart", {{explained->events[0].at.stamp, PlanarTransform()}}};
  EXPECT_TRUE(client.CorrectPoses("site", "cups", correction).ok());
  EXPECT_TRUE(client.SmoothPoses("site", "cups").ok());
  EXPECT_TRUE(client.RetractSource("site", "cups", "cart").ok());
  EXPECT_EQ(SessionOf(other_).snapshot()->revision, 0);
}

TEST_F(ForwardedObserveTest, ThousandsOfObservationsAndASlowReaderLoseNothing) {
  constexpr int kObservations = 5000;
  std::thread writer([&] {
    for (int i = 0; i < kObservations; ++i) {
      if (!stream_->Write(See(i))) break;
    }
    stream_->WritesDone();
  });
  std::vector<int64_t> sequences;
  v1::ObserveResponse response;
  // While nobody reads, the owner stops reading, and the writer waits.
  EXPECT_TRUE(Eventually([&] {
    const auto accepted = SessionOf(owner_).meters().Read().observations;
    return accepted[static_cast<size_t>(ObservationOutcome::kAccepted)] > 100;
  }));
  while (stream_->Read(&response)) {
    for (const auto& one : response.acknowledgements()) sequences.push_back(one.sequence());
    EXPECT_LE(other_.budgets().request_bytes.used(), 1 << 20);
  }
  writer.join();
  const grpc::Status status = stream_->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  std::sort(sequences.begin(), sequences.end());
  ASSERT_EQ(sequences.size(), kObservations);
  for (int i = 0; i < kObservations; ++i) ASSERT_EQ(sequences[i], i);
  EXPECT_TRUE(HoldsNothing(other_));
  EXPECT_TRUE(HoldsNothing(owner_));
}

TEST_F(ForwardedObserveTest, ACancelledStreamIsCancelledAtTheOwner) {
  v1::ObserveResponse response;
  ASSERT_TRUE(stream_->Read(&response));
  context_.TryCancel();
  EXPECT_EQ(stream_->Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(HoldsNothing(owner_));
  EXPECT_TRUE(HoldsNothing(other_));
}

TEST_F(ForwardedObserveTest, TheEndOfTheOwnerEndsAStreamWhoseClientIsSilent) {
  v1::ObserveResponse response;
  ASSERT_TRUE(stream_->Read(&response));
  // While the other server waits for the next message of the client.
  owner_.Shutdown(absl::Seconds(10));
  EXPECT_FALSE(stream_->Read(&response));
  const grpc::Status status = stream_->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(status.error_message(), HasSubstr(owner_.address()));
  EXPECT_TRUE(HoldsNothing(other_));
}

TEST_F(ForwardingTest, FilesAreImportedByTheOwner) {
  grpc::ClientContext context;
  v1::ImportMapResponse response;
  const auto writer = other_.catalog->ImportMap(&context, &response);
  v1::ImportMapRequest header, chunk;
  header.mutable_header()->set_map("site");
  header.mutable_header()->set_format(v1::FILE_FORMAT_GEOJSON);
  header.mutable_header()->set_layer("imported");
  ASSERT_TRUE(writer->Write(header));
  const std::string file =
      R"({"type":"FeatureCollection","features":[{"type":"Feature","properties":{"label":"cup"},)"
      R"("geometry":{"type":"Point","coordinates":[1,2]}}]})";
  for (const char byte : file) {
    chunk.mutable_chunk()->set_file_name("cups.geojson");
    chunk.mutable_chunk()->set_data(std::string(1, byte));
    ASSERT_TRUE(writer->Write(chunk));
  }
  writer->WritesDone();
  const grpc::Status status = writer->Finish();
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.incarnation(), SessionOf(owner_).incarnation());
  EXPECT_EQ(SessionOf(owner_).snapshot()->FindLayer("imported")->Size(), 1);
  EXPECT_TRUE(HoldsNothing(other_));
}

TEST_F(ForwardingTest, AnImportThatTheOwnerRefusesEndsWhileItsClientStillWrites) {
  grpc::ClientContext context;
  v1::ImportMapResponse response;
  const auto writer = other_.catalog->ImportMap(&context, &response);
  v1::ImportMapRequest header;
  header.mutable_header()->set_map("site");
  ASSERT_TRUE(writer->Write(header));
  // The header may come once.
  while (writer->Write(header)) {
  }
  EXPECT_EQ(writer->Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_TRUE(HoldsNothing(other_));
}

TEST_F(ForwardingTest, AMapThatNobodyHasIsMadeHere) {
  client::Client client(other_.address());
  EXPECT_TRUE(client.CreateMap("yard").ok());
  EXPECT_TRUE(other_.site().Find("yard").ok());
  EXPECT_TRUE(absl::IsNotFound(owner_.site().Find("yard").status()));
}

// Both servers while the map's writer waits for the disk, so that a check of the map waits, too.
class ForwardedWaitTest : public ForwardingTest {
 protected:
  ForwardedWaitTest() {
    request_.set_map("site");
    owner_.disk().Hold();
    held_ = std::async(std::launch::async, [this] { return Apply(owner_, PutCup(""), &put_); });
    owner_.disk().AwaitHeldWrite();
  }
  ~ForwardedWaitTest() override {
    owner_.disk().Release();
    EXPECT_TRUE(held_.get().ok());
  }

  // Begins a check by way of the other server, and returns when it waits at the owner.
  void Begin() {
    other_.catalog->async()->CheckMap(
        &context_, &request_, &response_,
        [this](const grpc::Status& status) { ended_.set_value(status); });
    EXPECT_TRUE(Eventually([&] { return owner_.meters().Read(Rpc::kCheckMap).began == 1; }));
  }
  grpc::StatusCode CodeOfEnd() { return ended_.get_future().get().error_code(); }
  // Whether the call ends on both servers, although the writer still waits. A server that is told
  // of the cancellation before it looks at the deadline takes a late call for a cancelled one.
  bool EndsOnBoth() {
    const auto has_ended = [](const TestServer& server) {
      return Ended(server, Rpc::kCheckMap, absl::StatusCode::kCancelled) +
                 Ended(server, Rpc::kCheckMap, absl::StatusCode::kDeadlineExceeded) ==
             1;
    };
    return Eventually([&] { return has_ended(owner_) && has_ended(other_); });
  }

  grpc::ClientContext context_;

 private:
  v1::ApplyEditsResponse put_;
  std::future<grpc::Status> held_;
  v1::CheckMapRequest request_;
  v1::CheckMapResponse response_;
  std::promise<grpc::Status> ended_;
};

TEST_F(ForwardedWaitTest, ACancelledCallIsCancelledAtTheOwner) {
  Begin();
  context_.TryCancel();
  EXPECT_EQ(CodeOfEnd(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(EndsOnBoth());
}

TEST_F(ForwardedWaitTest, ACallToAFormerOwnerThatDoesNotAnswerIsUnavailable) {
  Begin();
  SetOwner(other_, std::nullopt);
  EXPECT_EQ(CodeOfEnd(), grpc::StatusCode::UNAVAILABLE);
}

// While a map is replaced by a backup, other servers do not have it.
TEST_F(ForwardedWaitTest, ARestorationGoesOnWhileNobodyIsKnownToOwnTheMap) {
  grpc::ClientContext context;
  v1::RestoreMapResponse restored;
  const auto writer = other_.catalog->RestoreMap(&context, &restored);
  v1::RestoreMapRequest request;
  request.mutable_header()->set_map("site");
  request.mutable_header()->set_replace(true);
  ASSERT_TRUE(writer->Write(request));
  EXPECT_TRUE(Eventually([&] { return owner_.meters().Read(Rpc::kRestoreMap).began == 1; }));
  Begin();
  EXPECT_EQ(other_.site().Delete("site", ""), absl::OkStatus());
  EXPECT_EQ(CodeOfEnd(), grpc::StatusCode::UNAVAILABLE);
  request.set_data("no map");
  EXPECT_TRUE(writer->Write(request));
  EXPECT_TRUE(writer->WritesDone());
  // The owner's answer: its store has no files.
  EXPECT_EQ(writer->Finish().error_code(), grpc::StatusCode::UNIMPLEMENTED);
}

TEST_F(ForwardedObserveTest, AStreamToAFormerOwnerIsUnavailable) {
  v1::ObserveResponse response;
  ASSERT_TRUE(stream_->Read(&response));
  SetOwner(other_, "127.0.0.1:1");
  EXPECT_FALSE(stream_->Read(&response));
  const grpc::Status status = stream_->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(status.error_message(), HasSubstr("no longer owned by the server at"));
  EXPECT_TRUE(HoldsNothing(other_));
  EXPECT_TRUE(HoldsNothing(owner_));
}

TEST_F(ForwardedWaitTest, TheDeadlineIsThatOfTheCaller) {
  context_.set_deadline(absl::ToChronoTime(absl::Now() + absl::Milliseconds(300)));
  Begin();
  EXPECT_EQ(CodeOfEnd(), grpc::StatusCode::DEADLINE_EXCEEDED);
  EXPECT_TRUE(EndsOnBoth());
}

TEST_F(ForwardingTest, MessagesOfAnySizeThatIsAdmittedArePassedOn) {
  constexpr size_t kMost = 1 << 20;
  v1::ApplyEditsRequest request = PutCup("");
  (*request.mutable_edits(0)->mutable_put_object()->mutable_object()->mutable_attributes())["text"]
      .set_string_value(std::string(900, 'x'));
  while (request.ByteSizeLong() < kMost - 1100) *request.add_edits() = request.edits(0);
  v1::ApplyEditsResponse response;
  grpc::Status status = Apply(other_, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.object_ids_size(), request.edits_size());
  EXPECT_EQ(Forwarded(other_, Rpc::kApplyEdits), 1);
  EXPECT_TRUE(HoldsNothing(other_));
  while (request.ByteSizeLong() <= kMost) *request.add_edits() = request.edits(0);
  status = Apply(other_, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(Forwarded(other_, Rpc::kApplyEdits), 1);
}

TEST_F(ForwardingTest, AnOwnerThatIsGoneIsUnavailableAtOnce) {
  owner_.Shutdown(absl::Seconds(10));
  const absl::Time begin = absl::Now();
  v1::ApplyEditsResponse response;
  const grpc::Status status = Apply(other_, PutCup(""), &response, absl::Minutes(1));
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(status.error_message(), HasSubstr(owner_.address()));
  EXPECT_LT(absl::Now() - begin, absl::Seconds(10));
  EXPECT_TRUE(HoldsNothing(other_));
}

TEST_F(ForwardingTest, AnUnknownOwnerIsAnErrorToTryAgain) {
  SetOwner(other_, "");
  v1::ApplyEditsResponse response;
  EXPECT_EQ(Apply(other_, PutCup(""), &response).error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(Forwarded(other_, Rpc::kApplyEdits), 0);
}

TEST_F(ForwardingTest, CallsDoNotRunInCircles) {
  SetOwner(owner_, other_.address());
  v1::ApplyEditsResponse response;
  const grpc::Status status = Apply(other_, PutCup(""), &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  // The call, and the hint of the supposed owner.
  EXPECT_EQ(other_.meters().Read(Rpc::kApplyEdits).began, 2);
  EXPECT_EQ(owner_.meters().Read(Rpc::kApplyEdits).began, 1);
}

TEST_F(ForwardingTest, AServerThatWasTheOwnerNamesTheNewOne) {
  TestServer third;
  third.MakeMap("site", LayerOfCups("cups", 0));
  SetOwner(owner_, third.address());
  v1::ApplyEditsResponse response;
  const grpc::Status status = Apply(other_, PutCup(""), &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.incarnation(), SessionOf(third).incarnation());
  EXPECT_EQ(SessionOf(third).snapshot()->FindLayer("cups")->Size(), 1);
}

TEST_F(ForwardingTest, RefusalsTellWhenToTryAgain) {
  v1::ApplyEditsResponse response;
  grpc::ClientContext context;
  // All of the owner's calls are taken, half of them by each of two clients.
  admission::Budget::Charge some(&owner_.budgets().calls, "first");
  admission::Budget::Charge others(&owner_.budgets().calls, "second");
  while (some.Add(1).ok() || others.Add(1).ok()) {
  }
  const grpc::Status status = other_.edit->ApplyEdits(&context, PutCup(""), &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(context.GetServerTrailingMetadata().count(kPushbackKey), 1);
  // The other server has room.
  EXPECT_FALSE(other_.budgets().refusals.IsOverloaded(absl::Minutes(1)));
}

}  // namespace
}  // namespace hypermap::server
