#include "client_libs/cpp/replica/replica.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "client_libs/cpp/replica/testing/answer_text.h"
#include "client_libs/cpp/replica/testing/site_server.h"
#include "client_libs/testing/scripted_server.h"
#include "map/digest/content_digest.h"
#include "tests/support/eventually.h"
#include "tests/support/random_map.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::client {
namespace {

using ::hypermap::testing::TemporaryFolder;
using ::testing::HasSubstr;
using ::testing::SizeIs;

EditBatch Batch(std::vector<Edit> edits) {
  EditBatch batch;
  batch.edits = std::move(edits);
  return batch;
}

SemanticObject Thing(const std::string& label, double x, double y, ObjectId id = 0) {
  return {.id = id, .label = label, .shape = Polygon::FromBox({{x, y}, {x + 1, y + 1}})};
}

LayerSpec Floor() {
  LayerSpec spec{.name = "floor", .kind = LayerKind::kOccupancy};
  spec.grid = GridGeometry{PlanarTransform(), 1.0};
  return spec;
}

// A chair at (0, 0), a cup at (10, 0), and a grid of 20 x 20 m that is occupied where x = row.
EditBatch SmallSite() {
  EditBatch batch =
      Batch({CreateLayer{{.name = "things"}}, PutObject{"things", Thing("chair", 0, 0)},
             PutObject{"things", Thing("cup", 10, 0)}, CreateLayer{Floor()}});
  WriteCells write{"floor", {0, 20, 0, 20}, {}};
  for (int i = 0; i < 400; ++i) write.values.push_back(i / 20 == i % 20 ? 1.0 : 0.0);
  batch.edits.push_back(std::move(write));
  return batch;
}

Polygon Rectangle(double x0, double y0, double x1, double y1) {
  return Polygon::FromBox({{x0, y0}, {x1, y1}});
}

// A server with the map "site", and replicas of it.
class ReplicaTest : public ::testing::Test {
 protected:
  ReplicaTest() { server_.MakeMap("site", SmallSite()); }

  Client NewClient() { return Client(server_.address(), {.retry_for = absl::Seconds(10)}); }

  std::unique_ptr<Replica> Open(ReplicaOptions options) {
    options.map = "site";
    options.write_delay = absl::Milliseconds(1);
    auto replica = Replica::Open(NewClient(), options);
    EXPECT_TRUE(replica.ok()) << replica.status();
    return replica.ok() ? *std::move(replica) : nullptr;
  }

  Revision PutThing(const SemanticObject& object) {
    return server_.Edit("site", Batch({PutObject{"things", object}}));
  }

  // Compares everything in the map, as the server and the replica report it at the replica's
  // revision.
  void ExpectLikeTheServer(const Replica& replica) {
    const CallOptions then{.as_of = {.revision = replica.state().revision}};
    const Polygon everywhere = Rectangle(-1e4, -1e4, 1e4, 1e4);
    Client client = NewClient();
    EXPECT_EQ(Text(replica.QueryArea(everywhere)),
              Text(client.QueryArea("site", everywhere, {}, then)));
  }

