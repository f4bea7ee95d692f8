// Tests of the QueryPoints rpc.
#include "server/services/points_call.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "server/services/testing/test_server.h"
#include "tests/support/random_map.h"
#include "wire/answer.h"
#include "wire/geometry.h"
#include "wire/scope.h"

namespace hypermap::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

v1::QueryPointsRequest Opening(const std::string& map, const Scope& scope = {},
                               const AsOf& as_of = {}) {
  v1::QueryPointsRequest request;
  wire::EncodeScope(map, scope, request.mutable_opening()->mutable_scope());
  wire::EncodeAsOf(as_of, request.mutable_opening()->mutable_as_of());
  return request;
}

v1::QueryPointsRequest Batch(absl::Span<const Point> points) {
  v1::QueryPointsRequest request;
  wire::EncodePoints(points, &request);
  return request;
}

// Adds a field that the server does not know, so that the request is too large for gRPC's thread.
v1::QueryPointsRequest Padded(v1::QueryPointsRequest request) {
  request.GetReflection()->MutableUnknownFields(&request)->AddLengthDelimited(
      15, std::string(100'000, 'x'));
  return request;
}

// A client's side of a stream.
class Stream {
 public:
  explicit Stream(TestServer& server) : stream_(server.query->QueryPoints(&context_)) {}
  explicit Stream(TestServer& server, std::chrono::milliseconds timeout) {
    context_.set_deadline(std::chrono::system_clock::now() + timeout);
    stream_ = server.query->QueryPoints(&context_);
  }
  ~Stream() {
    if (!finished_) context_.TryCancel(), stream_->Finish();
  }

  bool Write(const v1::QueryPointsRequest& request) { return stream_->Write(request); }
  void WritesDone() { stream_->WritesDone(); }
  bool Read(v1::QueryPointsResponse* response) { return stream_->Read(response); }
  v1::QueryPointsResponse Ask(absl::Span<const Point> points) {
    v1::QueryPointsResponse response;
    EXPECT_TRUE(Write(Batch(points)));
    EXPECT_TRUE(Read(&response));
    return response;
  }
  void Cancel() { context_.TryCancel(); }
  // Reads the remaining answers.
  grpc::Status Finish() {
    v1::QueryPointsResponse response;
    while (Read(&response)) ++num_left_;
    finished_ = true;
    return stream_->Finish();
  }
  int num_left() const { return num_left_; }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::QueryPointsRequest, v1::QueryPointsResponse>>
      stream_;
  bool finished_ = false;
  int num_left_ = 0;
};

// The map "site" with the layers "cups" and "cells", at revision 1.
class PointsCallTest : public ::testing::Test {
 protected:
  static Limits SmallLimits() {
    Limits limits;
    limits.max_points = 20'000;
    return limits;
  }

  PointsCallTest() : server_(SmallLimits()) {
    EditBatch batch = LayerOfCups("cups", 10);
    const EditBatch cells = LayerOfCells("cells", 2, 4);
    batch.edits.insert(batch.edits.end(), cells.edits.begin(), cells.edits.end());
    server_.MakeMap("site", std::move(batch));
  }

  MapSession& session() { return **server_.site().Find("site"); }
  Revision Edit(hypermap::Edit edit) {
    const auto receipt = session().SubmitAndWait({{{std::move(edit)}}, "test", ""});
    EXPECT_TRUE(receipt.ok()) << receipt.status();
    return receipt.ok() ? receipt->revision : 0;
  }
  static hypermap::PutObject Cup(double x, const std::string& label = "cup") {
    hypermap::PutObject put{"cups", {}, ""};
    put.object.label = label;
    put.object.shape = Polygon::FromBox({{x, 0}, {x + 1, 1}});
    return put;
  }

  // The error of a stream to which all of `requests` are sent.
  grpc::Status Error(const std::vector<v1::QueryPointsRequest>& requests) {
    Stream stream(server_);
    for (const v1::QueryPointsRequest& request : requests) stream.Write(request);
    stream.WritesDone();
    return stream.Finish();
  }

  TestServer server_;
};

TEST_F(PointsCallTest, EachBatchIsAnsweredByEveryLayer) {
  Stream stream(server_);
  v1::QueryPointsRequest first = Opening("site");
  first.MergeFrom(Batch({{0.5, 0.5}, {1.5, 0.5}, {-1, 0}, {2.5, 0.5}}));
  ASSERT_TRUE(stream.Write(first));
  v1::QueryPointsResponse response;
  ASSERT_TRUE(stream.Read(&response));
  EXPECT_EQ(response.revision(), 1);
  EXPECT_THAT(response.new_labels(), ElementsAre("cup"));
  ASSERT_EQ(response.layers_size(), 2);
  const v1::PointsContent& cells = response.layers(0);
  EXPECT_EQ(cells.layer(), "cells");
  EXPECT_EQ(cells.kind(), v1::LAYER_KIND_OCCUPANCY);
  EXPECT_THAT(cells.statuses(), ElementsAre(v1::ANSWER_STATUS_VALUE, v1::ANSWER_STATUS_VALUE,
                                            v1::ANSWER_STATUS_OUTSIDE, v1::ANSWER_STATUS_VALUE));
  EXPECT_THAT(cells.values(), ElementsAre(0.0, 1.0, ::testing::IsNan(), 0.0));
  const v1::PointsContent& cups = response.layers(1);
  EXPECT_EQ(cups.layer(), "cups");
  EXPECT_THAT(cups.points(), ElementsAre(0, 3));
  EXPECT_THAT(cups.object_ids(), ElementsAre(1, 2));
  EXPECT_THAT(cups.labels(), ElementsAre(0, 0));
  EXPECT_THAT(cups.existences(), ElementsAre(1.0F, 1.0F));

  const v1::QueryPointsResponse second = stream.Ask({{4.5, 0.5}});
  EXPECT_EQ(second.new_labels_size(), 0);
  EXPECT_THAT(second.layers(1).object_ids(), ElementsAre(3));
  stream.WritesDone();
  EXPECT_TRUE(stream.Finish().ok());
}

TEST_F(PointsCallTest, BatchesWithoutPointsAreNotAnswered) {
  Stream stream(server_);
  ASSERT_TRUE(stream.Write(Opening("site")));
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(stream.Write({}));
  EXPECT_THAT(stream.Ask({{0.5, 0.5}}).layers(1).object_ids(), ElementsAre(1));
  ASSERT_TRUE(stream.Write({}));
  stream.WritesDone();
  EXPECT_TRUE(stream.Finish().ok());
  EXPECT_EQ(stream.num_left(), 0);
}

TEST_F(PointsCallTest, AfterTheLastBatchAllAnswersComeInOrder) {
  Stream stream(server_);
  ASSERT_TRUE(stream.Write(Opening("site", {{"cups"}, ""})));
  std::thread writer([&] {
    for (int i = 0; i < 300; ++i) EXPECT_TRUE(stream.Write(Batch({{2.0 * (i % 10), 0.5}})));
    stream.WritesDone();
  });
  v1::QueryPointsResponse response;
  int answers = 0;
  for (; stream.Read(&response); ++answers) {
    ASSERT_THAT(response.layers(0).object_ids(), ElementsAre(answers % 10 + 1));
  }
  writer.join();
  EXPECT_EQ(answers, 300);
  EXPECT_TRUE(stream.Finish().ok());
}

TEST_F(PointsCallTest, LargeBatchesAreAnsweredLikeSmallOnes) {
  std::vector<Point> points;
  for (int i = 0; i < 20'000; ++i) points.push_back({i % 7 == 0 ? 0.5 : 1.5, 0.5});
  Stream stream(server_);
  ASSERT_TRUE(stream.Write(Opening("site", {{"cups"}, ""})));
  const v1::QueryPointsResponse response = stream.Ask(points);
  const v1::PointsContent& cups = response.layers(0);
  ASSERT_EQ(cups.points_size(), 2858);
  for (int i = 0; i < cups.points_size(); ++i) ASSERT_EQ(cups.points(i), 7u * i);
}

TEST_F(PointsCallTest, LargeMessagesAreTakenInTheOrderOfTheStream) {
  const std::vector<std::string> many_names(1000, "cups");
  for (const Scope& scope : {Scope{{"cups"}, ""}, Scope{many_names, ""}}) {
    Stream stream(server_);
    ASSERT_TRUE(stream.Write(Padded(Opening("site", scope))));
    for (int i = 0; i < 8; ++i) {
      const v1::QueryPointsRequest batch = Batch({{2.0 * i, 0.5}});
      ASSERT_TRUE(stream.Write(i % 2 == 0 ? batch : Padded(batch)));
    }
    for (int i = 0; i < 8; ++i) {
      v1::QueryPointsResponse response;
      ASSERT_TRUE(stream.Read(&response));
      ASSERT_EQ(response.layers_size(), 1);
      EXPECT_THAT(response.layers(0).object_ids(), ElementsAre(i + 1));
    }
    stream.WritesDone();
    EXPECT_TRUE(stream.Finish().ok());
  }
  EXPECT_EQ(Error({Padded(Batch({{1, 2}}))}).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(Error({Padded(Opening("site")), Padded(Opening("site"))}).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(PointsCallTest, ALargeOpeningWaitsForTheRevisionItNeeds) {
  Stream stream(server_);
  v1::QueryPointsRequest first = Opening("site", {{"cups"}, ""}, {.min_revision = 2});
  first.MergeFrom(Batch({{30.5, 0.5}}));
  ASSERT_TRUE(stream.Write(Padded(first)));
  Edit(Cup(30));
  v1::QueryPointsResponse response;
  ASSERT_TRUE(stream.Read(&response));
  EXPECT_EQ(response.revision(), 2);
  EXPECT_THAT(response.layers(0).object_ids(), ElementsAre(11));
}

TEST_F(PointsCallTest, WrongStreamsGetAnErrorThatNamesWhatIsWrong) {
  const v1::QueryPointsRequest batch = Batch({{1, 2}});
  v1::QueryPointsRequest nan = Batch({{1, 2}, {1, std::nan("")}});
  v1::QueryPointsRequest lengths = batch;
  lengths.add_xs(1);
  v1::QueryPointsRequest negative = Opening("site");
  negative.mutable_opening()->mutable_as_of()->set_min_revision(-1);
  const struct {
    std::vector<v1::QueryPointsRequest> requests;
    grpc::StatusCode code;
    const char* message;
  } cases[] = {
      {{}, grpc::StatusCode::INVALID_ARGUMENT, "the stream was not opened"},
      {{batch}, grpc::StatusCode::INVALID_ARGUMENT, "the first message must carry the opening"},
      {{{}}, grpc::StatusCode::INVALID_ARGUMENT, "the first message must carry the opening"},
      {{Opening("site"), Opening("site")}, grpc::StatusCode::INVALID_ARGUMENT, "opening may come"},
      {{Opening("")}, grpc::StatusCode::INVALID_ARGUMENT, "map is empty"},
      {{Opening("../site")}, grpc::StatusCode::INVALID_ARGUMENT, "map must"},
      {{Opening("attic")}, grpc::StatusCode::NOT_FOUND, "attic"},
      {{Opening("site", {{"floor"}, ""})}, grpc::StatusCode::NOT_FOUND, "floor"},
      {{Opening("site", {{}, "moon"})}, grpc::StatusCode::NOT_FOUND, "moon"},
      {{Opening("site", {std::vector<std::string>(1001, "cups"), ""})},
       grpc::StatusCode::RESOURCE_EXHAUSTED,
       "scope.layers has 1001 entries, and --max_layers is 1000"},
      {{Opening("site", {std::vector<std::string>(200'000, ""), ""})},
       grpc::StatusCode::RESOURCE_EXHAUSTED,
       "--max_layers"},
      {{negative}, grpc::StatusCode::INVALID_ARGUMENT, "min_revision is negative"},
      {{Opening("site"), nan}, grpc::StatusCode::INVALID_ARGUMENT, "ys[1] is not finite"},
      {{Opening("site"), lengths}, grpc::StatusCode::INVALID_ARGUMENT, "ys has 1 entries"},
      {{Opening("site"), Batch(std::vector<Point>(20'001))},
       grpc::StatusCode::RESOURCE_EXHAUSTED,
       "--max_points"},
      {{Opening("site", {}, {.revision = 2}), batch}, grpc::StatusCode::OUT_OF_RANGE, "is 1"},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.message);
    const grpc::Status status = Error(c.requests);
    EXPECT_EQ(status.error_code(), c.code);
    EXPECT_THAT(status.error_message(), HasSubstr(c.message));
  }
}

TEST_F(PointsCallTest, AnAnswerThatIsTooLargeToSendEndsTheStreamSayingSo) {
  EditBatch batch = LayerOfCups("many", 0);
  for (int i = 0; i < 10; ++i) {
    hypermap::PutObject put{"many", {}, ""};
    put.object.label = "rug";
    put.object.shape = Polygon::FromBox({{0, 0}, {1, 1}});
    batch.edits.push_back(std::move(put));
  }
  server_.MakeMap("heap", std::move(batch));
  Stream stream(server_);
  ASSERT_TRUE(stream.Write(Opening("heap")));
  ASSERT_TRUE(stream.Write(Batch(std::vector<Point>(20'000, {0.5, 0.5}))));
  const grpc::Status status = stream.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
}

TEST_F(PointsCallTest, EachBatchIsAnsweredAtTheNewestRevisionOfItsTime) {
  Stream stream(server_);
  ASSERT_TRUE(stream.Write(Opening("site", {{"cups"}, ""})));
  EXPECT_EQ(stream.Ask({{30.5, 0.5}}).layers(0).points_size(), 0);
  const Revision revision = Edit(Cup(30, "bowl"));
  const v1::QueryPointsResponse response = stream.Ask({{30.5, 0.5}});
  EXPECT_EQ(response.revision(), revision);
  EXPECT_THAT(response.layers(0).object_ids(), ElementsAre(11));
  EXPECT_THAT(response.new_labels(), ElementsAre("bowl"));
  ASSERT_TRUE(server_.site().Delete("site", "").ok());
  stream.Write(Batch({{1, 1}}));
  EXPECT_EQ(stream.Finish().error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(PointsCallTest, AStreamOfThePastStaysThere) {
  Edit(Cup(30, "bowl"));
  for (const Revision revision : {1, 2}) {
    SCOPED_TRACE(revision);
    Stream stream(server_);
    ASSERT_TRUE(stream.Write(Opening("site", {{"cups", "cells"}, ""}, {.revision = revision})));
    for (int i = 0; i < 3; ++i) {
      const v1::QueryPointsResponse response = stream.Ask({{30.5, 0.5}, {0.5, 0.5}, {40.5, 0.5}});
      EXPECT_EQ(response.revision(), revision);
      EXPECT_EQ(response.layers(0).points_size(), revision);
      EXPECT_THAT(response.layers(1).values(),
                  ElementsAre(::testing::IsNan(), 0.0, ::testing::IsNan()));
      Edit(Cup(40));
    }
  }
  Stream stream(server_);
  ASSERT_TRUE(stream.Write(Opening("site", {{"cups"}, ""}, {.time = absl::Now()})));
  const Revision then = stream.Ask({{0.5, 0.5}}).revision();
  EXPECT_EQ(then, 8);
  Edit(Cup(50));
  EXPECT_EQ(stream.Ask({{0.5, 0.5}}).revision(), then);
  stream.WritesDone();
  EXPECT_TRUE(stream.Finish().ok());
}

TEST_F(PointsCallTest, WaitsForTheRevisionItNeeds) {
  Stream stream(server_);
  v1::QueryPointsRequest first = Opening("site", {{"cups"}, ""}, {.min_revision = 2});
  first.MergeFrom(Batch({{30.5, 0.5}}));
  ASSERT_TRUE(stream.Write(first));
  ASSERT_TRUE(stream.Write(Batch({{0.5, 0.5}})));
  Edit(Cup(30));
  v1::QueryPointsResponse response;
  ASSERT_TRUE(stream.Read(&response));
  EXPECT_EQ(response.revision(), 2);
  EXPECT_THAT(response.layers(0).object_ids(), ElementsAre(11));
  ASSERT_TRUE(stream.Read(&response));
  EXPECT_THAT(response.layers(0).object_ids(), ElementsAre(1));
}

TEST_F(PointsCallTest, WaitsForTheRevisionThatWasSeen) {
  const uint64_t incarnation = (*server_.site().Find("site"))->incarnation();
  const auto begin = [&](Revision seen) {
    v1::QueryPointsRequest first =
        Opening("site", {{"cups"}, ""}, {.seen_revision = seen, .seen_incarnation = incarnation});
    first.MergeFrom(Batch({{30.5, 0.5}}));
    return first;
  };
  Stream stream(server_);
  ASSERT_TRUE(stream.Write(begin(2)));
  Edit(Cup(30));
  v1::QueryPointsResponse response;
  ASSERT_TRUE(stream.Read(&response));
  EXPECT_EQ(response.revision(), 2);

  Stream too_early(server_);
  ASSERT_TRUE(too_early.Write(begin(99)));
  EXPECT_FALSE(too_early.Read(&response));
  EXPECT_EQ(too_early.Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(PointsCallTest, EndsAtTheDeadlineAlsoWhileItWaits) {
  Stream waiting(server_, std::chrono::milliseconds(50));
  waiting.Write(Opening("site", {}, {.min_revision = 99}));
  EXPECT_EQ(waiting.Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  Stream idle(server_, std::chrono::milliseconds(50));
  idle.Write(Opening("site"));
  EXPECT_EQ(idle.Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
}

TEST_F(PointsCallTest, CancelledStreamsEndAtAnyPoint) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(absl::StrCat("HYPERMAP_TEST_SEED=", seed));
  hypermap::testing::Rng rng(seed);
  for (int i = 0; i < 60; ++i) {
    Stream stream(server_);
    const bool waits = rng() % 4 == 0;
    const v1::QueryPointsRequest opening = Opening("site", {}, {.min_revision = waits ? 99 : 0});
    if (rng() % 8 != 0) stream.Write(rng() % 2 ? opening : Padded(opening));
    const int num_batches = static_cast<int>(rng() % 4);
    for (int j = 0; j < num_batches; ++j) {
      stream.Write(Batch(std::vector<Point>(rng() % 2 ? 10 : 6000, {0.5, 0.5})));
    }
    v1::QueryPointsResponse response;
    if (num_batches > 0 && !waits && rng() % 2) stream.Read(&response);
    stream.Cancel();
    EXPECT_FALSE(stream.Finish().ok());
  }
  // The server still answers, and its destructor finds no call left.
  Stream stream(server_);
  ASSERT_TRUE(stream.Write(Opening("site")));
  EXPECT_EQ(stream.Ask({{0.5, 0.5}}).revision(), 1);
}

TEST_F(PointsCallTest, ACallerThatTakesNoAnswersIsHeldUpAndNobodyElse) {
  Stream slow(server_);
  ASSERT_TRUE(slow.Write(Opening("site")));
  constexpr int kBatches = 200;
  std::thread writer([&] {
    const std::vector<Point> points(4000, {0.5, 0.5});
    for (int i = 0; i < kBatches; ++i) EXPECT_TRUE(slow.Write(Batch(points)));
    slow.WritesDone();
  });
  Stream other(server_);
  ASSERT_TRUE(other.Write(Opening("site")));
  for (int i = 0; i < 50; ++i) EXPECT_EQ(other.Ask({{0.5, 0.5}}).revision(), 1);
  EXPECT_TRUE(slow.Finish().ok());
  EXPECT_EQ(slow.num_left(), kBatches);
  writer.join();
}

TEST_F(PointsCallTest, ShutdownEndsOpenStreams) {
  Stream idle(server_), waiting(server_), unopened(server_);
  ASSERT_TRUE(idle.Write(Opening("site")));
  idle.Ask({{0.5, 0.5}});
  ASSERT_TRUE(waiting.Write(Opening("site", {}, {.min_revision = 99})));
  // All streams share a channel: when this one is answered, the server has the others, too.
  Stream last(server_);
  ASSERT_TRUE(last.Write(Opening("site")));
  last.Ask({{0.5, 0.5}});
  server_.Shutdown(absl::InfiniteDuration());
  for (Stream* stream : {&idle, &waiting, &unopened, &last}) {
    EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  }
}

// The content of a point in a form that both QueryPoint and QueryPoints give: (layer, kind, status,
// value, objects).
using Content =
    std::tuple<std::string, int, int, double, std::vector<std::tuple<int64_t, std::string, float>>>;
constexpr double kNoValue = -1e99;

std::vector<Content> ContentOf(const v1::QueryPointResponse& response) {
  std::vector<Content> contents;
  for (const v1::LayerContent& layer : response.layers()) {
    Content content{layer.layer(),
                    layer.kind(),
                    layer.status(),
                    layer.has_value() ? layer.value() : kNoValue,
                    {}};
    for (const v1::Object& object : layer.objects()) {
      std::get<4>(content).emplace_back(object.id(), object.label(),
                                        static_cast<float>(object.existence()));
    }
    contents.push_back(std::move(content));
  }
  return contents;
}

std::vector<Content> ContentOf(const v1::QueryPointsResponse& response, uint32_t point,
                               const std::vector<std::string>& labels) {
  std::vector<Content> contents;
  for (const v1::PointsContent& layer : response.layers()) {
    const int i = static_cast<int>(point);
    Content content{layer.layer(), layer.kind(), layer.status(), kNoValue, {}};
    if (layer.statuses_size() > 0) {
      std::get<2>(content) = layer.statuses(i);
      if (!std::isnan(layer.values(i))) std::get<3>(content) = layer.values(i);
    }
    for (int j = 0; j < layer.points_size(); ++j) {
      if (layer.points(j) != point) continue;
      std::get<4>(content).emplace_back(layer.object_ids(j), labels.at(layer.labels(j)),
                                        layer.existences(j));
    }
    contents.push_back(std::move(content));
  }
  return contents;
}

TEST_F(PointsCallTest, AnswersAreThoseOfQueryPointForRandomMaps) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(absl::StrCat("HYPERMAP_TEST_SEED=", seed));
  hypermap::testing::Rng rng(seed);
  for (int round = 0; round < 4; ++round) {
    const std::string map = absl::StrCat("random", round);
    server_.MakeMap(map, hypermap::testing::RandomSite(rng, 80));
    const Scope scopes[] = {{}, {{"semantic", "wifi"}, "bench"}, {{}, "dock"}, {{}, "raft"}};
    for (const Scope& scope : scopes) {
      Stream stream(server_);
      // Revision 1 is the state before the edit below.
      const AsOf as_of = rng() % 2 ? AsOf{.revision = 1} : AsOf{};
      ASSERT_TRUE(stream.Write(Opening(map, scope, as_of)));
      std::vector<std::string> labels;
      for (int batch = 0; batch < 3; ++batch) {
        std::vector<Point> points(rng() % 40 + 1);
        for (Point& p : points) {
          p = {hypermap::testing::Uniform(rng, -20, 20), hypermap::testing::Uniform(rng, -20, 20)};
        }
        const v1::QueryPointsResponse got = stream.Ask(points);
        labels.insert(labels.end(), got.new_labels().begin(), got.new_labels().end());
        for (uint32_t i = 0; i < points.size(); ++i) {
          v1::QueryPointRequest request;
          wire::EncodeScope(map, scope, request.mutable_scope());
          wire::EncodeAsOf(as_of, request.mutable_as_of());
          wire::EncodePoint(points[i], request.mutable_point());
          v1::QueryPointResponse expected;
          grpc::ClientContext context;
          ASSERT_TRUE(server_.query->QueryPoint(&context, request, &expected).ok());
          ASSERT_EQ(got.revision(), expected.revision());
          ASSERT_EQ(ContentOf(got, i, labels), ContentOf(expected)) << "point " << i;
        }
        hypermap::PutObject put{"semantic", {}, "bench"};
        put.object = hypermap::testing::RandomObject(rng, {0, 0}, 5);
        ASSERT_TRUE(
            (*server_.site().Find(map))->SubmitAndWait({{{std::move(put)}}, "test", ""}).ok());
      }
      EXPECT_EQ(std::set<std::string>(labels.begin(), labels.end()).size(), labels.size());
    }
  }
}

TEST(LargePointsAnswerTest, ABatchWithMoreObjectsThanAMessageCarriesIsRefused) {
  // 1,000 unit squares on top of each other, of which a message of 64 KiB carries less than 9,363.
  Limits limits;
  limits.max_message_bytes = 64 << 10;
  TestServer server(limits, 1 << 20);
  EditBatch batch = LayerOfCups("cups", 0);
  for (int i = 0; i < 1000; ++i) {
    hypermap::PutObject put{"cups", {}, ""};
    put.object.label = "cup";
    put.object.shape = Polygon::FromBox({{0, 0}, {1, 1}});
    batch.edits.push_back(std::move(put));
  }
  server.MakeMap("site", std::move(batch));
  const std::vector<Point> few(5, Point{0.5, 0.5});
  const std::vector<Point> many(50, Point{0.5, 0.5});
  for (const double tolerance_m : {0.0, 1.0, 100.0}) {
    SCOPED_TRACE(tolerance_m);
    v1::QueryPointsRequest opening = Opening("site");
    opening.mutable_opening()->set_tolerance_m(tolerance_m);
    Stream stream(server);
    ASSERT_TRUE(stream.Write(opening));
    EXPECT_EQ(stream.Ask(few).layers(0).points_size(), 5000);
    ASSERT_TRUE(stream.Write(Batch(many)));
    const grpc::Status status = stream.Finish();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_THAT(status.error_message(), HasSubstr("more than 9362 objects at the 50 points"));
  }
}

}  // namespace
}  // namespace hypermap::server
