// The incarnation of a map in requests and answers of all services.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "client_libs/cpp/client.h"
#include "server/services/testing/test_server.h"

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;

// An incarnation that no map of these tests has, but with a probability of 2^-64.
constexpr uint64_t kOther = 1;

constexpr char kMug[] =
    R"({"type":"FeatureCollection","features":[{"type":"Feature","properties":{"label":"mug"},)"
    R"("geometry":{"type":"Polygon","coordinates":[[[0,0],[1,0],[1,1],[0,0]]]}}]})";

// The map "site" with two cups, at revision 1.
class IncarnationTest : public ::testing::Test {
 protected:
  IncarnationTest() : client_(server_.address()) { MakeSite(); }

  void MakeSite() { server_.MakeMap("site", LayerOfCups("cups", 2)); }
  void MakeSiteAnew() {
    ASSERT_TRUE(server_.site().Delete("site", "").ok());
    MakeSite();
  }

  MapSession& session() { return **server_.site().Find("site"); }
  uint64_t incarnation() { return session().incarnation(); }
  Revision revision() { return session().snapshot()->revision; }
  static client::CallOptions Expecting(uint64_t incarnation) {
    client::CallOptions options;
    options.incarnation = incarnation;
    return options;
  }

  static void ExpectAborted(const absl::Status& status) {
    EXPECT_TRUE(absl::IsAborted(status)) << status;
    EXPECT_THAT(status.message(), HasSubstr("map \"site\" is another incarnation ("));
    EXPECT_THAT(status.message(), HasSubstr(absl::StrCat("than the request expects (", kOther)));
  }
  // Makes a call whose answer is a value, with another incarnation and with that of the map.
  template <typename Ask>
  void CheckAnswer(const Ask& ask) {
    ExpectAborted(ask(Expecting(kOther)).status());
    const auto answer = ask(Expecting(incarnation()));
    ASSERT_TRUE(answer.ok()) << answer.status();
    EXPECT_EQ(answer->incarnation, incarnation());
  }
  // Likewise for a call that changes the map and answers a revision only.
  template <typename Change>
  void CheckChange(const Change& change) {
    const Revision before = revision();
    ExpectAborted(change(Expecting(kOther)).status());
    EXPECT_EQ(revision(), before);
    const auto made = change(Expecting(incarnation()));
    EXPECT_TRUE(made.ok()) << made.status();
    EXPECT_EQ(revision(), before + 1);
  }
  // Likewise for a reader of parts.
  template <typename Open>
  void CheckReader(const Open& open) {
    auto refused = open(Expecting(kOther));
    EXPECT_FALSE(refused.Next().has_value());
    ExpectAborted(refused.status());
    auto reader = open(Expecting(incarnation()));
    EXPECT_TRUE(reader.Next().has_value());
    EXPECT_EQ(reader.incarnation(), incarnation());
    while (reader.Next()) {
    }
    EXPECT_TRUE(reader.status().ok()) << reader.status();
  }

  static EditBatch OneCup() {
    EditBatch batch = LayerOfCups("cups", 1);
    batch.edits.erase(batch.edits.begin());
    return batch;
  }

  TestServer server_;
  client::Client client_;
};

TEST_F(IncarnationTest, MapsAreListedWithTheirs) {
  server_.MakeMap("yard", LayerOfCups("cups", 1));
  const auto maps = client_.ListMaps();
  ASSERT_TRUE(maps.ok()) << maps.status();
  ASSERT_EQ(maps->size(), 2u);
  EXPECT_EQ((*maps)[0].incarnation, incarnation());
  EXPECT_NE((*maps)[0].incarnation, 0u);
  EXPECT_NE((*maps)[1].incarnation, incarnation());
  EXPECT_EQ(client_.GetMap("site")->incarnation, incarnation());
  EXPECT_NE(client_.CreateMap("hall")->incarnation, 0u);
}