  TemporaryFolder data_;
  TemporaryFolder folder_;
  SiteServer server_{data_.path()};
};

TEST_F(ReplicaTest, AnswersLikeTheServer) {
  const auto replica = Open({});
  ExpectLikeTheServer(*replica);
  Client client = NewClient();
  EXPECT_EQ(Text(replica->QueryPoint({0.5, 0.5})), Text(client.QueryPoint("site", {0.5, 0.5})));
  EXPECT_EQ(Text(replica->QueryValue("chair")), Text(client.QueryValue("site", "chair")));
  EXPECT_EQ(Text(replica->QueryNearest({9, 9}, "cup", 3)),
            Text(client.QueryNearest("site", {9, 9}, "cup", 3)));
  const LayerList layers = replica->ListLayers();
  ASSERT_THAT(layers.layers, SizeIs(2));
  EXPECT_EQ(layers.layers[0].extent, (CellBox{0, 20, 0, 20}));
  EXPECT_EQ(layers.layers[1].version, 1);
}

TEST_F(ReplicaTest, IsWrongInTheSameWay) {
  const auto replica = Open({});
  Client client = NewClient();
  EXPECT_EQ(Text(replica->QueryPoint({0, 0}, {{"sea"}, ""})),
            Text(client.QueryPoint("site", {0, 0}, {{"sea"}, ""})));
  EXPECT_EQ(Text(replica->QueryPoint({0, 0}, {{}, "moon"})),
            Text(client.QueryPoint("site", {0, 0}, {{}, "moon"})));
  EXPECT_EQ(Text(replica->QueryValue("0.5..")), Text(client.QueryValue("site", "0.5..")));
  EXPECT_EQ(Text(replica->QueryNearest({0, 0}, "cup", 0)),
            Text(client.QueryNearest("site", {0, 0}, "cup", 0)));
}

TEST_F(ReplicaTest, FollowsTheServer) {
  const auto replica = Open({});
  const Revision revision = PutThing(Thing("bed", 5, 5));
  ASSERT_TRUE(replica->AwaitRevision(revision, kPatience).ok());
  EXPECT_EQ(replica->QueryPoint({5.5, 5.5})->layers[1].objects[0].label, "bed");
  const ReplicaState state = replica->state();
  EXPECT_TRUE(state.connected);
  EXPECT_TRUE(state.problem.ok()) << state.problem;
  EXPECT_GT(state.newest_at, absl::Now() - kPatience);
  EXPECT_EQ(replica->AwaitRevision(revision + 1, absl::Milliseconds(1)).code(),
            absl::StatusCode::kDeadlineExceeded);
}

TEST_F(ReplicaTest, AReaderKeepsItsRevision) {
  const auto replica = Open({});
  AnswerReader chairs = replica->QueryValue("chair", std::nullopt, {{"things"}, ""});
  const SnapshotPtr pinned = replica->snapshot();
  const Revision revision = server_.Edit("site", Batch({DeleteObject{"things", 1}}));
  ASSERT_TRUE(replica->AwaitRevision(revision, kPatience).ok());
  const std::optional<LayerPart> part = chairs.Next();
  ASSERT_TRUE(part.has_value());
  EXPECT_THAT(part->objects, SizeIs(1));
  EXPECT_EQ(chairs.revision(), revision - 1);
  EXPECT_EQ(pinned->revision, revision - 1);
}

TEST_F(ReplicaTest, AnswersFromItsFileWithoutAServer) {
  std::string before;
  {
    const auto replica = Open({.folder = folder_.path()});
    const Revision revision = PutThing(Thing("bed", 5, 5));
    ASSERT_TRUE(replica->AwaitRevision(revision, kPatience).ok());
    before = Text(replica->QueryArea(Rectangle(-100, -100, 100, 100)));
  }
  server_.Stop();
  const auto replica = Open({.folder = folder_.path()});
  EXPECT_EQ(Text(replica->QueryArea(Rectangle(-100, -100, 100, 100))), before);
  const ReplicaState state = replica->state();
  EXPECT_FALSE(state.connected);
  EXPECT_EQ(state.revision, 2);
  EXPECT_EQ(state.durable_revision, 2);
  EXPECT_EQ(state.problem.code(), absl::StatusCode::kUnavailable);
  EXPECT_LT(state.newest_at, absl::Now());
}

TEST_F(ReplicaTest, GoesOnFromTheFeedAfterABreak) {
  const auto replica = Open({.folder = folder_.path()});
  server_.Stop();
  EXPECT_EQ(replica->QueryPoint({0.5, 0.5})->layers[1].objects[0].label, "chair");
  server_.Start();
  const Revision revision = PutThing(Thing("bed", 5, 5));
  ASSERT_TRUE(replica->AwaitRevision(revision, kPatience).ok());
  ExpectLikeTheServer(*replica);
  EXPECT_EQ(replica->state().num_resumed, 1);
  EXPECT_EQ(replica->state().num_taken_anew, 0);
}

TEST_F(ReplicaTest, TakesTheMapAnewWhereTheFeedIsNotKept) {
  Revision revision = 0;
  { const auto replica = Open({.folder = folder_.path()}); }
  server_.Stop();
  server_.Start({.limits = {.history_revisions = 1}});
  for (int i = 0; i < 20; ++i) revision = PutThing(Thing("box", i, 3));
  revision = server_.Edit("site", Batch({DeleteObject{"things", 2}}));
  // History is removed in the background, after a commit.
  absl::Status oldest_gone;
  do {
    revision = PutThing(Thing("chair", 0, revision % 7, 1));
    auto history = (*server_.site().Find("site"))->OpenHistory();
    oldest_gone = (*history)->At(1).status();
  } while (oldest_gone.ok());

  const auto replica = Open({.folder = folder_.path()});
  ASSERT_TRUE(replica->AwaitRevision(revision, kPatience).ok());
  ExpectLikeTheServer(*replica);
  EXPECT_EQ(replica->state().num_taken_anew, 1);
  ASSERT_TRUE(replica->Flush().ok());
  EXPECT_EQ(replica->state().durable_revision, revision);
}

TEST_F(ReplicaTest, ARevisionThatSelectsNothingIsReachedAsWell) {
  const auto replica = Open({.layers = {"floor"}});
  const Revision revision = PutThing(Thing("bed", 5, 5));
  ASSERT_TRUE(replica->AwaitRevision(revision, kPatience).ok());
  EXPECT_THAT(replica->ListLayers().layers, SizeIs(1));
}

TEST_F(ReplicaTest, NoticesAMapThatWasMadeAnew) {
  const auto replica = Open({.folder = folder_.path()});
  const uint64_t before = replica->state().incarnation;
  EXPECT_EQ(before, (*server_.site().Find("site"))->incarnation());
  ASSERT_TRUE(server_.site().Delete("site", "").ok());
  server_.MakeMap("site", Batch({CreateLayer{{.name = "other"}}}));
  // Edits until revision numbers alone no longer tell the two maps apart.
  const Revision revision = server_.Edit("site", Batch({PutObject{"other", Thing("ghost", 0, 0)}}));
  ASSERT_TRUE(replica->AwaitRevision(revision, kPatience).ok());
  ExpectLikeTheServer(*replica);
  EXPECT_EQ(replica->state().num_taken_anew, 1);
  EXPECT_NE(replica->state().incarnation, before);
  EXPECT_EQ(replica->state().incarnation, (*server_.site().Find("site"))->incarnation());
  EXPECT_EQ(replica->ListLayers().incarnation, replica->state().incarnation);
  EXPECT_TRUE(replica->Flush().ok());
}

TEST_F(ReplicaTest, NoticesAMapThatWentAnotherWay) {
  const auto replica = Open({.folder = folder_.path()});
  server_.Stop();
  const TemporaryFolder backup;
  std::filesystem::copy(data_ / "site.gpkg", backup / "site.gpkg");
  server_.Start();
  Revision revision = PutThing(Thing("bed", 5, 5));
  ASSERT_TRUE(replica->AwaitRevision(revision, kPatience).ok());

  server_.Stop();
  std::filesystem::copy(backup / "site.gpkg", data_ / "site.gpkg",
                        std::filesystem::copy_options::overwrite_existing);
  server_.Start();
  // More commits than before, so that revision numbers alone tell nothing.
  for (int i = 0; i < 3; ++i) revision = PutThing(Thing("desk", 7, 7));
  ASSERT_TRUE(replica->AwaitRevision(revision, kPatience).ok());
  ExpectLikeTheServer(*replica);
  EXPECT_EQ(replica->state().num_taken_anew, 1);
}

TEST_F(ReplicaTest, NoticesAMapThatWentBack) {
  { const auto replica = Open({.folder = folder_.path()}); }
  server_.Stop();
  const TemporaryFolder backup;
  std::filesystem::copy(data_ / "site.gpkg", backup / "site.gpkg");
  server_.Start();
  {
    const auto replica = Open({.folder = folder_.path()});
    const Revision revision = PutThing(Thing("bed", 5, 5));
    ASSERT_TRUE(replica->AwaitRevision(revision, kPatience).ok());
  }
  server_.Stop();
  std::filesystem::copy(backup / "site.gpkg", data_ / "site.gpkg",
                        std::filesystem::copy_options::overwrite_existing);
  server_.Start();
  const auto replica = Open({.folder = folder_.path()});
  ASSERT_TRUE(testing::Eventually([&] { return replica->state().revision == 1; }))
      << replica->state().problem;
  EXPECT_EQ(replica->state().num_taken_anew, 1);
  ExpectLikeTheServer(*replica);
  ASSERT_TRUE(replica->Flush().ok());
  EXPECT_EQ(replica->state().durable_revision, 1);
}

TEST_F(ReplicaTest, SaysWhatItDoesNotMirror) {
  const auto replica = Open({.layers = {"things", "floor"}, .area = Rectangle(0, 0, 8, 8)});
  ASSERT_TRUE(replica->QueryPoint({0, 0}).ok());
  ASSERT_TRUE(replica->QueryPoint({8, 8}).ok());
  EXPECT_EQ(replica->QueryPoint({9, 9}).status().code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(replica->QueryPoints({{1, 1}, {9, 9}}).status().code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(Text(replica->QueryArea(Rectangle(7, 7, 9, 9))), HasSubstr("OUT_OF_RANGE"));
  EXPECT_THAT(Text(replica->QueryValue("cup", Rectangle(7, 0, 11, 3))), HasSubstr("OUT_OF_RANGE"));
  // The cup outside the area may be the nearest, which the replica can't know.
  EXPECT_THAT(Text(replica->QueryNearest({7, 1}, "cup", 1)), HasSubstr("OUT_OF_RANGE"));
  EXPECT_THAT(Text(replica->QueryNearest({7, 1}, "chair", 1)), HasSubstr("OUT_OF_RANGE"));
  EXPECT_EQ(replica->QueryNearest({1, 1}, "chair", 1)->matches[0].object->id, 1);
  EXPECT_THAT(Text(replica->QueryValue("chair")), HasSubstr("chair"));
  EXPECT_EQ(replica->QueryPoint({1, 1}, {{"sea"}, ""}).status().code(),
            absl::StatusCode::kNotFound);
}

TEST_F(ReplicaTest, ALayerThatWasNotChosenIsNotFound) {
  const auto replica = Open({.layers = {"things"}});
  EXPECT_EQ(replica->QueryPoint({0, 0}, {{"floor"}, ""}).status().code(),
            absl::StatusCode::kNotFound);
  EXPECT_THAT(replica->QueryPoint({0, 0})->layers, SizeIs(1));
}

TEST_F(ReplicaTest, OpensOnlyWhatIsItsOwn) {
  const auto replica = Open({.folder = folder_.path()});
  ReplicaOptions options{.map = "site", .folder = folder_.path()};
  EXPECT_EQ(Replica::Open(NewClient(), options).status().code(),
            absl::StatusCode::kFailedPrecondition);
  options.map = "nowhere";
  options.folder.clear();
  EXPECT_EQ(Replica::Open(NewClient(), options).status().code(), absl::StatusCode::kNotFound);

  server_.Stop();
  options = {.map = "site", .folder = data_.path()};
  const absl::Status refused = Replica::Open(NewClient(), options).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(refused.message(), HasSubstr("not the file of a replica"));
}

TEST_F(ReplicaTest, AFileOfAnotherSelectionIsReplaced) {
  { const auto replica = Open({.layers = {"floor"}, .folder = folder_.path()}); }
  {
    const auto replica = Open({.layers = {"things"}, .folder = folder_.path()});
    EXPECT_EQ(replica->state().num_resumed, 0);
    EXPECT_EQ(replica->ListLayers().layers[0].spec.name, "things");
  }
  server_.Stop();
  const auto replica = Open({.layers = {"things"}, .folder = folder_.path()});
  EXPECT_EQ(replica->ListLayers().layers[0].spec.name, "things");
}

TEST_F(ReplicaTest, ADamagedFileIsPutAsideAndMadeAnew) {
  { const auto replica = Open({.folder = folder_.path()}); }
  const auto size = std::filesystem::file_size(folder_ / "site.gpkg");
  std::filesystem::resize_file(folder_ / "site.gpkg", size / 2 + 100);
  const auto replica = Open({.folder = folder_.path()});
  ExpectLikeTheServer(*replica);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "site.gpkg.damaged"));
  EXPECT_TRUE(replica->Flush().ok());
  EXPECT_EQ(replica->state().durable_revision, 1);
}

TEST_F(ReplicaTest, WithoutAFileAndAServerThereIsNothing) {
  server_.Stop();
  Client client(server_.address(), {.retry_for = absl::ZeroDuration()});
  EXPECT_EQ(Replica::Open(client, {.map = "site", .folder = folder_.path()}).status().code(),
            absl::StatusCode::kUnavailable);
}

TEST_F(ReplicaTest, AServerWithoutTheRpcIsRefused) {
  Script script;
  script.replications = {{{}, /*stays=*/false, grpc::Status(grpc::UNIMPLEMENTED, "")}};
  ScriptedServer server(script);
  const absl::Status refused = Replica::Open(Client(server.address()), {.map = "site"}).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kUnimplemented) << refused;
}

