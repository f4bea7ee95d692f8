#include "client_libs/cpp/client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <ranges>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client_libs/testing/scripted_server.h"
#include "client_libs/testing/text_message.h"

namespace hypermap::client {
namespace {

using hypermap::testing::ParseText;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr char kChair[] =
    "id: 7 label: 'chair' existence: 0.9 shape { polygon { outer { xs: [1, 2, 2] ys: [1, 1, 2] } } "
    "}";

Polygon UnitSquare() { return Polygon::FromBox({{0, 0}, {1, 1}}); }

TEST(ClientTest, CallerHasItsRights) {
  Script script;
  script.caller = ParseText<v1::GetCallerResponse>(
      "has_identities: true identity: 'cart' role: ROLE_ROBOT maps: ['hall-*', 'office'] "
      "robots: 'cart-arm' expires { seconds: 5 }");
  ScriptedServer server(script);
  const auto caller = Client(server.address()).GetCaller();
  ASSERT_TRUE(caller.ok()) << caller.status();
  EXPECT_TRUE(caller->has_identities);
  EXPECT_EQ(caller->identity, "cart");
  EXPECT_EQ(caller->role, access::Role::kRobot);
  EXPECT_THAT(caller->maps, ElementsAre("hall-*", "office"));
  EXPECT_THAT(caller->robots, ElementsAre("cart-arm"));
  EXPECT_EQ(caller->expires, absl::FromUnixSeconds(5));
}

TEST(ClientTest, CallerOfAServerWithoutIdentitiesIsNobody) {
  ScriptedServer server({});
  const auto caller = Client(server.address()).GetCaller();
  ASSERT_TRUE(caller.ok()) << caller.status();
  EXPECT_FALSE(caller->has_identities);
  EXPECT_EQ(caller->expires, absl::InfiniteFuture());
}

TEST(ClientTest, PointAnswerHasWhatEachLayerSays) {
  Script script;
  script.point = ParseText<v1::QueryPointResponse>(
      "map: 'office' revision: 5 frame_id: 'map' point { x: 1.5 y: 1.2 } "
      "layers { layer: 'floor' kind: LAYER_KIND_OCCUPANCY status: ANSWER_STATUS_VALUE value: 0 } "
      "layers { layer: 'seen' kind: LAYER_KIND_EXPLORATION status: ANSWER_STATUS_OUTSIDE } "
      "layers { layer: 'objects' kind: LAYER_KIND_SEMANTIC status: ANSWER_STATUS_VALUE objects { " +
      std::string(kChair) + " } }");
  ScriptedServer server(script);

  const auto answer = Client(server.address()).QueryPoint("office", {1.5, 1.2});

  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->revision, 5);
  EXPECT_EQ(answer->frame_id, "map");
  EXPECT_EQ(answer->point, (Point{1.5, 1.2}));
  ASSERT_THAT(answer->layers, SizeIs(3));
  EXPECT_EQ(answer->layers[0].value, 0.0);
  EXPECT_EQ(answer->layers[1].status, AnswerStatus::kOutside);
  EXPECT_EQ(answer->layers[1].value, std::nullopt);
  ASSERT_THAT(answer->layers[2].objects, SizeIs(1));
  EXPECT_EQ(answer->layers[2].objects[0].label, "chair");
  EXPECT_EQ(answer->layers[2].objects[0].shape.num_vertices(), 3);
}

TEST(ClientTest, PartsOfAnAnswerAreARange) {
  static_assert(std::ranges::input_range<AnswerReader>);
  static_assert(std::ranges::input_range<ByteReader>);
  static_assert(std::ranges::input_range<ChangeReader>);
  static_assert(std::ranges::input_range<Watcher>);
  Script script;
  for (const char* layer : {"floor", "walls"}) {
    script.parts.push_back(ParseText<v1::LayerPart>(absl::StrCat(
        "layer: '", layer, "' kind: LAYER_KIND_SEMANTIC status: ANSWER_STATUS_VALUE")));
  }
  ScriptedServer server(script);
  AnswerReader reader = Client(server.address()).QueryValue("office", "chair");
  std::vector<std::string> layers;
  for (const LayerPart& part : reader) layers.push_back(part.layer);
  EXPECT_THAT(layers, ElementsAre("floor", "walls"));
  EXPECT_TRUE(reader.status().ok()) << reader.status();
  for (const LayerPart& part : reader) ADD_FAILURE() << part.layer;
}

TEST(ClientTest, ErrorsAreTheServersOwn) {
  Script script;
  script.status = grpc::Status(grpc::StatusCode::NOT_FOUND, "map \"x\" does not exist");
  ScriptedServer server(script);
  Client client(server.address());

  const absl::Status expected = absl::NotFoundError("map \"x\" does not exist");
  EXPECT_EQ(client.QueryPoint("x", {0, 0}).status(), expected);
  EXPECT_EQ(client.DeleteMap("x"), expected);
  EXPECT_EQ(client.ImportMap("x", FileFormat::kGeoJson, {{"f", "{}"}}).status(), expected);
  EXPECT_EQ(client.ExportMap("x", FileFormat::kHmap).status(), expected);
  AnswerReader reader = client.QueryArea("x", UnitSquare());
  EXPECT_EQ(reader.Next(), std::nullopt);
  EXPECT_EQ(reader.status(), expected);
}

TEST(ClientTest, NoServerIsUnavailable) {
  std::string address;
  { address = ScriptedServer({}).address(); }
  Client client(address, {.retry_for = absl::ZeroDuration()});
  EXPECT_EQ(client.ListMaps().status().code(), absl::StatusCode::kUnavailable);
}

TEST(ClientTest, AnAnswerThatMakesNoSenseIsAnInternalError) {
  Script script;
  script.point = ParseText<v1::QueryPointResponse>("point {} layers { layer: 'floor' }");
  script.parts = {ParseText<v1::LayerPart>("layer: 'floor'")};
  ScriptedServer server(script);
  Client client(server.address());

  const absl::Status status = client.QueryPoint("office", {0, 0}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal);
  EXPECT_THAT(std::string(status.message()), HasSubstr("floor.kind"));
  AnswerReader reader = client.QueryArea("office", UnitSquare());
  EXPECT_EQ(reader.Next(), std::nullopt);
  EXPECT_EQ(reader.status().code(), absl::StatusCode::kInternal);
}

TEST(AnswerReaderTest, GivesThePartsInOrderThenOk) {
  Script script;
  script.revision = 9;
  script.parts = {
      ParseText<v1::LayerPart>(
          "layer: 'floor' kind: LAYER_KIND_OCCUPANCY status: ANSWER_STATUS_VALUE cells { "
          "grid { origin { x: 1 yaw: 0.5 } resolution_m: 0.1 } rows: [-1, 0] col_begins: [-3, 4] "
          "col_ends: [2, 5] values: [0.25, nan] }"),
      ParseText<v1::LayerPart>(
          "layer: 'objects' kind: LAYER_KIND_SEMANTIC status: ANSWER_STATUS_VALUE "
          "objects { " +
          std::string(kChair) + " }"),
      ParseText<v1::LayerPart>("layer: 'wifi' kind: LAYER_KIND_SCALAR status: "
                               "ANSWER_STATUS_NO_TRANSFORM")};
  ScriptedServer server(script);
  AnswerReader reader = Client(server.address()).QueryArea("office", UnitSquare());
  EXPECT_EQ(reader.revision(), 0);

  std::optional<LayerPart> part = reader.Next();
  ASSERT_TRUE(part.has_value()) << reader.status();
  EXPECT_EQ(part->layer, "floor");
  ASSERT_TRUE(part->grid.has_value());
  EXPECT_EQ(*part->grid, (GridGeometry{PlanarTransform(1, 0, 0.5), 0.1}));
  EXPECT_THAT(part->runs, ElementsAre(CellRun{-1, -3, 2, 0.25}, CellRun{0, 4, 5, std::nullopt}));

  part = reader.Next();
  ASSERT_TRUE(part.has_value()) << reader.status();
  EXPECT_THAT(part->objects, SizeIs(1));
  EXPECT_FALSE(part->grid.has_value());

  part = reader.Next();
  ASSERT_TRUE(part.has_value()) << reader.status();
  EXPECT_EQ(part->status, AnswerStatus::kNoTransform);

  EXPECT_FALSE(reader.Next().has_value());
  EXPECT_FALSE(reader.Next().has_value());
  EXPECT_TRUE(reader.status().ok()) << reader.status();
  EXPECT_EQ(reader.revision(), 9);
}

TEST(AnswerReaderTest, TellsTheRevisionWhereThereIsNoLayerToAsk) {
  Script script;
  script.revision = 9;
  ScriptedServer server(script);
  AnswerReader reader = Client(server.address()).QueryArea("office", UnitSquare());
  EXPECT_FALSE(reader.Next().has_value());
  EXPECT_TRUE(reader.status().ok()) << reader.status();
  EXPECT_EQ(reader.revision(), 9);
}

TEST(AnswerReaderTest, TellsWhyAnAnswerIsNotComplete) {
  Script script;
  script.parts = {ParseText<v1::LayerPart>(
      "layer: 'objects' kind: LAYER_KIND_SEMANTIC status: ANSWER_STATUS_VALUE")};
  script.status = grpc::Status(grpc::StatusCode::DATA_LOSS, "tile 3 is damaged");
  ScriptedServer server(script);
  AnswerReader reader = Client(server.address()).QueryValue("office", "chair");

  EXPECT_TRUE(reader.Next().has_value());
  EXPECT_FALSE(reader.Next().has_value());
  EXPECT_EQ(reader.status(), absl::DataLossError("tile 3 is damaged"));
}

TEST(AnswerReaderTest, DestroyingItTellsTheServerToStop) {
  Script script;
  script.endless = true;
  script.parts = {ParseText<v1::LayerPart>(
      "layer: 'objects' kind: LAYER_KIND_SEMANTIC status: ANSWER_STATUS_VALUE")};
  ScriptedServer server(script);
  {
    AnswerReader reader = Client(server.address()).QueryArea("office", UnitSquare());
    EXPECT_TRUE(reader.Next().has_value());
  }
  server.WaitForCancellation();
}

TEST(AnswerReaderTest, TheTimeoutBoundsTheWholeAnswer) {
  Script script;
  script.endless = true;
  script.parts = {ParseText<v1::LayerPart>(
      "layer: 'objects' kind: LAYER_KIND_SEMANTIC status: ANSWER_STATUS_VALUE")};
  ScriptedServer server(script);
  Client client(server.address());
  // Connects. A call whose time is over before that never reaches the server.
  ASSERT_TRUE(client.ListMaps().ok());
  AnswerReader reader =
      client.QueryArea("office", UnitSquare(), {}, {.timeout = absl::Seconds(1), .request_id = ""});
  ASSERT_TRUE(reader.Next().has_value()) << reader.status();
  while (reader.Next().has_value()) {
  }
  EXPECT_EQ(reader.status().code(), absl::StatusCode::kDeadlineExceeded);
  server.WaitForCancellation();
}

TEST(RequestIdTest, EveryMutationHasOneOfItsOwn) {
  ScriptedServer server({});
  Client client(server.address());
  ASSERT_TRUE(client.CreateMap("office").ok());
  ASSERT_TRUE(client.CreateLayer("office", {.name = "objects", .frame_id = ""}).ok());
  ASSERT_TRUE(client.SetTransform("office", {"map", "dock", PlanarTransform(1, 2, 3)}).ok());
  ASSERT_TRUE(client.ApplyEdits("office", {{DeleteObject{"objects", 3}}}).ok());
  ASSERT_TRUE(client.ImportMap("office", FileFormat::kHmap, {{"a.hmap", "zip"}}).ok());
  ASSERT_TRUE(client.DeleteLayer("office", "objects").ok());
  ASSERT_TRUE(client.DeleteMap("office").ok());

  const std::vector<std::string> ids = server.RequestIds();
  EXPECT_THAT(std::set<std::string>(ids.begin(), ids.end()), SizeIs(7));
  for (const std::string& id : ids) {
    EXPECT_EQ(id.size(), 32u);
    EXPECT_EQ(id.find_first_not_of("0123456789abcdef"), std::string::npos) << id;
  }
}

TEST(RequestIdTest, OneOfTheCallersOwnIsSentAsItIs) {
  ScriptedServer server({});
  Client client(server.address());
  const CallOptions options{.timeout = std::nullopt, .request_id = "shift-17/edit-4"};
  ASSERT_TRUE(client.ApplyEdits("office", {{DeleteObject{"objects", 3}}}, options).ok());
  ASSERT_TRUE(client.ApplyEdits("office", {{DeleteObject{"objects", 3}}}, options).ok());
  EXPECT_THAT(server.RequestIds(), ElementsAre("shift-17/edit-4", "shift-17/edit-4"));
}

TEST(ApplyEditsTest, WantedVersionsAreSent) {
  ScriptedServer server({});
  PutObject put{"objects", {}, ""};
  put.object.label = "chair";
  put.object.shape = UnitSquare();
  put.if_version = 4;
  put.time_to_live = absl::Milliseconds(1500);
  const EditBatch batch{{put, DeleteObject{"objects", 3, 7}}, {{"objects", 9}}, {}};
  ASSERT_TRUE(Client(server.address()).ApplyEdits("office", batch).ok());
  const std::vector<std::string> requests = server.Requests();
  ASSERT_THAT(requests, SizeIs(1));
  EXPECT_THAT(requests[0], HasSubstr("if_version: 4 time_to_live { seconds: 1 nanos: 500000000 }"));
  EXPECT_THAT(requests[0], HasSubstr("delete_object { layer: \"objects\" id: 3 if_version: 7 }"));
  EXPECT_THAT(requests[0], HasSubstr("if_layers { layer: \"objects\" version: 9 }"));
}

Script TransformScript() {
  Script script;
  script.transform = ParseText<v1::EstimateTransformResponse>(
      "source { map: 'attic' layer: 'floor' frame_id: 'map' revision: 3 incarnation: 8 } "
      "target { map: 'office' layer: 'plan' frame_id: 'site' revision: 12 incarnation: 9 } "
      "best { target_from_source { x: 2 y: -1.5 yaw: 0.25 } score: 0.9 } inlier_share: 0.97 "
      "runner_up { target_from_source { x: 4 } score: 0.8 } "
      "ambiguity: TRANSFORM_AMBIGUITY_RUNNER_UP");
  return script;
}

TEST(ClientTest, TransformIsThatBetweenTheSidesOfTheRequest) {
  ScriptedServer server(TransformScript());
  Client client(server.address());
  const TransformSide source{"attic", "floor", "", {.revision = 3}, 8};
  const TransformSide target{"office", "plan", "site", {.min_revision = 12}};
  const auto answer = client.EstimateTransform(source, target);
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->source.revision, 3);
  EXPECT_EQ(answer->target.frame_id, "site");
  EXPECT_EQ(answer->estimate.best.target_from_source, PlanarTransform(2, -1.5, 0.25));
  EXPECT_EQ(answer->estimate.ambiguity, registration::Ambiguity::kRunnerUp);
  EXPECT_THAT(
      server.Requests(),
      ElementsAre("EstimateTransform source { scope { map: \"attic\" layers: \"floor\" "
                  "incarnation: 8 } as_of { at_revision: 3 } } target { scope { map: \"office\" "
                  "layers: \"plan\" frame_id: \"site\" } as_of { min_revision: 12 } }"));
  // What was read of both sides is not read older again.
  (void)client.EstimateTransform({"office", "plan"}, {"attic", "floor"});
  EXPECT_THAT(server.Requests().back(), HasSubstr("seen_revision: 12 seen_incarnation: 9"));
  EXPECT_THAT(server.Requests().back(), HasSubstr("seen_revision: 3 seen_incarnation: 8"));
}

