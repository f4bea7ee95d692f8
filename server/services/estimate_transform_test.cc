#include "server/services/estimate_transform.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/access/token.h"
#include "map/frames/planar_transform.h"
#include "server/services/testing/test_server.h"
#include "tests/support/temporary_folder.h"
#include "wire/geometry.h"

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;

const PlanarTransform kTrue(-12.0, 30.0, -1.1);

// Places at which no transform but the true one fits.
std::vector<Point> Places() { return {{0, 0}, {4, 1}, {5, 7}, {-3, 2}, {1, -6}}; }

std::vector<Point> Moved(const PlanarTransform& by) {
  std::vector<Point> moved;
  for (const Point& place : Places()) moved.push_back(by * place);
  return moved;
}

EditBatch Chairs(const std::vector<Point>& places) {
  EditBatch batch;
  LayerSpec spec;
  spec.name = "chairs";
  batch.edits.push_back(hypermap::CreateLayer{spec});
  for (const Point& p : places) {
    hypermap::PutObject put{"chairs", {}, ""};
    put.object.label = "chair";
    put.object.shape = Polygon::FromBox({{p.x - 0.2, p.y - 0.2}, {p.x + 0.2, p.y + 0.2}});
    batch.edits.push_back(std::move(put));
  }
  return batch;
}

v1::EstimateTransformRequest Ask(const std::string& layer = "chairs") {
  v1::EstimateTransformRequest request;
  request.mutable_source()->mutable_scope()->set_map("attic");
  request.mutable_target()->mutable_scope()->set_map("office");
  if (layer.empty()) return request;
  request.mutable_source()->mutable_scope()->add_layers(layer);
  request.mutable_target()->mutable_scope()->add_layers(layer);
  return request;
}

v1::EstimateTransformRequest AskPairs(const std::vector<Point>& targets) {
  v1::EstimateTransformRequest request = Ask("");
  const std::vector<Point> sources = Places();
  for (size_t i = 0; i < targets.size(); ++i) {
    v1::PointPair* const pair = request.add_pairs();
    pair->set_name(absl::StrCat("place ", i));
    wire::EncodePoint(sources[i], pair->mutable_source());
    wire::EncodePoint(targets[i], pair->mutable_target());
  }
  return request;
}

// The maps "attic" and "office" with the same chairs, where the origin of the attic is at kTrue in
// the office; both at revision 1.
class EstimateTransformTest : public ::testing::Test {
 protected:
  EstimateTransformTest() {
    server_.MakeMap("attic", Chairs(Places()));
    server_.MakeMap("office", Chairs(Moved(kTrue)));
  }

  grpc::Status Call(const v1::EstimateTransformRequest& request,
                    v1::EstimateTransformResponse* response) {
    grpc::ClientContext context;
    return server_.query->EstimateTransform(&context, request, response);
  }
  // The answer, which must be given.
  v1::EstimateTransformResponse Answer(const v1::EstimateTransformRequest& request) {
    v1::EstimateTransformResponse response;
    const grpc::Status status = Call(request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  }
  grpc::Status Error(const v1::EstimateTransformRequest& request) {
    v1::EstimateTransformResponse response;
    return Call(request, &response);
  }
  void ExpectError(const v1::EstimateTransformRequest& request, grpc::StatusCode code,
                   const std::string& message) {
    const grpc::Status status = Error(request);
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(message));
  }

  static void ExpectPose(const v1::ScoredTransform& found, const PlanarTransform& expected) {
    EXPECT_NEAR(found.target_from_source().x(), expected.x(), 1e-6);
    EXPECT_NEAR(found.target_from_source().y(), expected.y(), 1e-6);
    EXPECT_NEAR(found.target_from_source().yaw(), expected.yaw(), 1e-6);
  }

  Revision Edit(const std::string& map, EditBatch batch) {
    const auto receipt = (*server_.site().Find(map))->SubmitAndWait({std::move(batch), "test", ""});
    EXPECT_TRUE(receipt.ok()) << receipt.status();
    return receipt.ok() ? receipt->revision : 0;
  }

  TestServer server_;
};