TEST_F(IncarnationTest, AnswersOfTheCatalogHaveIt) {
  EXPECT_EQ(client_.ListLayers("site")->incarnation, incarnation());
  EXPECT_EQ(client_.ListTransforms("site")->incarnation, incarnation());
  EXPECT_EQ(client_.ExportMap("site", client::FileFormat::kHmap)->incarnation, incarnation());
  EXPECT_EQ(client_.ListExplorations("site")->incarnation, incarnation());
}

TEST_F(IncarnationTest, QueriesAreCheckedAndAnsweredWithIt) {
  CheckAnswer([&](const client::CallOptions& options) {
    return client_.QueryPoint("site", {0.5, 0.5}, {}, options);
  });
  CheckAnswer([&](const client::CallOptions& options) {
    return client_.QueryNearest("site", {0.5, 0.5}, "cup", 1, {}, options);
  });
  CheckReader([&](const client::CallOptions& options) {
    return client_.QueryArea("site", Polygon::FromBox({{0, 0}, {9, 9}}), {}, options);
  });
  CheckReader([&](const client::CallOptions& options) {
    return client_.QueryValue("site", "cup", std::nullopt, {}, options);
  });
  CheckAnswer([&](const client::CallOptions& options) {
    const std::vector<Point> points = {{0.5, 0.5}};
    return client_.QueryPoints("site", {}, options)->Ask(points);
  });
}

TEST_F(IncarnationTest, QueriesOfThePastAreCheckedAndAnsweredWithIt) {
  ASSERT_TRUE(client_.ApplyEdits("site", OneCup()).ok());
  const auto of_the_past = [](client::CallOptions options) {
    options.as_of.revision = 1;
    return options;
  };
  CheckAnswer([&](const client::CallOptions& options) {
    return client_.QueryPoint("site", {0.5, 0.5}, {}, of_the_past(options));
  });
  CheckAnswer([&](const client::CallOptions& options) {
    const std::vector<Point> points = {{0.5, 0.5}};
    return client_.QueryPoints("site", {}, of_the_past(options))->Ask(points);
  });
}

TEST_F(IncarnationTest, AStreamOfThePastEndsIfTheMapIsMadeAnew) {
  client::CallOptions options;
  options.as_of.revision = 1;
  ASSERT_TRUE(client_.ApplyEdits("site", OneCup()).ok());
  const auto stream = client_.QueryPoints("site", {}, options);
  const std::vector<Point> points = {{0.5, 0.5}};
  ASSERT_TRUE(stream->Ask(points).ok());
  MakeSiteAnew();
  ASSERT_TRUE(client_.ApplyEdits("site", OneCup()).ok());
  EXPECT_TRUE(absl::IsAborted(stream->Ask(points).status()));
}

// A map that was made anew may never have the revision.
TEST_F(IncarnationTest, AQueryOfAnotherIncarnationDoesNotWaitForItsRevision) {
  client::CallOptions options = Expecting(kOther);
  options.as_of.min_revision = 1000;
  ExpectAborted(client_.QueryPoint("site", {0.5, 0.5}, {}, options).status());
  client::AnswerReader reader =
      client_.QueryArea("site", Polygon::FromBox({{0, 0}, {9, 9}}), {}, options);
  EXPECT_FALSE(reader.Next().has_value());
  ExpectAborted(reader.status());
  const std::vector<Point> points = {{0.5, 0.5}};
  ExpectAborted(client_.QueryPoints("site", {}, options)->Ask(points).status());
}

TEST_F(IncarnationTest, EditsAreCheckedAndAnsweredWithIt) {
  CheckAnswer([&](const client::CallOptions& options) {
    return client_.ApplyEdits("site", OneCup(), options);
  });
  LayerSpec layer;
  layer.name = "things";
  CheckChange([&](const client::CallOptions& options) {
    return client_.CreateLayer("site", layer, options);
  });
  CheckChange([&](const client::CallOptions& options) {
    return client_.SetTransform("site", {"map", "base", PlanarTransform(1, 2, 0)}, options);
  });
  CheckChange([&](const client::CallOptions& options) {
    return client_.DeleteLayer("site", "things", options);
  });
  CheckAnswer([&](const client::CallOptions& options) {
    return client_.ImportMap("site", client::FileFormat::kGeoJson, {{"mugs.geojson", kMug}},
                             {.layer = "mugs"}, options);
  });
}