TEST(ClientTest, TransformFromPairsNamesNoLayers) {
  ScriptedServer server(TransformScript());
  const auto answer =
      Client(server.address())
          .EstimateTransformFromPairs({"attic"}, {"office"}, {{"door", {{0, 1}, {2, 3}, 0.1}}});
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_THAT(server.Requests(),
              ElementsAre("EstimateTransform source { scope { map: \"attic\" } } target { scope { "
                          "map: \"office\" } } pairs { name: \"door\" source { y: 1 } target { x: "
                          "2 y: 3 } sigma_m: 0.1 }"));
}

TEST(ClientTest, TransformThatCannotBeDecodedIsAnError) {
  Script script = TransformScript();
  script.transform.clear_ambiguity();
  ScriptedServer server(script);
  const auto answer = Client(server.address()).EstimateTransform({"attic", "a"}, {"office", "b"});
  EXPECT_TRUE(absl::IsInternal(answer.status())) << answer.status();
}

TEST(QueryTest, EveryQuestionCanBeOfThePast) {
  ScriptedServer server({});
  Client client(server.address());
  CallOptions options;
  options.as_of = {.revision = 5, .min_revision = 7};
  (void)client.QueryPoint("office", {1, 2}, {}, options);
  (void)client.QueryNearest("office", {1, 2}, "chair", 1, {}, options);
  client.QueryArea("office", UnitSquare(), {}, options).Next();
  client.QueryValue("office", "chair", {}, {}, options).Next();
  options.as_of = {.time = absl::FromUnixSeconds(60)};
  (void)client.QueryPoint("office", {1, 2}, {}, options);
  const std::vector<std::string> requests = server.Requests();
  ASSERT_THAT(requests, SizeIs(5));
  for (int i = 0; i < 4; ++i) {
    EXPECT_THAT(requests[i], HasSubstr("at_revision: 5 min_revision: 7"));
  }
  EXPECT_THAT(requests[4], HasSubstr("at_time { seconds: 60 }"));
}