TEST_F(EstimateTransformTest, ObjectsAreLaidOverEachOther) {
  const v1::EstimateTransformResponse answer = Answer(Ask());
  ExpectPose(answer.best(), kTrue);
  EXPECT_GT(answer.best().score(), 0.9);
  EXPECT_EQ(answer.inlier_share(), 1.0);
  EXPECT_EQ(answer.ambiguity(), v1::TRANSFORM_AMBIGUITY_NONE);
  ASSERT_EQ(answer.covariance_size(), 9);
  EXPECT_GT(answer.covariance(8), 0.0);
  ASSERT_EQ(answer.agreeing_size(), 5);
  EXPECT_EQ(answer.agreeing(0).source(), answer.agreeing(0).target());
  EXPECT_EQ(answer.source().map(), "attic");
  EXPECT_EQ(answer.source().layer(), "chairs");
  EXPECT_EQ(answer.source().frame_id(), "map");
  EXPECT_EQ(answer.source().revision(), 1);
  EXPECT_EQ(answer.source().incarnation(), (*server_.site().Find("attic"))->incarnation());
  EXPECT_EQ(answer.target().map(), "office");
  EXPECT_EQ(answer.target().incarnation(), (*server_.site().Find("office"))->incarnation());
}

TEST_F(EstimateTransformTest, PairsAreLaidOverEachOtherButWrongOnes) {
  std::vector<Point> targets = Moved(kTrue);
  targets[2] = {0, 0};
  const v1::EstimateTransformResponse answer = Answer(AskPairs(targets));
  ExpectPose(answer.best(), kTrue);
  EXPECT_EQ(answer.ambiguity(), v1::TRANSFORM_AMBIGUITY_NONE);
  EXPECT_DOUBLE_EQ(answer.inlier_share(), 0.8);
  std::vector<int64_t> agreeing;
  for (const v1::AgreeingPair& pair : answer.agreeing()) agreeing.push_back(pair.source());
  EXPECT_THAT(agreeing, ::testing::ElementsAre(0, 1, 3, 4));
  EXPECT_EQ(answer.source().layer(), "");
  EXPECT_EQ(answer.target().revision(), 1);
}

TEST_F(EstimateTransformTest, PairsWithoutAnswerAreAmbiguous) {
  v1::EstimateTransformRequest request = AskPairs({{0, 0}, {100, 0}});
  const v1::EstimateTransformResponse answer = Answer(request);
  EXPECT_EQ(answer.ambiguity(), v1::TRANSFORM_AMBIGUITY_LITTLE_AGREEMENT);
  EXPECT_EQ(answer.best().score(), 0.0);
  EXPECT_EQ(answer.covariance_size(), 0);
  EXPECT_FALSE(answer.has_runner_up());
}

TEST_F(EstimateTransformTest, RowOfChairsHasARunnerUp) {
  EditBatch row = Chairs({{0, 0}, {1, 0}, {2, 0}, {3, 0}, {4, 0}, {5, 0}});
  server_.MakeMap("row", row);
  v1::EstimateTransformRequest request = Ask();
  request.mutable_source()->mutable_scope()->set_map("row");
  request.mutable_target()->mutable_scope()->set_map("row");
  const v1::EstimateTransformResponse answer = Answer(request);
  EXPECT_EQ(answer.ambiguity(), v1::TRANSFORM_AMBIGUITY_RUNNER_UP);
  ASSERT_TRUE(answer.has_runner_up());
  EXPECT_GT(answer.runner_up().score(), 0.7 * answer.best().score());
}

TEST_F(EstimateTransformTest, FramesAreThoseOfTheRequest) {
  const PlanarTransform site_from_map(1, 2, 0.5);
  Edit("office", {{hypermap::SetTransform{{"site", "map", site_from_map}}}});
  v1::EstimateTransformRequest request = Ask();
  request.mutable_target()->mutable_scope()->set_frame_id("site");
  const v1::EstimateTransformResponse answer = Answer(request);
  ExpectPose(answer.best(), site_from_map * kTrue);
  EXPECT_EQ(answer.target().frame_id(), "site");
  EXPECT_EQ(answer.target().revision(), 2);
}

TEST_F(EstimateTransformTest, PastRevisionsAreReadOnBothSides) {
  // Now the chairs of the attic are gone, and those of the office are elsewhere.
  EditBatch gone;
  for (ObjectId id = 1; id <= 5; ++id)
    gone.edits.push_back(hypermap::DeleteObject{"chairs", id, {}});
  EXPECT_EQ(Edit("attic", gone), 2);
  gone.edits.push_back(hypermap::DeleteLayer{"chairs"});
  EXPECT_EQ(Edit("office", gone), 2);
  EXPECT_EQ(Error(Ask()).error_code(), grpc::StatusCode::NOT_FOUND);
  v1::EstimateTransformRequest request = Ask();
  request.mutable_source()->mutable_as_of()->set_at_revision(1);
  EXPECT_EQ(Error(request).error_code(), grpc::StatusCode::NOT_FOUND);
  request.mutable_target()->mutable_as_of()->set_at_revision(1);
  const v1::EstimateTransformResponse answer = Answer(request);
  ExpectPose(answer.best(), kTrue);
  EXPECT_EQ(answer.source().revision(), 1);
  EXPECT_EQ(answer.target().revision(), 1);
  // Two times of the same map.
  request.mutable_target()->mutable_scope()->set_map("attic");
  ExpectPose(Answer(request).best(), PlanarTransform());
  request.mutable_target()->mutable_as_of()->set_at_revision(7);
  ExpectError(request, grpc::StatusCode::OUT_OF_RANGE, "target: at_revision 7");
}