TEST_F(ReplicaTest, AFirstMessageWithoutTheMapIsAnError) {
  Script script;
  v1::ReplicateResponse snapshot;
  snapshot.set_revision(3);
  snapshot.set_snapshot(true);
  script.replications = {{{snapshot}, /*stays=*/true, grpc::Status::OK}};
  ScriptedServer server(script);
  const absl::Status refused = Replica::Open(Client(server.address()), {.map = "site"}).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kInternal) << refused;
}

TEST_F(ReplicaTest, WhatDoesNotFitIsTakenAnew) {
  v1::ReplicateResponse snapshot;
  snapshot.set_revision(3);
  snapshot.set_snapshot(true);
  snapshot.mutable_map()->set_frame_id("map");
  v1::ReplicateResponse misfit;
  misfit.set_revision(4);
  misfit.add_changes()->set_kind(v1::CHANGE_KIND_REMOVE);
  misfit.mutable_changes(0)->set_layer("sea");
  misfit.mutable_changes(0)->set_object_id(1);
  v1::ReplicateResponse again = snapshot;
  again.set_revision(5);
  Script script;
  script.replications = {{{snapshot, misfit}, /*stays=*/false, grpc::Status::OK},
                         {{again}, /*stays=*/true, grpc::Status::OK}};
  ScriptedServer server(script);
  const auto replica = Replica::Open(Client(server.address()), {.map = "site"});
  ASSERT_TRUE(replica.ok()) << replica.status();
  ASSERT_TRUE((*replica)->AwaitRevision(5, kPatience).ok());
  EXPECT_EQ((*replica)->state().num_taken_anew, 1);
  EXPECT_EQ(server.Requests()[1], "Replicate scope { map: \"site\" }");
}