TEST(ApplyEditsTest, EditsOfTheStructureAreSentLikeOthers) {
  ScriptedServer server({});
  ASSERT_TRUE(Client(server.address()).ApplyEdits("office", {{DeleteLayer{"objects"}}}).ok());
  EXPECT_THAT(server.Requests(),
              ElementsAre(HasSubstr("edits { delete_layer { layer: \"objects\" } }")));
}

TEST(ImportTest, FilesArriveInOrderAndWhole) {
  Script script;
  script.import = ParseText<v1::ImportMapResponse>(
      "map: 'office' revision: 2 layers: 'occupancy' repairs: 'one' repairs: 'two'");
  ScriptedServer server(script);
  std::string image;
  for (int i = 0; i < 3'000'000; ++i) image += static_cast<char>(i * 31 % 251);

  const auto answer =
      Client(server.address())
          .ImportMap("office", FileFormat::kNav2, {{"empty.yaml", ""}, {"image.pgm", image}},
                     {.layer = "floor", .frame_id = "", .create_map = true});

  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_THAT(answer->layers, ElementsAre("occupancy"));
  EXPECT_THAT(answer->repairs, ElementsAre("one", "two"));
  EXPECT_THAT(server.Requests(),
              ElementsAre("ImportMap map: \"office\" format: FILE_FORMAT_NAV2 layer: \"floor\" "
                          "create_map: true",
                          "file empty.yaml (0 bytes)", "file image.pgm (3000000 bytes)"));
  EXPECT_EQ(server.ImportedData(), image);
}