TEST_F(EstimateTransformTest, EachSideWaitsForItsRevision) {
  for (const bool of_source : {true, false}) {
    SCOPED_TRACE(of_source);
    v1::EstimateTransformRequest request = Ask();
    auto* const side = of_source ? request.mutable_source() : request.mutable_target();
    const std::string map = of_source ? "attic" : "office";
    side->mutable_as_of()->set_min_revision(2);
    grpc::ClientContext late;
    late.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(50));
    v1::EstimateTransformResponse response;
    EXPECT_EQ(server_.query->EstimateTransform(&late, request, &response).error_code(),
              grpc::StatusCode::DEADLINE_EXCEEDED);
    Edit(map, {{hypermap::SetTransform{{"map", "dock", PlanarTransform()}}}});
    const v1::EstimateTransformResponse answer = Answer(request);
    EXPECT_EQ((of_source ? answer.source() : answer.target()).revision(), 2);
  }
}

TEST_F(EstimateTransformTest, OtherIncarnationsAreRefused) {
  for (const bool of_source : {true, false}) {
    v1::EstimateTransformRequest request = Ask();
    auto* const side = of_source ? request.mutable_source() : request.mutable_target();
    side->mutable_scope()->set_incarnation(1);
    ExpectError(request, grpc::StatusCode::ABORTED, of_source ? "source: " : "target: ");
  }
}

TEST_F(EstimateTransformTest, LinearizableAnswersHaveTheNewestRevisions) {
  v1::EstimateTransformRequest request = Ask();
  request.mutable_source()->mutable_as_of()->set_consistency(v1::CONSISTENCY_LINEARIZABLE);
  request.mutable_target()->mutable_as_of()->set_consistency(v1::CONSISTENCY_LINEARIZABLE);
  EXPECT_EQ(Answer(request).target().revision(), 1);
}

TEST_F(EstimateTransformTest, ErrorsTellTheSideAndTheField) {
  using grpc::StatusCode;
  v1::EstimateTransformRequest request = Ask();
  request.clear_source();
  ExpectError(request, StatusCode::INVALID_ARGUMENT, "source is missing");
  request = Ask();
  request.clear_target();
  ExpectError(request, StatusCode::INVALID_ARGUMENT, "target is missing");
  ExpectError(Ask(""), StatusCode::INVALID_ARGUMENT, "source: scope.layers must name one layer");
  request = Ask();
  request.mutable_target()->mutable_scope()->add_layers("more");
  ExpectError(request, StatusCode::INVALID_ARGUMENT, "target: scope.layers must name one layer");
  request = Ask();
  request.mutable_source()->mutable_scope()->set_map("cellar");
  ExpectError(request, StatusCode::NOT_FOUND, "source: ");
  request.mutable_source()->mutable_scope()->set_map("no/map");
  ExpectError(request, StatusCode::INVALID_ARGUMENT, "source: ");
  ExpectError(Ask("sofas"), StatusCode::NOT_FOUND, "sofas");
  request = Ask();
  request.mutable_target()->mutable_scope()->set_frame_id("moon");
  ExpectError(request, StatusCode::NOT_FOUND, "target: ");
  request = Ask();
  request.mutable_source()->mutable_as_of()->set_at_revision(-1);
  ExpectError(request, StatusCode::INVALID_ARGUMENT, "source: as_of.at_revision");
}

TEST_F(EstimateTransformTest, WrongPairsAreRefused) {
  using grpc::StatusCode;
  ExpectError(AskPairs({{0, 0}}), StatusCode::FAILED_PRECONDITION, "two pairs");
  v1::EstimateTransformRequest request = AskPairs(Moved(kTrue));
  request.mutable_source()->mutable_scope()->add_layers("chairs");
  ExpectError(request, StatusCode::INVALID_ARGUMENT, "source: scope.layers must be empty");
  request = AskPairs(Moved(kTrue));
  request.mutable_pairs(3)->mutable_target()->set_x(NAN);
  ExpectError(request, StatusCode::INVALID_ARGUMENT, "pairs[3] (\"place 3\").target");
  request = AskPairs(Moved(kTrue));
  for (int i = 0; i < 1000; ++i) *request.add_pairs() = request.pairs(0);
  ExpectError(request, StatusCode::RESOURCE_EXHAUSTED, "pairs has 1005 elements");
}