TEST_F(ReplicaTest, IsComparedWithTheServerWhileItFollows) {
  const auto all = Open({.compare_every = absl::Milliseconds(1)});
  const auto some = Open({.layers = {"floor", "later"},
                          .folder = folder_.path(),
                          .compare_every = absl::Milliseconds(1)});
  EXPECT_TRUE(testing::Eventually([&] {
    PutThing(Thing("bed", 5, 5));
    return all->state().num_equal > 10 && some->state().num_equal > 10;
  }));
  for (const auto* replica : {&all, &some}) {
    const ReplicaState state = (*replica)->state();
    EXPECT_EQ(state.num_different, 0) << state.last_difference;
    EXPECT_EQ(state.num_taken_anew, 0);
  }
}

TEST_F(ReplicaTest, IsComparedAfterAStartFromItsFile) {
  Open({.folder = folder_.path()});
  const auto replica = Open({.folder = folder_.path(), .compare_every = absl::Milliseconds(1)});
  EXPECT_TRUE(testing::Eventually([&] { return replica->state().num_equal > 1; }));
  EXPECT_EQ(replica->state().last_difference, "");
}

TEST_F(ReplicaTest, IsTakenAnewIfItDiffersFromTheServer) {
  v1::ReplicateResponse snapshot;
  snapshot.set_revision(3);
  snapshot.set_snapshot(true);
  snapshot.mutable_map()->set_frame_id("map");
  Script script;
  script.replications = {{{snapshot}, /*stays=*/true, grpc::Status::OK},
                         {{snapshot}, /*stays=*/false, grpc::Status::OK}};
  script.digest.set_revision(3);
  script.digest.set_frames_digest(DigestOf(Snapshot()).frames);
  v1::LayerDigest& layer = *script.digest.add_layers();
  layer.set_layer("things");
  layer.set_digest("of a layer that the replica does not have");
  ScriptedServer server(script);
  const auto replica = Replica::Open(Client(server.address()),
                                     {.map = "site", .compare_every = absl::Milliseconds(20)});
  ASSERT_TRUE(replica.ok()) << replica.status();
  EXPECT_TRUE(testing::Eventually([&] { return (*replica)->state().num_taken_anew > 0; }));
  EXPECT_EQ((*replica)->state().last_difference, "revision 3: things");
  EXPECT_GE((*replica)->state().num_different, 1);
}

