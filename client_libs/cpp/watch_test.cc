#include "client_libs/cpp/watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>

#include <cstddef>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client_libs/cpp/client.h"
#include "client_libs/testing/scripted_server.h"
#include "client_libs/testing/text_message.h"

namespace hypermap::client {
namespace {

using hypermap::testing::ParseText;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;
using ::testing::SizeIs;

v1::WatchResponse Told(const std::string& text) { return ParseText<v1::WatchResponse>(text); }

// A revision that removes the objects with these ids.
v1::WatchResponse Removes(Revision revision, const std::vector<int>& ids, bool more = false) {
  v1::WatchResponse response;
  response.set_revision(revision);
  for (const int id : ids) {
    v1::Change* change = response.add_changes();
    change->set_kind(v1::CHANGE_KIND_REMOVE);
    change->set_layer("objects");
    change->set_object_id(id);
  }
  response.set_more(more);
  return response;
}

ScriptedWatch Broken(std::vector<v1::WatchResponse> responses,
                     grpc::StatusCode code = grpc::StatusCode::UNAVAILABLE) {
  return {std::move(responses), false, grpc::Status(code, "broken")};
}

ScriptedWatch Open(std::vector<v1::WatchResponse> responses) {
  return {std::move(responses), true, grpc::Status::OK};
}

std::vector<ObjectId> IdsOf(const WatchEvent& event) {
  std::vector<ObjectId> ids;
  for (const MapChange& change : event.changes) ids.push_back(change.object_id);
  return ids;
}

TEST(WatcherTest, TellsWhatEachChangeIs) {
  Script script;
  script.watches = {Open({Told(R"(
      revision: 7 time { seconds: 60 } author: "cart"
      changes { kind: CHANGE_KIND_PUT layer: "objects" object_id: 4 object { id: 4 label: "chair"
                version: 7 shape { polygon { outer { xs: [0, 1, 0] ys: [0, 0, 1] } } } } }
      changes { kind: CHANGE_KIND_CELLS layer: "floor" cells { grid { resolution_m: 0.5 }
                rows: 1 col_begins: 2 col_ends: 5 values: nan } }
      changes { kind: CHANGE_KIND_LAYER_CREATED layer: "wifi"
                layer_now { name: "wifi" kind: LAYER_KIND_SEMANTIC version: 7 } }
      changes { kind: CHANGE_KIND_TRANSFORM transform { parent_frame_id: "map"
                child_frame_id: "dock" parent_from_child { x: 3 } } })")})};
  ScriptedServer server(script);
  Watcher watcher = Client(server.address()).Watch("office");

  const std::optional<WatchEvent> event = watcher.Next();
  ASSERT_TRUE(event.has_value()) << watcher.status();
  EXPECT_EQ(event->revision, 7);
  EXPECT_EQ(event->time, absl::FromUnixSeconds(60));
  EXPECT_EQ(event->author, "cart");
  EXPECT_FALSE(event->snapshot);
  ASSERT_THAT(event->changes, SizeIs(4));
  EXPECT_EQ(event->changes[0].kind, ChangeKind::kPut);
  EXPECT_EQ(event->changes[0].object->label, "chair");
  EXPECT_EQ(event->changes[0].object->version, 7);
  EXPECT_EQ(event->changes[1].grid->resolution_m, 0.5);
  EXPECT_THAT(event->changes[1].cells, ElementsAre(CellRun{1, 2, 5, std::nullopt}));
  EXPECT_EQ(event->changes[2].layer_now->version, 7);
  EXPECT_EQ(event->changes[3].transform->child_frame_id, "dock");
}

TEST(WatcherTest, ChangesMayBeCountedOnly) {
  v1::WatchResponse first = Removes(5, {1, 2});
  first.mutable_time()->set_seconds(60);
  first.set_author("cart");
  first.set_incarnation(77);
  v1::WatchResponse together;
  *together.add_coalesced() = Removes(6, {3}, true);
  *together.add_coalesced() = Removes(6, {4, 5});
  *together.add_coalesced() = Removes(7, {});
  Script script;
  script.watches = {Broken({first, Removes(6, {3}, true)}), Open({together})};
  ScriptedServer server(script);
  WatchOptions options;
  options.with_changes = false;
  Watcher watcher = Client(server.address()).Watch("office", options);
  const std::optional<WatchEvent> event = watcher.Next();
  ASSERT_TRUE(event.has_value()) << watcher.status();
  EXPECT_EQ(event->revision, 5);
  EXPECT_EQ(event->time, absl::FromUnixSeconds(60));
  EXPECT_EQ(event->author, "cart");
  EXPECT_EQ(event->incarnation, 77U);
  EXPECT_EQ(event->num_changes, 2);
  EXPECT_THAT(event->changes, SizeIs(0));
  std::vector<std::pair<Revision, int64_t>> told;
  for (int i = 0; i < 2; ++i) {
    const std::optional<WatchEvent> next = watcher.Next();
    ASSERT_TRUE(next.has_value()) << watcher.status();
    told.emplace_back(next->revision, next->num_changes);
  }
  EXPECT_THAT(told, ElementsAre(Pair(6, 3), Pair(7, 0)));
  EXPECT_EQ(watcher.num_resumed(), 1);
}

TEST(WatcherTest, RevisionThatIsRepeatedIsFoundByACountingWatchToo) {
  Script script;
  script.watches = {Open({Removes(5, {1}), Removes(5, {2})})};
  ScriptedServer server(script);
  WatchOptions options;
  options.with_changes = false;
  Watcher watcher = Client(server.address()).Watch("office", options);
  EXPECT_TRUE(watcher.Next().has_value());
  EXPECT_FALSE(watcher.Next().has_value());
  EXPECT_TRUE(absl::IsInternal(watcher.status())) << watcher.status();
}

TEST(WatcherTest, AsksWithItsFilter) {
  Script script;
  script.watches = {Open({Removes(1, {})})};
  ScriptedServer server(script);
  WatchOptions options;
  options.scope = {{"objects"}, "dock"};
  options.area = Polygon::FromBox({{0, 0}, {1, 1}});
  options.classes = {"chair", "sofa"};
  options.start_revision = 0;
  Watcher watcher = Client(server.address()).Watch("office", options);
  ASSERT_TRUE(watcher.Next().has_value());
  EXPECT_THAT(
      server.Requests(),
      ElementsAre("Watch scope { map: \"office\" layers: \"objects\" frame_id: \"dock\" } area { "
                  "outer { xs: 0 xs: 1 xs: 1 xs: 0 ys: 0 ys: 0 ys: 1 ys: 1 } } "
                  "classes: \"chair\" classes: \"sofa\" "
                  "start_revision: 0 coalesce: true"));
}

TEST(WatcherTest, ARevisionInPartsIsToldWhole) {
  Script script;
  script.watches = {Open({Removes(5, {1, 2}, true), Removes(5, {3}, true), Removes(5, {4}),
                          Removes(6, {}), Removes(8, {5})})};
  ScriptedServer server(script);
  Watcher watcher = Client(server.address()).Watch("office");
  EXPECT_EQ(watcher.revision(), std::nullopt);
  EXPECT_THAT(IdsOf(*watcher.Next()), ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(watcher.revision(), 5);
  EXPECT_THAT(watcher.Next()->changes, SizeIs(0));
  EXPECT_EQ(watcher.revision(), 6);
  EXPECT_THAT(IdsOf(*watcher.Next()), ElementsAre(5));
}

// One message that contains the others.
v1::WatchResponse Coalesced(const std::vector<v1::WatchResponse>& messages) {
  v1::WatchResponse response;
  for (const v1::WatchResponse& message : messages) *response.add_coalesced() = message;
  return response;
}

TEST(WatcherTest, MessagesThatComeTogetherAreToldOneByOne) {
  Script script;
  script.watches = {
      Broken({Removes(5, {1}),
              Coalesced({Removes(6, {2}), Removes(7, {}), Removes(8, {3}, true), Removes(8, {4})}),
              Coalesced({Removes(9, {5}), Removes(10, {6}, true)})}),
      Open({Coalesced({Removes(10, {6, 7}), Removes(12, {8})})})};
  ScriptedServer server(script);
  Watcher watcher = Client(server.address()).Watch("office");
  std::vector<std::pair<Revision, std::vector<ObjectId>>> told;
  for (int i = 0; i < 7; ++i) {
    const std::optional<WatchEvent> event = watcher.Next();
    ASSERT_TRUE(event.has_value()) << watcher.status();
    EXPECT_EQ(watcher.revision(), event->revision);
    told.emplace_back(event->revision, IdsOf(*event));
  }
  using Ids = std::vector<ObjectId>;
  EXPECT_THAT(told,
              ElementsAre(Pair(5, Ids{1}), Pair(6, Ids{2}), Pair(7, Ids{}), Pair(8, Ids{3, 4}),
                          Pair(9, Ids{5}), Pair(10, Ids{6, 7}), Pair(12, Ids{8})));
  EXPECT_EQ(server.Requests()[1],
            "Watch scope { map: \"office\" } start_revision: 9 coalesce: true");
}

// Messages that keep the ones before them are destroyed one within the other.
TEST(WatcherTest, KeepsNoMessagesThatItHasTaken) {
  constexpr int kMessages = 20'000;
  constexpr size_t kSmallStack = size_t{1} << 18;
  std::vector<v1::WatchResponse> messages;
  for (int i = 0; i < kMessages; ++i) {
    messages.push_back(Coalesced({Removes(2 * i + 1, {1}), Removes(2 * i + 2, {2})}));
  }
  Script script;
  script.watches = {Open(std::move(messages))};
  ScriptedServer server(script);
  auto watcher = std::make_unique<Watcher>(Client(server.address()).Watch("office"));
  while (watcher->revision().value_or(0) < 2 * kMessages) ASSERT_TRUE(watcher->Next().has_value());

  pthread_attr_t small;
  pthread_attr_init(&small);
  ASSERT_EQ(pthread_attr_setstacksize(&small, kSmallStack), 0);
  pthread_t thread;
  const auto destroy = [](void* watch) -> void* {
    static_cast<std::unique_ptr<Watcher>*>(watch)->reset();
    return nullptr;
  };
  ASSERT_EQ(pthread_create(&thread, &small, destroy, &watcher), 0);
  pthread_join(thread, nullptr);
  pthread_attr_destroy(&small);
  EXPECT_EQ(watcher, nullptr);
}

TEST(WatcherTest, AsksForSingleMessagesWhenTold) {
  Script script;
  script.watches = {Open({Removes(1, {})})};
  ScriptedServer server(script);
  WatchOptions options;
  options.coalesce = false;
  Watcher watcher = Client(server.address()).Watch("office", options);
  ASSERT_TRUE(watcher.Next().has_value());
  EXPECT_THAT(server.Requests(), ElementsAre("Watch scope { map: \"office\" }"));
}

TEST(WatcherTest, GoesOnAfterTheLastWholeRevision) {
  Script script;
  script.watches = {Broken({Removes(5, {1}), Removes(6, {2}, true)}),
                    Broken({}, grpc::StatusCode::RESOURCE_EXHAUSTED),
                    Broken({Removes(6, {2, 3}), Removes(9, {})}, grpc::StatusCode::CANCELLED),
                    Broken({}, grpc::StatusCode::OK), Open({Removes(10, {4})})};
  ScriptedServer server(script);
  Watcher watcher = Client(server.address()).Watch("office");
  std::vector<std::vector<ObjectId>> told;
  for (int i = 0; i < 4; ++i) {
    const std::optional<WatchEvent> event = watcher.Next();
    ASSERT_TRUE(event.has_value()) << watcher.status();
    told.push_back(IdsOf(*event));
  }
  using Ids = std::vector<ObjectId>;
  EXPECT_THAT(told, ElementsAre(Ids{1}, Ids{2, 3}, Ids{}, Ids{4}));
  EXPECT_THAT(server.Requests(),
              ElementsAre("Watch scope { map: \"office\" } coalesce: true",
                          "Watch scope { map: \"office\" } start_revision: 5 coalesce: true",
                          "Watch scope { map: \"office\" } start_revision: 5 coalesce: true",
                          "Watch scope { map: \"office\" } start_revision: 9 coalesce: true",
                          "Watch scope { map: \"office\" } start_revision: 9 coalesce: true"));
  EXPECT_EQ(watcher.num_resumed(), 2);
}

TEST(WatcherTest, ASnapshotThatBrokeOffIsAskedForAgain) {
  Script script;
  v1::WatchResponse part = Removes(5, {1}, true);
  part.set_snapshot(true);
  v1::WatchResponse whole = Removes(6, {2});
  whole.set_snapshot(true);
  script.watches = {Broken({part}), Open({whole})};
  ScriptedServer server(script);
  Watcher watcher = Client(server.address()).Watch("office");
  const std::optional<WatchEvent> event = watcher.Next();
  ASSERT_TRUE(event.has_value()) << watcher.status();
  EXPECT_THAT(IdsOf(*event), ElementsAre(2));
  EXPECT_TRUE(event->snapshot);
  EXPECT_FALSE(event->reset);
}

TEST(WatcherTest, FindsTheServerThatIsNotThereYet) {
  Script script;
  script.outage = 2;
  script.watches = {Open({Removes(5, {1})})};
  ScriptedServer server(script);
  Watcher watcher = Client(server.address()).Watch("office");
  EXPECT_TRUE(watcher.Next().has_value()) << watcher.status();
  EXPECT_EQ(watcher.num_resumed(), 0);
}

TEST(WatcherTest, ASilentConnectionIsTakenForBroken) {
  Script script;
  script.watches = {Open({Removes(5, {1})}), Broken({Removes(6, {2})})};
  ScriptedServer server(script);
  WatchOptions options;
  // Long enough for the first message of a call on a busy machine.
  options.idle_timeout = absl::Seconds(2);
  Watcher watcher = Client(server.address()).Watch("office", options);
  EXPECT_EQ(watcher.Next()->revision, 5);
  const std::optional<WatchEvent> event = watcher.Next();
  ASSERT_TRUE(event.has_value()) << watcher.status();
  EXPECT_EQ(event->revision, 6);
  EXPECT_EQ(server.Requests()[1],
            "Watch scope { map: \"office\" } start_revision: 5 coalesce: true");
}

TEST(WatcherTest, EndsWhereItMayNotGoOn) {
  Script script;
  script.watches = {Broken({Removes(5, {1})}), Broken({Removes(5, {1})})};
  {
    ScriptedServer server(script);
    WatchOptions options;
    options.resume = false;
    Watcher watcher = Client(server.address()).Watch("office", options);
    EXPECT_TRUE(watcher.Next().has_value());
    EXPECT_FALSE(watcher.Next().has_value());
    EXPECT_EQ(watcher.status(), absl::UnavailableError("broken"));
  }
  script.watches = {Broken({}, grpc::StatusCode::NOT_FOUND)};
  {
    ScriptedServer server(script);
    Watcher watcher = Client(server.address()).Watch("office");
    EXPECT_FALSE(watcher.Next().has_value());
    EXPECT_EQ(watcher.status(), absl::NotFoundError("broken"));
  }
  // Its token was revoked.
  script.watches = {Broken({Removes(5, {1})}, grpc::StatusCode::UNAUTHENTICATED)};
  {
    ScriptedServer server(script);
    Watcher watcher = Client(server.address()).Watch("office");
    EXPECT_TRUE(watcher.Next().has_value());
    EXPECT_FALSE(watcher.Next().has_value());
    EXPECT_EQ(watcher.status(), absl::UnauthenticatedError("broken"));
    EXPECT_THAT(server.Requests(), SizeIs(1));
  }
}

TEST(WatcherTest, CompactionEndsItOrBringsASnapshot) {
  Script script;
  v1::WatchResponse snapshot = Removes(90, {2});
  snapshot.set_snapshot(true);
  script.watches = {Broken({Removes(5, {1})}), Broken({}, grpc::StatusCode::OUT_OF_RANGE),
                    Open({snapshot, Removes(91, {3})})};
  {
    ScriptedServer server(script);
    Watcher watcher = Client(server.address()).Watch("office");
    EXPECT_TRUE(watcher.Next().has_value());
    EXPECT_FALSE(watcher.Next().has_value());
    EXPECT_EQ(watcher.status(), absl::OutOfRangeError("broken"));
  }
  {
    ScriptedServer server(script);
    WatchOptions options;
    options.snapshot_when_compacted = true;
    Watcher watcher = Client(server.address()).Watch("office", options);
    EXPECT_FALSE(watcher.Next()->snapshot);
    const std::optional<WatchEvent> event = watcher.Next();
    ASSERT_TRUE(event.has_value()) << watcher.status();
    EXPECT_TRUE(event->snapshot);
    EXPECT_TRUE(event->reset);
    EXPECT_EQ(event->revision, 90);
    EXPECT_EQ(watcher.Next()->revision, 91);
    EXPECT_EQ(server.Requests().back(), "Watch scope { map: \"office\" } coalesce: true");
  }
}

// Another map may have the same revision, with other content.
TEST(WatcherTest, AnotherIncarnationEndsItOrBringsASnapshot) {
  Script script;
  v1::WatchResponse before = Removes(5, {1});
  before.set_incarnation(70);
  v1::WatchResponse snapshot = Removes(2, {2});
  snapshot.set_snapshot(true);
  snapshot.set_incarnation(80);
  v1::WatchResponse after = Removes(3, {3});
  after.set_incarnation(80);
  script.watches = {Broken({before}), Broken({}, grpc::StatusCode::ABORTED),
                    Open({snapshot, after})};
  const std::string resumed =
      "Watch scope { map: \"office\" incarnation: 70 } start_revision: 5 coalesce: true";
  {
    ScriptedServer server(script);
    Watcher watcher = Client(server.address()).Watch("office");
    EXPECT_EQ(watcher.Next()->incarnation, 70u);
    EXPECT_FALSE(watcher.Next().has_value());
    EXPECT_EQ(watcher.status(), absl::AbortedError("broken"));
    EXPECT_EQ(server.Requests().back(), resumed);
  }
  {
    ScriptedServer server(script);
    WatchOptions options;
    options.snapshot_when_compacted = true;
    Watcher watcher = Client(server.address()).Watch("office", options);
    EXPECT_FALSE(watcher.Next()->snapshot);
    EXPECT_EQ(watcher.incarnation(), 70u);
    const std::optional<WatchEvent> event = watcher.Next();
    ASSERT_TRUE(event.has_value()) << watcher.status();
    EXPECT_TRUE(event->snapshot);
    EXPECT_TRUE(event->reset);
    EXPECT_EQ(event->revision, 2);
    EXPECT_EQ(watcher.incarnation(), 80u);
    EXPECT_EQ(watcher.Next()->revision, 3);
    EXPECT_EQ(server.Requests()[1], resumed);
    EXPECT_EQ(server.Requests().back(), "Watch scope { map: \"office\" } coalesce: true");
  }
}

TEST(WatcherTest, ASnapshotInPlaceOfARevisionTakesNoRetry) {
  for (const auto code : {grpc::StatusCode::ABORTED, grpc::StatusCode::OUT_OF_RANGE}) {
    Script script;
    v1::WatchResponse snapshot = Removes(2, {2});
    snapshot.set_snapshot(true);
    script.watches = {Broken({}, code), Open({snapshot})};
    ScriptedServer server(script);
    WatchOptions options;
    options.start_revision = 1;
    options.incarnation = 70;
    options.snapshot_when_compacted = true;
    options.retry_for = absl::ZeroDuration();
    Watcher watcher =
        Client(server.address(), {.retry_for = absl::ZeroDuration()}).Watch("office", options);
    const std::optional<WatchEvent> event = watcher.Next();
    ASSERT_TRUE(event.has_value()) << watcher.status();
    EXPECT_TRUE(event->snapshot);
    EXPECT_EQ(event->revision, 2);
  }
}

TEST(WatcherTest, ARevisionThatComesAgainIsAnError) {
  Script script;
  script.watches = {Open({Removes(5, {1}), Removes(5, {1})})};
  ScriptedServer server(script);
  Watcher watcher = Client(server.address()).Watch("office");
  EXPECT_TRUE(watcher.Next().has_value());
  EXPECT_FALSE(watcher.Next().has_value());
  EXPECT_EQ(watcher.status().code(), absl::StatusCode::kInternal);
  EXPECT_THAT(std::string(watcher.status().message()), HasSubstr("revision 5 was told after 5"));
}

TEST(WatcherTest, CancelEndsItFromAnotherThread) {
  Script script;
  script.watches = {Open({Removes(5, {1})})};
  ScriptedServer server(script);
  Watcher watcher = Client(server.address()).Watch("office");
  ASSERT_TRUE(watcher.Next().has_value());
  std::thread canceller([&] { watcher.Cancel(); });
  EXPECT_FALSE(watcher.Next().has_value());
  canceller.join();
  EXPECT_EQ(watcher.status().code(), absl::StatusCode::kCancelled);
  server.WaitForCancellation();
}

TEST(WatcherTest, DestroyingItTellsTheServerToStop) {
  Script script;
  script.watches = {Open({Removes(5, {1})})};
  ScriptedServer server(script);
  {
    Watcher watcher = Client(server.address()).Watch("office");
    EXPECT_TRUE(watcher.Next().has_value());
  }
  server.WaitForCancellation();
}

TEST(ReplicateTest, ReportsTheMapAndEachTimeAndEndsAtABreak) {
  Script script;
  script.outage = 1;
  script.replications = {
      {{ParseText<v1::ReplicateResponse>(
            "revision: 7 time { seconds: 60 } map { name: 'office' "
            "frame_id: 'hall' revision: 9 create_time { seconds: 5 } }"),
        ParseText<v1::ReplicateResponse>(
            "coalesced { revision: 8 time { seconds: 61 } author: 'cart' "
            "changes { kind: CHANGE_KIND_REMOVE layer: 'objects' object_id: 4 } } "
            "coalesced { revision: 9 time { seconds: 62 } }")},
       /*stays=*/false,
       grpc::Status(grpc::StatusCode::UNAVAILABLE, "broken")}};
  ScriptedServer server(script);
  Watcher watcher = Client(server.address())
                        .Replicate("office", {.scope = {{"objects"}, "dock"},
                                              .area = Polygon::FromBox({{0, 0}, {1, 1}}),
                                              .start_revision = 6,
                                              .incarnation = 9,
                                              .start_time = absl::FromUnixSeconds(50)});
  const std::optional<WatchEvent> first = watcher.Next();
  ASSERT_TRUE(first.has_value() && first->map.has_value()) << watcher.status();
  EXPECT_EQ(first->map->frame_id, "hall");
  EXPECT_EQ(first->map->revision, 9);
  EXPECT_EQ(first->map->create_time, absl::FromUnixSeconds(5));
  EXPECT_EQ(first->time, absl::FromUnixSeconds(60));
  const std::optional<WatchEvent> second = watcher.Next();
  ASSERT_TRUE(second.has_value()) << watcher.status();
  EXPECT_EQ(second->revision, 8);
  EXPECT_EQ(second->author, "cart");
  EXPECT_THAT(IdsOf(*second), ElementsAre(4));
  EXPECT_EQ(watcher.Next()->time, absl::FromUnixSeconds(62));
  EXPECT_FALSE(watcher.Next().has_value());
  EXPECT_EQ(watcher.status(), absl::UnavailableError("broken"));
  // The first attempt met an outage and was retried; the break later was not.
  const std::string request =
      "Replicate scope { map: \"office\" layers: \"objects\" frame_id: \"dock\" incarnation: 9 } "
      "area { outer { xs: 0 xs: 1 xs: 1 xs: 0 ys: 0 ys: 0 ys: 1 ys: 1 } } start_revision: 6 "
      "start_time { seconds: 50 }";
  EXPECT_THAT(server.Requests(), ElementsAre(request, request));
}

TEST(ChangeReaderTest, GivesTheDifferenceChangeAfterChange) {
  Script script;
  script.changes = {ParseText<v1::ListChangesResponse>(R"(from_revision: 2 to_revision: 9
          changes { kind: CHANGE_KIND_REMOVE layer: "objects" object_id: 4 object_before { id: 4
                    label: "cup" shape { polygon { outer { xs: [0, 1, 0] ys: [0, 0, 1] } } } } }
          changes { kind: CHANGE_KIND_REMOVE layer: "objects" object_id: 5 })"),
                    ParseText<v1::ListChangesResponse>(R"(from_revision: 2 to_revision: 9
          changes { kind: CHANGE_KIND_CELLS layer: "floor"
                    cells { rows: 1 col_begins: 2 col_ends: 5 values: 1 }
                    cells_before { rows: 1 col_begins: 2 col_ends: 5 values: 0 } })")};
  ScriptedServer server(script);
  ChangeReader reader = Client(server.address()).ListChanges("office", 2, 9, {{"objects"}, "dock"});
  std::vector<MapChange> changes;
  while (std::optional<MapChange> change = reader.Next()) changes.push_back(*std::move(change));
  EXPECT_TRUE(reader.status().ok()) << reader.status();
  EXPECT_EQ(reader.from_revision(), 2);
  EXPECT_EQ(reader.to_revision(), 9);
  ASSERT_THAT(changes, SizeIs(3));
  EXPECT_EQ(changes[0].object_before->label, "cup");
  EXPECT_EQ(changes[1].object_id, 5);
  EXPECT_THAT(changes[2].cells_before, ElementsAre(CellRun{1, 2, 5, 0.0}));
  EXPECT_THAT(server.Requests(),
              ElementsAre("ListChanges scope { map: \"office\" layers: \"objects\" "
                          "frame_id: \"dock\" } "
                          "from_revision: 2 to_revision: 9"));
}

TEST(ListRevisionsTest, TellsWhoWhenAndHowMuch) {
  Script script;
  script.revisions = ParseText<v1::ListRevisionsResponse>(
      "map: 'office' newest_revision: 9 oldest_revision: 3 revisions { revision: 9 time { seconds: "
      "60 } author: 'cart' num_changes: 12 }");
  ScriptedServer server(script);
  const auto list = Client(server.address())
                        .ListRevisions("office", {.after = 4, .size = 1, .newest_first = true});
  ASSERT_TRUE(list.ok()) << list.status();
  EXPECT_EQ(list->newest, 9);
  EXPECT_EQ(list->oldest, 3);
  ASSERT_THAT(list->revisions, SizeIs(1));
  EXPECT_EQ(list->revisions[0].author, "cart");
  EXPECT_EQ(list->revisions[0].num_changes, 12);
  EXPECT_THAT(server.Requests(),
              ElementsAre("ListRevisions map: \"office\" after_revision: 4 page_size: 1 "
                          "newest_first: true"));
}

}  // namespace
}  // namespace hypermap::client