TEST_F(EstimateTransformTest, LayersOfOtherKindsAreRefused) {
  Edit("attic", LayerOfCells("cells", 2, 4));
  Edit("office", LayerOfCells("cells", 2, 4));
  v1::EstimateTransformRequest request = Ask();
  request.mutable_target()->mutable_scope()->set_layers(0, "cells");
  ExpectError(request, grpc::StatusCode::FAILED_PRECONDITION, "both must be occupancy");
  // Cells of a metre are too large to compare walls.
  ExpectError(Ask("cells"), grpc::StatusCode::FAILED_PRECONDITION, "cells of 1 m");
}

TEST_F(EstimateTransformTest, RequestsThatAreTooLargeAreRefused) {
  v1::EstimateTransformRequest request = AskPairs(Moved(kTrue));
  request.mutable_pairs(0)->set_name(std::string(300 << 10, 'x'));
  EXPECT_EQ(Error(request).error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
}

// A request of more than 16 KiB is parsed on a worker.
TEST_F(EstimateTransformTest, LargeRequestsAreAnswered) {
  v1::EstimateTransformRequest request = AskPairs(Moved(kTrue));
  request.mutable_pairs(0)->set_name(std::string(20 << 10, 'x'));
  ExpectPose(Answer(request).best(), kTrue);
}

// Identities with access to one of the maps, or to both.
class EstimateTransformAccessTest : public ::testing::Test {
 protected:
  std::string Add(const std::string& name, const std::string& maps) {
    const access::NewToken token = access::MakeToken().value();
    absl::StrAppend(&identities_, "  - name: ", name, "\n    role: reader\n    maps: [", maps,
                    "]\n    tokens:\n      - id: ", token.id, "\n        sha256: ", token.digest,
                    "\n        created: 2026-11-27T09:00:00Z\n");
    return token.text;
  }
  static grpc::Status Call(TestServer& server, const std::string& token,
                           const v1::EstimateTransformRequest& request) {
    grpc::ClientContext context;
    context.AddMetadata("authorization", absl::StrCat("Bearer ", token));
    v1::EstimateTransformResponse response;
    return server.query->EstimateTransform(&context, request, &response);
  }

  hypermap::testing::TemporaryFolder folder_;
  std::string identities_ = "identities:\n";
};

TEST_F(EstimateTransformAccessTest, CallerNeedsAccessToBothMaps) {
  const std::string both = Add("both", "\"attic\", \"office\"");
  const std::string attic = Add("only-attic", "\"attic\"");
  const std::string office = Add("only-office", "\"office\"");
  folder_.Write("access.yaml", identities_);
  TestServer server({}, 1 << 20, {}, {folder_ / "access.yaml"});
  server.MakeMap("attic", Chairs(Places()));
  server.MakeMap("office", Chairs(Moved(kTrue)));
  for (const v1::EstimateTransformRequest& request : {Ask(), AskPairs(Moved(kTrue))}) {
    EXPECT_TRUE(Call(server, both, request).ok());
    const grpc::Status of_attic = Call(server, attic, request);
    EXPECT_EQ(of_attic.error_code(), grpc::StatusCode::PERMISSION_DENIED);
    EXPECT_THAT(of_attic.error_message(), HasSubstr("office"));
    const grpc::Status of_office = Call(server, office, request);
    EXPECT_EQ(of_office.error_code(), grpc::StatusCode::PERMISSION_DENIED);
    EXPECT_THAT(of_office.error_message(), HasSubstr("attic"));
  }
  // Also if the request is parsed by a worker.
  v1::EstimateTransformRequest large = AskPairs(Moved(kTrue));
  large.mutable_pairs(0)->set_name(std::string(20 << 10, 'x'));
  EXPECT_EQ(Call(server, office, large).error_code(), grpc::StatusCode::PERMISSION_DENIED);
  v1::EstimateTransformRequest same = Ask();
  same.mutable_target()->mutable_scope()->set_map("attic");
  EXPECT_TRUE(Call(server, attic, same).ok());
}

}  // namespace
}  // namespace hypermap::server