TEST_F(ReplicaTest, ALayerThatOneBatchCreatesAndDeletesIsNoMisfit) {
  const auto replica = Open({});
  const Revision revision = server_.Edit(
      "site", Batch({CreateLayer{{.name = "brief", .frame_id = "map"}}, DeleteLayer{"brief"}}));
  ASSERT_TRUE(replica->AwaitRevision(revision, kPatience).ok());
  EXPECT_EQ(replica->state().num_taken_anew, 0);
  ExpectLikeTheServer(*replica);
}

TEST_F(ReplicaTest, KeepsVersionsThroughItsFile) {
  std::string before;
  {
    const auto replica = Open({.folder = folder_.path()});
    const Revision revision = PutThing(Thing("bed", 5, 5));
    PutThing(Thing("cup", 11, 0, 2));
    const Revision last = server_.Edit("site", Batch({WriteCells{"floor", {0, 1, 0, 1}, {0.5}}}));
    ASSERT_EQ(last, revision + 2);
    ASSERT_TRUE(replica->AwaitRevision(last, kPatience).ok());
  }
  const auto replica = Open({.folder = folder_.path()});
  ExpectLikeTheServer(*replica);
  const LayerList here = replica->ListLayers();
  const auto there = NewClient().ListLayers("site");
  ASSERT_TRUE(there.ok());
  for (size_t i = 0; i < here.layers.size(); ++i) {
    EXPECT_EQ(here.layers[i].version, there->layers[i].version) << here.layers[i].spec.name;
    EXPECT_EQ(here.layers[i].spec, there->layers[i].spec);
    EXPECT_EQ(here.layers[i].extent, there->layers[i].extent);
  }
}

}  // namespace
}  // namespace hypermap::client