TEST_F(IncarnationTest, AnswersToEditsHaveIt) {
  {
    v1::CreateLayerRequest request;
    request.set_map("site");
    request.mutable_layer()->set_name("things");
    request.mutable_layer()->set_kind(v1::LAYER_KIND_SEMANTIC);
    grpc::ClientContext context;
    v1::CreateLayerResponse response;
    ASSERT_TRUE(server_.catalog->CreateLayer(&context, request, &response).ok());
    EXPECT_EQ(response.map(), "site");
    EXPECT_EQ(response.incarnation(), incarnation());
  }
  {
    v1::DeleteLayerRequest request;
    request.set_map("site");
    request.set_layer("things");
    grpc::ClientContext context;
    v1::DeleteLayerResponse response;
    ASSERT_TRUE(server_.catalog->DeleteLayer(&context, request, &response).ok());
    EXPECT_EQ(response.map(), "site");
    EXPECT_EQ(response.incarnation(), incarnation());
  }
}

TEST_F(IncarnationTest, ObservationsAndTheirCommandsAreCheckedAndAnsweredWithIt) {
  const auto stream = client_.Observe("site", "cups");
  ASSERT_TRUE(stream.ok()) << stream.status();
  EXPECT_EQ((*stream)->opened().incarnation, incarnation());
  ExpectAborted(client_.RebuildLayer("site", "cups", "other", "", Expecting(kOther)).status());
  const auto rebuilt = client_.RebuildLayer("site", "cups", "other", "", Expecting(incarnation()));
  EXPECT_TRUE(rebuilt.ok()) << rebuilt.status();
  ExpectAborted(client_
                    .RetractSource("site", "cups", "cart", absl::InfinitePast(),
                                   absl::InfiniteFuture(), Expecting(kOther))
                    .status());
  const PoseCorrection correction{"cart", {CorrectedPose{}}};
  ExpectAborted(client_.CorrectPoses("site", "cups", correction, "", Expecting(kOther)).status());
  ExpectAborted(client_.SmoothPoses("site", "cups", "", Expecting(kOther)).status());
}

// Without the check, the old map's edit would be carried out anew, because the new map does not
// know its request_id.
TEST_F(IncarnationTest, ARetryIsNotCarriedOutInAMapMadeAnew) {
  client::CallOptions options = Expecting(incarnation());
  options.request_id = "edit-1";
  ASSERT_TRUE(client_.ApplyEdits("site", OneCup(), options).ok());
  ASSERT_TRUE(client_.ApplyEdits("site", OneCup(), options).ok());
  EXPECT_EQ(revision(), 2);
  MakeSiteAnew();
  EXPECT_TRUE(absl::IsAborted(client_.ApplyEdits("site", OneCup(), options).status()));
  EXPECT_EQ(revision(), 1);
}

TEST_F(IncarnationTest, DeletingAnotherIncarnationLeavesTheMap) {
  const uint64_t before = incarnation();
  MakeSiteAnew();
  EXPECT_TRUE(absl::IsAborted(client_.DeleteMap("site", Expecting(before))));
  EXPECT_TRUE(client_.GetMap("site").ok());
  EXPECT_TRUE(client_.QueryPoint("site", {0.5, 0.5}).ok());
  EXPECT_TRUE(client_.DeleteMap("site", Expecting(incarnation())).ok());
  EXPECT_TRUE(absl::IsNotFound(client_.GetMap("site").status()));
}

TEST_F(IncarnationTest, AnImportIntoAMapThatIsGoneDoesNotMakeItAnew) {
  const client::CallOptions options = Expecting(incarnation());
  ASSERT_TRUE(client_.DeleteMap("site").ok());
  const auto refused =
      client_.ImportMap("site", client::FileFormat::kGeoJson, {{"mugs.geojson", kMug}},
                        {.layer = "mugs", .create_map = true}, options);
  EXPECT_TRUE(absl::IsAborted(refused.status())) << refused.status();
  EXPECT_TRUE(absl::IsNotFound(client_.GetMap("site").status()));
}

