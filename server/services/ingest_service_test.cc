#include "server/services/ingest_service.h"

#include <gmock/gmock.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/channel_arguments.h>
#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/time/clock.h"
#include "client_libs/cpp/client.h"
#include "server/rpc/call_ticket.h"
#include "server/services/testing/test_server.h"
#include "tests/support/eventually.h"
#include "wire/observation.h"

namespace hypermap::server {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

using Outcome = client::ObservationOutcome;

Observation See(const std::string& robot, int64_t sequence, const std::string& label) {
  Observation observation;
  observation.robot = robot;
  observation.sequence = sequence;
  observation.stamp = absl::FromUnixSeconds(1'700'000'000 + sequence);
  Detection detection;
  detection.scores = {{label, 0.9}};
  detection.hull = Polygon::FromBox({{0, 0}, {1, 1}});
  observation.detections.push_back(detection);
  observation.free_space = Polygon::FromBox({{0, 0}, {2, 2}});
  return observation;
}

class IngestServiceTest : public ::testing::Test {
 protected:
  IngestServiceTest()
      : client_(server_.address()), ingest_(v1::IngestService::NewStub(server_.channel())) {
    EditBatch batch = LayerOfCups("things", 0);
    LayerSpec seen;
    seen.name = "seen";
    seen.kind = LayerKind::kExploration;
    seen.grid = GridGeometry{PlanarTransform(), 1.0};
    batch.edits.push_back(hypermap::CreateLayer{seen});
    server_.MakeMap("site", batch);
  }

  std::unique_ptr<client::ObserveStream> Open(const client::ObserveOptions& options = {}) {
    auto stream = client_.Observe("site", "things", options);
    EXPECT_TRUE(stream.ok()) << stream.status();
    return stream.ok() ? *std::move(stream) : nullptr;
  }
  absl::Status OpenError(const std::string& map, const std::string& layer,
                         const client::ObserveOptions& options = {}) {
    return client_.Observe(map, layer, options).status();
  }

  // Sends one observation, and waits for its acknowledgement.
  static client::Acknowledgement Send(client::ObserveStream& stream,
                                      const Observation& observation) {
    EXPECT_TRUE(stream.Write(observation));
    const auto acknowledgement = stream.Read();
    EXPECT_TRUE(acknowledgement.has_value()) << stream.status();
    return acknowledgement.value_or(client::Acknowledgement());
  }
  static absl::Status Close(client::ObserveStream& stream) {
    stream.WritesDone();
    EXPECT_FALSE(stream.Read().has_value());
    return stream.status();
  }

  SnapshotPtr snapshot() { return (*server_.site().Find("site"))->snapshot(); }

  TestServer server_;
  client::Client client_;
  std::unique_ptr<v1::IngestService::Stub> ingest_;
};

TEST_F(IngestServiceTest, AcceptedObservationIsVisibleAtTheRevisionThatIsTold) {
  auto stream = Open({.exploration_layer = "seen"});
  EXPECT_EQ(stream->opened().strategy, "tally");
  EXPECT_EQ(stream->opened().exploration_layer, "seen");
  const client::Acknowledgement a = Send(*stream, See("cart", 3, "chair"));
  EXPECT_EQ(a.outcome, Outcome::kAccepted) << a.message;
  EXPECT_EQ(a.robot, "cart");
  EXPECT_EQ(a.sequence, 3);
  EXPECT_EQ(a.revision, snapshot()->revision);
  EXPECT_EQ(snapshot()->FindLayer("things")->Size(), 1);
  EXPECT_EQ(snapshot()->FindLayer("seen")->Size(), 4);
  EXPECT_TRUE(Close(*stream).ok());
}

TEST_F(IngestServiceTest, ServerThatStopsEndsOpenStreams) {
  auto stream = Open();
  EXPECT_EQ(Send(*stream, See("cart", 0, "chair")).outcome, Outcome::kAccepted);
  // A stream that went on would be cut off after the grace.
  std::thread stop([&] { server_.Shutdown(absl::Minutes(1)); });
  EXPECT_FALSE(stream->Read().has_value());
  EXPECT_TRUE(absl::IsUnavailable(stream->status())) << stream->status();
  EXPECT_THAT(std::string(stream->status().message()), HasSubstr("the server is stopping"));
  stop.join();
}

// The free space is a square of 1.6 cells, from near the middle of a cell.
TEST_F(IngestServiceTest, ExploredAreTheCellsThatTheLayersRuleSelects) {
  const std::pair<CellRule, int64_t> kCells[] = {
      {CellRule::kCentre, 4}, {CellRule::kCovered, 1}, {CellRule::kTouched, 9}};
  int64_t sequence = 0;
  for (const auto& [rule, cells] : kCells) {
    LayerSpec spec;
    spec.name = std::string(CellRuleName(rule));
    spec.kind = LayerKind::kExploration;
    spec.grid = GridGeometry{PlanarTransform(), 1.0};
    spec.explored_rule = rule;
    ASSERT_TRUE(client_.CreateLayer("site", spec).ok());
    EXPECT_EQ(client_.GetLayer("site", spec.name)->spec.explored_rule, rule);
    const std::string things = spec.name + "_things";
    ASSERT_TRUE(client_.CreateLayer("site", {.name = things}).ok());
    auto stream = client_.Observe("site", things, {.exploration_layer = spec.name});
    ASSERT_TRUE(stream.ok()) << stream.status();
    Observation observation = See("cart", ++sequence, "chair");
    observation.free_space = Polygon::FromBox({{0.45, 0.45}, {2.05, 2.05}});
    const client::Acknowledgement a = Send(**stream, observation);
    ASSERT_EQ(a.outcome, Outcome::kAccepted) << a.message;
    int64_t explored = 0;
    auto answer = client_.QueryValue("site", "explored", std::nullopt, {.layers = {spec.name}});
    while (auto part = answer.Next()) {
      for (const CellRun& run : part->runs) explored += run.col_end - run.col_begin;
    }
    EXPECT_TRUE(answer.status().ok()) << answer.status();
    EXPECT_EQ(explored, cells) << spec.name;
    EXPECT_TRUE(Close(**stream).ok());
  }
}

TEST_F(IngestServiceTest, OneThatIsNotTakenDoesNotEndTheStream) {
  auto stream = Open();
  Send(*stream, See("a", 1, "chair"));
  EXPECT_EQ(Send(*stream, See("a", 1, "chair")).outcome, Outcome::kDuplicate);
  EXPECT_EQ(Send(*stream, See("a", 1, "table")).outcome, Outcome::kConflict);
  Observation bad = See("a", 2, "chair");
  bad.detections[0].weight = 0.0;
  const client::Acknowledgement invalid = Send(*stream, bad);
  EXPECT_EQ(invalid.outcome, Outcome::kInvalid);
  EXPECT_THAT(invalid.message, HasSubstr("detections[0].weight"));
  Send(*stream, See("a", 5000, "chair"));
  EXPECT_EQ(Send(*stream, See("a", 3, "chair")).outcome, Outcome::kRefusedLate);
  EXPECT_EQ(Send(*stream, See("a", 5001, "chair")).outcome, Outcome::kAccepted);
  EXPECT_TRUE(Close(*stream).ok());
}

TEST_F(IngestServiceTest, C2ClockOfOneRobotMakesOthersNotLateAndItsSkewIsTold) {
  auto stream = Open();
  Observation rogue = See("rogue", 1, "chair");
  rogue.stamp = absl::Now() + absl::Minutes(9) + absl::Seconds(58);
  const client::Acknowledgement ahead = Send(*stream, rogue);
  EXPECT_EQ(ahead.outcome, Outcome::kAccepted) << ahead.message;
  ASSERT_TRUE(ahead.clock_skew_s.has_value());
  EXPECT_GT(*ahead.clock_skew_s, 0.0);
  EXPECT_LE(*ahead.clock_skew_s, 598.0);
  Observation honest = See("cart", 1, "chair");
  honest.stamp = absl::Now() - absl::Seconds(30);
  const client::Acknowledgement behind = Send(*stream, honest);
  EXPECT_EQ(behind.outcome, Outcome::kAccepted) << behind.message;
  ASSERT_TRUE(behind.clock_skew_s.has_value());
  EXPECT_LE(*behind.clock_skew_s, -30.0);
  EXPECT_FALSE(Send(*stream, honest).clock_skew_s.has_value());
  EXPECT_TRUE(Close(*stream).ok());
}

TEST_F(IngestServiceTest, SeveralInOneRequestAreEachAcknowledged) {
  auto stream = Open();
  std::vector<Observation> several;
  for (int i = 0; i < 10; ++i) several.push_back(See("a", i, "chair"));
  several[4].robot = "";
  ASSERT_TRUE(stream->Write(several));
  int accepted = 0;
  for (int i = 0; i < 10; ++i) {
    const auto a = stream->Read();
    ASSERT_TRUE(a.has_value()) << stream->status();
    accepted += a->outcome == Outcome::kAccepted ? 1 : 0;
  }
  EXPECT_EQ(accepted, 9);
  EXPECT_TRUE(Close(*stream).ok());
}

TEST_F(IngestServiceTest, ManyMoreThanAreInFlightAreAllAcknowledgedBeforeTheStreamEnds) {
  auto stream = Open();
  constexpr int kObservations = 500;
  std::thread writer([&] {
    for (int i = 0; i < kObservations; ++i) EXPECT_TRUE(stream->Write(See("a", i, "chair")));
    stream->WritesDone();
  });
  std::set<int64_t> acknowledged;
  while (const auto a = stream->Read()) acknowledged.insert(a->sequence);
  writer.join();
  EXPECT_TRUE(stream->status().ok()) << stream->status();
  EXPECT_THAT(acknowledged, SizeIs(kObservations));
}

TEST_F(IngestServiceTest, AcknowledgementsThatNobodyReadsStopTheStreamUntilTheyAreRead) {
  constexpr int kRequests = 400;
  grpc::ClientContext context;
  const auto stream = ingest_->Observe(&context);
  v1::ObserveRequest request;
  request.mutable_opening()->set_map("site");
  request.mutable_opening()->set_layer("things");
  ASSERT_TRUE(stream->Write(request));
  request.Clear();
  // They lack all fields, so that each takes two bytes.
  for (int i = 0; i < 500; ++i) request.add_observations();
  std::thread writer([&] {
    for (int i = 0; i < kRequests; ++i) EXPECT_TRUE(stream->Write(request));
    stream->WritesDone();
  });
  const auto used = [this] { return server_.budgets().request_bytes.used(); };
  EXPECT_TRUE(testing::Eventually([&] { return used() > 900 << 10; }));
  EXPECT_LT(used(), 2 << 20);
  int acknowledged = 0;
  for (v1::ObserveResponse response; stream->Read(&response);) {
    EXPECT_LT(used(), 2 << 20);
    acknowledged += response.acknowledgements_size();
  }
  writer.join();
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(acknowledged, 500 * kRequests);
  EXPECT_TRUE(testing::Eventually([&] { return used() == 0; }));
}

// Stamps are so far apart that an observation would be refused as late if a newer one came first.
TEST_F(IngestServiceTest, ObservationsAreJudgedInTheOrderOfTheStream) {
  auto stream = Open();
  constexpr int kObservations = 500;
  std::thread writer([&] {
    for (int i = 0; i < kObservations; ++i) EXPECT_TRUE(stream->Write(See("a", 700 * i, "chair")));
    stream->WritesDone();
  });
  int accepted = 0;
  while (const auto a = stream->Read()) accepted += a->outcome == Outcome::kAccepted ? 1 : 0;
  writer.join();
  EXPECT_TRUE(stream->status().ok()) << stream->status();
  EXPECT_EQ(accepted, kObservations);
}

TEST_F(IngestServiceTest, OpeningTellsWhatTheLayerHasOfTheRobot) {
  {
    auto stream = Open();
    for (const int64_t sequence : {0, 1, 2, 5, 7, 8}) {
      Send(*stream, See("cart", sequence, "chair"));
    }
    Send(*stream, See("lift", 3, "chair"));
    ASSERT_TRUE(Close(*stream).ok());
  }
  auto stream = Open({.robot = "cart"});
  const client::OpenedLayer& opened = stream->opened();
  ASSERT_THAT(opened.known, SizeIs(3));
  for (const int64_t sequence : {0, 1, 2, 5, 7, 8}) EXPECT_TRUE(opened.Knows(sequence));
  for (const int64_t sequence : {-1, 3, 4, 6, 9}) EXPECT_FALSE(opened.Knows(sequence));
}

TEST_F(IngestServiceTest, OpeningThatCannotBeNamesTheReason) {
  EXPECT_TRUE(absl::IsNotFound(OpenError("nowhere", "things")));
  EXPECT_TRUE(absl::IsNotFound(OpenError("site", "nowhere")));
  EXPECT_TRUE(absl::IsFailedPrecondition(OpenError("site", "seen")));
  EXPECT_TRUE(absl::IsNotFound(OpenError("site", "things", {.exploration_layer = "nowhere"})));
  EXPECT_TRUE(
      absl::IsFailedPrecondition(OpenError("site", "things", {.exploration_layer = "things"})));
  EXPECT_TRUE(absl::IsInvalidArgument(OpenError("site", "things", {.strategy = "none"})));
  Open();
  EXPECT_TRUE(absl::IsFailedPrecondition(OpenError("site", "things", {.strategy = "other"})));
}

TEST_F(IngestServiceTest, StreamThatDoesNotOpenOrOpensTwiceIsEnded) {
  v1::ObserveRequest opening;
  opening.mutable_opening()->set_map("site");
  opening.mutable_opening()->set_layer("things");
  for (const int openings : {0, 2}) {
    grpc::ClientContext context;
    const auto stream = ingest_->Observe(&context);
    v1::ObserveResponse response;
    for (int i = 0; i < openings; ++i) stream->Write(opening);
    if (openings == 0) stream->Write(v1::ObserveRequest());
    while (stream->Read(&response)) {
    }
    const grpc::Status status = stream->Finish();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(status.error_message(), HasSubstr("opening"));
  }
}

TEST_F(IngestServiceTest, FailedWriteEndsTheStreamAndWhatIsSentAgainCountsOnce) {
  auto stream = Open();
  Send(*stream, See("a", 0, "chair"));
  server_.disk().FailWrites(absl::ResourceExhaustedError("disk full"));
  EXPECT_TRUE(stream->Write(See("a", 1, "chair")));
  EXPECT_FALSE(stream->Read().has_value());
  EXPECT_TRUE(absl::IsResourceExhausted(stream->status())) << stream->status();
  server_.disk().FailWrites(absl::OkStatus());
  stream = Open();
  EXPECT_EQ(Send(*stream, See("a", 0, "chair")).outcome, Outcome::kDuplicate);
  EXPECT_EQ(Send(*stream, See("a", 1, "chair")).outcome, Outcome::kAccepted);
}

TEST_F(IngestServiceTest, CallerThatGoesAwayHarmsNobody) {
  server_.disk().Hold();
  // The opening waits for the disk longer than the caller does.
  const absl::Status status =
      client_.Observe("site", "things", {}, {.timeout = absl::Milliseconds(50)}).status();
  EXPECT_TRUE(absl::IsDeadlineExceeded(status)) << status;
  server_.disk().Release();
  {
    auto stream = Open();
    for (int i = 0; i < 100; ++i) stream->Write(See("a", i, "chair"));
  }
  auto stream = Open();
  EXPECT_EQ(Send(*stream, See("b", 50, "table")).outcome, Outcome::kAccepted);
}

TEST_F(IngestServiceTest, LayerIsRebuiltRetractedAndExplained) {
  auto stream = Open();
  Send(*stream, See("a", 0, "chair"));
  Send(*stream, See("b", 1, "chair"));
  Send(*stream, See("b", 2, "table"));
  const auto history = client_.ExplainObject("site", "things", 1);
  ASSERT_TRUE(history.ok()) << history.status();
  EXPECT_EQ(history->track, "a/0/0");
  EXPECT_EQ(history->strategy, "tally");
  ASSERT_THAT(history->events, SizeIs(2));
  EXPECT_EQ(history->events[0].kind, client::ObjectEventKind::kFounded);
  EXPECT_EQ(history->events[1].kind, client::ObjectEventKind::kSeen);
  EXPECT_EQ(history->events[1].at.robot, "b");
  EXPECT_EQ(history->events[1].at.stamp, absl::FromUnixSeconds(1'700'000'001));
  EXPECT_EQ(history->events[1].existence, 1.0);
  EXPECT_TRUE(absl::IsNotFound(client_.ExplainObject("site", "things", 77).status()));
  EXPECT_TRUE(absl::IsFailedPrecondition(client_.ExplainObject("site", "seen", 1).status()));

  const Revision before = snapshot()->revision;
  EXPECT_EQ(*client_.RebuildLayer("site", "things", "other", ""), before + 1);
  const client::CallOptions again{.request_id = "r1"};
  const auto retracted = client_.RetractSource("site", "things", "b", absl::InfinitePast(),
                                               absl::InfiniteFuture(), again);
  EXPECT_EQ(*retracted, before + 2);
  EXPECT_EQ(snapshot()->FindLayer("things")->Size(), 1);
  EXPECT_EQ(*client_.RetractSource("site", "things", "b", absl::InfinitePast(),
                                   absl::InfiniteFuture(), again),
            before + 2);
  EXPECT_TRUE(absl::IsNotFound(client_.RetractSource("site", "things", "b").status()));
  EXPECT_TRUE(absl::IsFailedPrecondition(client_.RebuildLayer("site", "seen", "", "").status()));
}

// A robot of which the layer has so many ranges of sequences that the answer to an opening is
// large, and a client that receives little ahead of its readers.
class LargeOpeningTest : public ::testing::Test {
 protected:
  static constexpr int kRanges = 20'000;
  // About the size of the encoded answer: the sequences are so large that each takes nine bytes.
  static constexpr int64_t kAnswerBytes = 22 * kRanges;

  LargeOpeningTest() : server_(SmallLimits()) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 1024);
    arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
    ingest_ = v1::IngestService::NewStub(grpc::CreateCustomChannel(
        server_.address(), grpc::InsecureChannelCredentials(), arguments));
    server_.MakeMap("site", LayerOfCups("things", 0));
    const std::shared_ptr<MapSession> session = *server_.site().Find("site");
    EXPECT_TRUE(session->RunAndWait(FusionSubmission{StartFusion{"things", {}}, "test", ""}).ok());
    ObservationSubmission submission{"things", {}, "test"};
    for (int64_t i = 0; i < kRanges; ++i) {
      Observation observation;
      observation.robot = "cart";
      observation.sequence = (int64_t{1} << 62) + 2 * i;
      observation.stamp = absl::FromUnixSeconds(1'700'000'000);
      submission.observations.push_back(std::move(observation));
    }
    const auto stored = std::make_shared<std::promise<absl::Status>>();
    session->Observe(std::move(submission),
                     [stored](const absl::StatusOr<std::vector<ObservationVerdict>>& verdicts) {
                       stored->set_value(verdicts.status());
                     });
    EXPECT_TRUE(stored->get_future().get().ok());
  }

  static Limits SmallLimits() {
    Limits limits;
    // One client address gets half of it.
    limits.max_request_bytes = 8 << 20;
    return limits;
  }

  // Opens a stream that names the robot.
  std::unique_ptr<grpc::ClientReaderWriter<v1::ObserveRequest, v1::ObserveResponse>> Open(
      grpc::ClientContext* context) {
    auto stream = ingest_->Observe(context);
    v1::ObserveRequest request;
    request.mutable_opening()->set_map("site");
    request.mutable_opening()->set_layer("things");
    request.mutable_opening()->set_robot("cart");
    EXPECT_TRUE(stream->Write(request));
    return stream;
  }
  int64_t used() { return server_.budgets().request_bytes.used(); }
  int64_t refused() { return server_.budgets().refusals.NumOf("--max_request_bytes"); }

  TestServer server_;
  std::unique_ptr<v1::IngestService::Stub> ingest_;
};

TEST_F(LargeOpeningTest, AnswerIsChargedUntilItIsRead) {
  grpc::ClientContext context;
  const auto stream = Open(&context);
  const int64_t charged = kAnswerBytes - CallTicket::kFreeAnswerBytes;
  EXPECT_TRUE(testing::Eventually(
      [&] { return used() > charged - (8 << 10) && used() < charged + (8 << 10); }));
  v1::ObserveResponse response;
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(response.opened().known_size(), kRanges);
  EXPECT_TRUE(testing::Eventually([&] { return used() == 0; }));
  stream->WritesDone();
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(LargeOpeningTest, AnswersThatNobodyReadsAreRefusedBeforeTheyAreMade) {
  constexpr size_t kMaxStreams = 20;
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<decltype(Open(nullptr))> streams;
  while (streams.size() < kMaxStreams && refused() == 0) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    streams.push_back(Open(contexts.back().get()));
    const int64_t held = static_cast<int64_t>(streams.size()) * (kAnswerBytes - (32 << 10));
    EXPECT_TRUE(testing::Eventually([&] { return used() > held || refused() > 0; }));
  }
  EXPECT_LT(streams.size(), kMaxStreams);
  int num_opened = 0;
  for (const auto& stream : streams) {
    v1::ObserveResponse response;
    const bool opened = stream->Read(&response);
    stream->WritesDone();
    EXPECT_FALSE(opened && stream->Read(&response));
    const grpc::Status status = stream->Finish();
    if (opened) {
      ++num_opened;
      EXPECT_TRUE(status.ok()) << status.error_message();
    } else {
      EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
      EXPECT_THAT(status.error_message(), HasSubstr("--max_request_bytes"));
    }
  }
  EXPECT_GT(num_opened, 0);
  EXPECT_LT(num_opened, static_cast<int>(streams.size()));
  EXPECT_TRUE(testing::Eventually([&] { return used() == 0; }));
}

}  // namespace
}  // namespace hypermap::server