TEST(ExportTest, ChunksOfANameBecomeOneFile) {
  Script script;
  script.export_parts = {
      ParseText<v1::ExportMapResponse>("header { map: 'office' revision: 4 omissions: 'wifi' }"),
      ParseText<v1::ExportMapResponse>("chunk { file_name: 'a.yaml' data: 'ima' }"),
      ParseText<v1::ExportMapResponse>("chunk { file_name: 'a.yaml' data: 'ge' }"),
      ParseText<v1::ExportMapResponse>("chunk { file_name: 'a.pgm' data: 'P5' }")};
  ScriptedServer server(script);

  const auto answer = Client(server.address())
                          .ExportMap("office", FileFormat::kNav2, {{"floor"}, ImageFormat::kPgm});

  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->revision, 4);
  EXPECT_THAT(answer->omissions, ElementsAre("wifi"));
  ASSERT_THAT(answer->files, SizeIs(2));
  EXPECT_EQ(answer->files[0].name, "a.yaml");
  EXPECT_EQ(answer->files[0].data, "image");
  EXPECT_EQ(answer->files[1].data, "P5");
}

TEST(BackupTest, PiecesArriveInOrder) {
  Script script;
  script.backup_pieces = {"SQLite", " format 3"};
  ScriptedServer server(script);
  ByteReader reader = Client(server.address()).BackupMap("office");
  std::string data;
  while (std::optional<std::string> piece = reader.Next()) data += *piece;
  EXPECT_TRUE(reader.status().ok()) << reader.status();
  EXPECT_EQ(data, "SQLite format 3");
}

}  // namespace
}  // namespace hypermap::client