TEST_F(IncarnationTest, HistoryIsCheckedAndToldWithIt) {
  ASSERT_TRUE(client_.ApplyEdits("site", OneCup()).ok());
  CheckReader([&](const client::CallOptions& options) {
    return client_.ListChanges("site", 1, std::nullopt, {}, options);
  });
  CheckAnswer([&](const client::CallOptions& options) {
    return client_.ListRevisions("site", {}, options);
  });
}

TEST_F(IncarnationTest, EveryMessageOfAWatchHasIt) {
  for (const bool coalesce : {false, true}) {
    client::Watcher watcher = client_.Watch("site", {.coalesce = coalesce, .resume = false});
    ASSERT_TRUE(watcher.Next().has_value()) << watcher.status();
    // The first commit takes the shared messages of all watches with the filter; that of a new
    // layer is encoded for the watch alone.
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(client_.ApplyEdits("site", OneCup()).ok());
    ASSERT_TRUE(client_.CreateLayer("site", {.name = coalesce ? "two" : "one"}).ok());
    const Revision newest = revision();
    for (Revision told = 0; told < newest;) {
      const std::optional<client::WatchEvent> event = watcher.Next();
      ASSERT_TRUE(event.has_value()) << watcher.status();
      EXPECT_EQ(event->incarnation, incarnation());
      EXPECT_EQ(watcher.incarnation(), incarnation());
      told = event->revision;
    }
  }
}

TEST_F(IncarnationTest, AWatchOfAnotherIncarnationIsAborted) {
  for (const std::optional<Revision> start :
       {std::optional<Revision>(1), std::optional<Revision>()}) {
    client::Watcher watcher =
        client_.Watch("site", {.start_revision = start, .incarnation = kOther});
    EXPECT_FALSE(watcher.Next().has_value());
    ExpectAborted(watcher.status());
    client::Watcher replication =
        client_.Replicate("site", {.start_revision = start, .incarnation = kOther});
    EXPECT_FALSE(replication.Next().has_value());
    ExpectAborted(replication.status());
  }
  client::Watcher replication =
      client_.Replicate("site", {.start_revision = 1, .incarnation = incarnation()});
  const std::optional<client::WatchEvent> event = replication.Next();
  ASSERT_TRUE(event.has_value()) << replication.status();
  EXPECT_EQ(event->incarnation, incarnation());
  EXPECT_EQ(event->map->incarnation, incarnation());
}

// The new map has the revision, too, so that its number alone does not tell the two apart.
TEST_F(IncarnationTest, AWatchIsNotResumedInAMapMadeAnew) {
  const uint64_t before = incarnation();
  MakeSiteAnew();
  client::WatchOptions options{.start_revision = 1, .incarnation = before};
  {
    client::Watcher watcher = client_.Watch("site", options);
    EXPECT_FALSE(watcher.Next().has_value());
    EXPECT_TRUE(absl::IsAborted(watcher.status())) << watcher.status();
  }
  options.snapshot_when_compacted = true;
  client::Watcher watcher = client_.Watch("site", options);
  const std::optional<client::WatchEvent> event = watcher.Next();
  ASSERT_TRUE(event.has_value()) << watcher.status();
  EXPECT_TRUE(event->snapshot);
  EXPECT_TRUE(event->reset);
  EXPECT_EQ(event->changes.size(), 2u);
  EXPECT_EQ(watcher.incarnation(), incarnation());
}

TEST_F(IncarnationTest, WithoutOneAnyIsTaken) {
  MakeSiteAnew();
  EXPECT_TRUE(client_.QueryPoint("site", {0.5, 0.5}).ok());
  ASSERT_TRUE(client_.ApplyEdits("site", OneCup()).ok());
  client::Watcher watcher = client_.Watch("site", {.start_revision = 1});
  const std::optional<client::WatchEvent> event = watcher.Next();
  ASSERT_TRUE(event.has_value()) << watcher.status();
  EXPECT_EQ(event->revision, 2);
}

}  // namespace
}  // namespace hypermap::server
