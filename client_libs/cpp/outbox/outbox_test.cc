// Tests of the outbox with a real server that is stopped and restarted.
#include "client_libs/cpp/outbox/outbox.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/time/clock.h"
#include "base/sync/mutex.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/outbox/receipt_check.h"
#include "storage/outbox/outbox_file.h"
#include "tests/support/eventually.h"
#include "tests/support/server_process.h"
#include "tests/support/temporary_folder.h"
#include "wire/edit.h"

namespace hypermap::client {
namespace {

using ::hypermap::testing::ServerProcess;
using ::hypermap::testing::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr absl::Duration kPatience = absl::Minutes(1);

EditBatch PutThing(const std::string& label) {
  SemanticObject object;
  object.label = label;
  object.shape = Polygon::FromBox({{0.0, 0.0}, {1.0, 1.0}});
  return {{PutObject{"things", object, ""}}};
}

Observation Seen(const std::string& robot, absl::Time stamp, double x = 0.0) {
  Observation observation;
  observation.robot = robot;
  observation.stamp = stamp;
  observation.pose.frame_from_camera.translation().z() = 1.0;
  observation.view_hull = Polygon::FromBox({{x, 0.0}, {x + 4.0, 4.0}});
  observation.free_space = Polygon::FromBox({{x, 0.0}, {x + 4.0, 4.0}});
  return observation;
}

// A site with the layer "things".
class OutboxTest : public ::testing::Test {
 protected:
  OutboxTest()
      : server_({HYPERMAPD, "--data_dir=" + folder_ / "data", "--log_level=warn"},
                folder_ / "server.log") {
    EXPECT_EQ(server_.Start(), absl::OkStatus());
    EXPECT_TRUE(NewClient().CreateMap("site").ok());
    LayerSpec things;
    things.name = "things";
    EXPECT_TRUE(NewClient().CreateLayer("site", things).ok());
  }

  Client NewClient() { return Client(server_.address()); }

  std::unique_ptr<Outbox> Open(const OutboxOptions& options = {}) {
    auto outbox = Outbox::Open(NewClient(), file_, options);
    EXPECT_TRUE(outbox.ok()) << outbox.status();
    return *std::move(outbox);
  }

  // Leaves in the file an edit that puts the thing "a" by the id "the request". If `sent`, it was
  // sent then, and got no answer.
  void LeaveEdit(const std::optional<storage::SendTime>& sent = std::nullopt) {
    auto file = storage::OutboxFile::Open(file_, 1 << 20);
    ASSERT_TRUE(file.ok()) << file.status();
    storage::QueuedRequest request;
    request.stream = (*file)->FindStream("site", "", "")->id;
    request.request_id = "the request";
    request.body = wire::EditsToBytes(PutThing("a"));
    request.put_at = absl::Now();
    ASSERT_TRUE((*file)->Put(request).ok());
    if (!sent) return;
    std::vector<storage::QueuedRequest> requests = *(*file)->First(request.stream, 1);
    ASSERT_EQ((*file)->MarkSent(absl::MakeSpan(requests), *sent), absl::OkStatus());
  }

  // Labels of the things sorted by id, which is the order of their creation.
  std::vector<std::string> Labels() {
    Client client = NewClient();
    std::vector<std::string> labels;
    AnswerReader reader =
        client.QueryArea("site", Polygon::FromBox({{-9.0, -9.0}, {9.0, 9.0}}), {{"things"}, ""});
    while (std::optional<LayerPart> part = reader.Next()) {
      for (const SemanticObject& object : part->objects) labels.push_back(object.label);
    }
    EXPECT_EQ(reader.status(), absl::OkStatus());
    return labels;
  }

  Revision NewestRevision() { return NewClient().GetMap("site")->revision; }

  // The sequences of a robot that the server has.
  std::vector<std::pair<int64_t, int64_t>> Known(const std::string& robot) {
    Client client = NewClient();
    const auto stream = client.Observe("site", "seen", {.robot = robot});
    EXPECT_TRUE(stream.ok()) << stream.status();
    std::vector<std::pair<int64_t, int64_t>> known;
    for (const SequenceRange& range : (*stream)->opened().known) {
      known.emplace_back(range.first, range.last);
    }
    return known;
  }

  void MakeSeen() {
    LayerSpec seen;
    seen.name = "seen";
    ASSERT_TRUE(NewClient().CreateLayer("site", seen).ok());
  }

  TemporaryFolder folder_;
  ServerProcess server_;
  const std::string file_ = folder_ / "outbox.db";
};

TEST_F(OutboxTest, EditsForAnotherIncarnationAreSetAside) {
  const uint64_t known = NewClient().GetMap("site")->incarnation;
  server_.Kill();
  const auto outbox = Open();
  ASSERT_TRUE(outbox->Put("site", PutThing("of the old map"), known).ok());
  ASSERT_TRUE(outbox->Put("site", PutThing("of any map")).ok());
  // The server comes back with another map of that name.
  {
    ServerProcess other({HYPERMAPD, "--data_dir=" + folder_ / "other", "--log_level=warn"},
                        folder_ / "other.log");
    ASSERT_EQ(other.Start(), absl::OkStatus());
    Client client(other.address());
    ASSERT_TRUE(client.CreateMap("site").ok());
    LayerSpec things;
    things.name = "things";
    ASSERT_TRUE(client.CreateLayer("site", things).ok());
  }
  std::filesystem::rename(folder_ / "data", folder_ / "before");
  std::filesystem::rename(folder_ / "other", folder_ / "data");
  ASSERT_EQ(server_.Start(), absl::OkStatus());
  ASSERT_EQ(outbox->AwaitEmpty(kPatience), absl::OkStatus());
  const auto refused = outbox->Refused();
  ASSERT_TRUE(refused.ok()) << refused.status();
  ASSERT_THAT(*refused, SizeIs(1));
  EXPECT_EQ(refused->front().why.code(), absl::StatusCode::kAborted);
  EXPECT_THAT(refused->front().why.message(), HasSubstr("another incarnation"));
  EXPECT_THAT(Labels(), ElementsAre("of any map"));
}

TEST_F(OutboxTest, EditsPutOfflineArriveInOrderAndOnce) {
  const Revision before = NewestRevision();
  server_.Kill();
  auto outbox = Open();
  for (const char* label : {"a", "b", "c", "d"}) {
    ASSERT_TRUE(outbox->Put("site", PutThing(label)).ok());
  }
  EXPECT_EQ(outbox->state()->queued, 4);
  EXPECT_EQ(outbox->state()->delivered, 0);
  ASSERT_EQ(server_.Start(), absl::OkStatus());
  ASSERT_EQ(outbox->AwaitEmpty(kPatience), absl::OkStatus());
  EXPECT_THAT(Labels(), ElementsAre("a", "b", "c", "d"));
  EXPECT_EQ(NewestRevision(), before + 4);
  EXPECT_EQ(outbox->state()->delivered, 4);
  EXPECT_EQ(outbox->state()->refused, 0);
}

TEST_F(OutboxTest, TellsWhyNothingIsDelivered) {
  server_.Kill();
  auto outbox = Open();
  ASSERT_TRUE(outbox->Put("site", PutThing("a")).ok());
  EXPECT_TRUE(testing::Eventually([&] { return !outbox->state()->problem.ok(); }));
  EXPECT_TRUE(absl::IsUnavailable(outbox->state()->problem)) << outbox->state()->problem;
  EXPECT_TRUE(absl::IsDeadlineExceeded(outbox->AwaitEmpty(absl::ZeroDuration())));
  ASSERT_EQ(server_.Start(), absl::OkStatus());
  ASSERT_EQ(outbox->AwaitEmpty(kPatience), absl::OkStatus());
}

TEST_F(OutboxTest, WhatIsQueuedOutlivesTheOutbox) {
  server_.Kill();
  {
    auto outbox = Open();
    ASSERT_TRUE(outbox->Put("site", PutThing("a")).ok());
    ASSERT_TRUE(outbox->Put("site", PutThing("b")).ok());
  }
  ASSERT_EQ(server_.Start(), absl::OkStatus());
  auto outbox = Open();
  ASSERT_EQ(outbox->AwaitEmpty(kPatience), absl::OkStatus());
  EXPECT_THAT(Labels(), ElementsAre("a", "b"));
}

TEST_F(OutboxTest, EditWhoseAnswerWasLostIsNotDoneTwice) {
  // The state after a kill between the answer and its recording: the server has carried the edit
  // out.
  LeaveEdit();
  ASSERT_TRUE(NewClient().ApplyEdits("site", PutThing("a"), {.request_id = "the request"}).ok());
  auto outbox = Open();
  ASSERT_EQ(outbox->AwaitEmpty(kPatience), absl::OkStatus());
  EXPECT_THAT(Labels(), ElementsAre("a"));
}

TEST_F(OutboxTest, EditWhoseReceiptMayBeGoneIsSetAside) {
  storage::SendTime sent = ReadClocks();
  sent.since_boot -= absl::Hours(25);
  LeaveEdit(sent);
  auto outbox = Open();
  ASSERT_TRUE(outbox->Put("site", PutThing("b")).ok());
  ASSERT_EQ(outbox->AwaitEmpty(kPatience), absl::OkStatus());
  EXPECT_THAT(Labels(), ElementsAre("b"));
  const std::vector<RefusedEntry> refused = *outbox->Refused();
  ASSERT_THAT(refused, SizeIs(1));
  EXPECT_TRUE(absl::IsAborted(refused[0].why)) << refused[0].why;
  ASSERT_EQ(outbox->TryAgain(refused[0].ticket), absl::OkStatus());
  ASSERT_EQ(outbox->AwaitEmpty(kPatience), absl::OkStatus());
  EXPECT_THAT(Labels(), ElementsAre("b", "a"));
}

TEST_F(OutboxTest, EditOfAnotherBootIsSetAsideIfTheClockMayHaveStoodStill) {
  storage::SendTime sent = ReadClocks();
  sent.wall -= absl::Minutes(1);
  sent.synchronized = false;
  sent.boot_id = "another boot";
  LeaveEdit(sent);
  auto outbox = Open();
  ASSERT_EQ(outbox->AwaitEmpty(kPatience), absl::OkStatus());
  EXPECT_THAT(Labels(), IsEmpty());
  const std::vector<RefusedEntry> refused = *outbox->Refused();
  ASSERT_THAT(refused, SizeIs(1));
  EXPECT_TRUE(absl::IsAborted(refused[0].why)) << refused[0].why;
}

TEST_F(OutboxTest, EditOfThisBootIsSentAgainHoweverTheWallClockWasSet) {
  storage::SendTime sent = ReadClocks();
  sent.wall -= absl::Hours(1000);
  LeaveEdit(sent);
  auto outbox = Open();
  ASSERT_EQ(outbox->AwaitEmpty(kPatience), absl::OkStatus());
  EXPECT_THAT(Labels(), ElementsAre("a"));
}

TEST_F(OutboxTest, ALongTimeOfflineSpoilsNothing) {
  server_.Kill();
  auto outbox = Open({.receipt_age = absl::ZeroDuration()});
  ASSERT_TRUE(outbox->Put("site", PutThing("a")).ok());
  // Waits until an attempt has failed; a failed attempt is not marked as sent.
  EXPECT_TRUE(testing::Eventually([&] { return !outbox->state()->problem.ok(); }));
  ASSERT_EQ(server_.Start(), absl::OkStatus());
  ASSERT_EQ(outbox->AwaitEmpty(kPatience), absl::OkStatus());
  EXPECT_THAT(Labels(), ElementsAre("a"));
  EXPECT_EQ(outbox->state()->refused, 0);
}

TEST_F(OutboxTest, WhatIsRefusedIsSetAsideAndHoldsUpNothing) {
  auto outbox = Open();
  EditBatch stale = PutThing("stale");
  stale.if_layers.push_back({"things", 999});
  const auto first = outbox->Put("site", stale);
  const auto second = outbox->Put("site", {{DeleteObject{"things", 777}}});
  ASSERT_TRUE(outbox->Put("site", PutThing("good")).ok());
  const auto fourth = outbox->Put("nowhere", PutThing("lost"));
  ASSERT_EQ(outbox->AwaitEmpty(kPatience), absl::OkStatus());
  EXPECT_THAT(Labels(), ElementsAre("good"));
  EXPECT_EQ(outbox->state()->refused, 3);
  EXPECT_EQ(outbox->state()->problem, absl::OkStatus());
  const std::vector<RefusedEntry> refused = *outbox->Refused();
  ASSERT_THAT(refused, SizeIs(3));
  EXPECT_EQ(refused[0].ticket, *first);
  EXPECT_TRUE(absl::IsAborted(refused[0].why)) << refused[0].why;
  EXPECT_EQ(std::get<EditBatch>(refused[0].content).if_layers[0].version, 999);
  EXPECT_EQ(refused[1].ticket, *second);
  EXPECT_TRUE(absl::IsNotFound(refused[1].why)) << refused[1].why;
  EXPECT_EQ(refused[2].ticket, *fourth);
  EXPECT_EQ(refused[2].map, "nowhere");

  ASSERT_TRUE(NewClient().CreateMap("nowhere").ok());
  LayerSpec things;
  things.name = "things";
  ASSERT_TRUE(NewClient().CreateLayer("nowhere", things).ok());
  ASSERT_EQ(outbox->TryAgain(*fourth), absl::OkStatus());
  ASSERT_EQ(outbox->Discard(*first), absl::OkStatus());
  ASSERT_EQ(outbox->AwaitEmpty(kPatience), absl::OkStatus());
  EXPECT_EQ(outbox->state()->refused, 1);
  EXPECT_EQ(NewClient().GetLayer("nowhere", "things")->size, 1);
}

TEST_F(OutboxTest, EditsOfTheStructureAreQueuedLikeOthers) {
  auto outbox = Open();
  ASSERT_TRUE(outbox->Put("site", PutThing("a")).ok());
  ASSERT_TRUE(outbox->Put("site", {{hypermap::DeleteLayer{"things"}}}).ok());
  ASSERT_EQ(outbox->AwaitEmpty(kPatience), absl::OkStatus());
  EXPECT_TRUE(absl::IsNotFound(NewClient().GetLayer("site", "things").status()));
}

TEST_F(OutboxTest, DeliveriesAreTold) {
  Mutex mutex;
  std::vector<Delivery> told;
  auto outbox = Open({.delivered = [&](const Delivery& delivery) {
    const MutexLock lock(&mutex);
    told.push_back(delivery);
  }});
  const auto ticket = outbox->Put("site", PutThing("a"));
  ASSERT_EQ(outbox->AwaitEmpty(kPatience), absl::OkStatus());
  const MutexLock lock(&mutex);
  ASSERT_THAT(told, SizeIs(1));
  EXPECT_EQ(told[0].ticket, *ticket);
  const EditAnswer& answer = std::get<EditAnswer>(told[0].answer);
  EXPECT_EQ(answer.revision, NewestRevision());
  EXPECT_THAT(answer.object_ids, SizeIs(1));
}

TEST_F(OutboxTest, ObservationsPutOfflineArriveOnceEach) {
  MakeSeen();
  server_.Kill();
  const absl::Time begin = absl::Now() - absl::Seconds(60);
  {
    auto outbox = Open();
    for (int i = 0; i < 40; ++i) {
      for (const char* robot : {"cart", "drone"}) {
        ASSERT_TRUE(outbox->Put("site", "seen", Seen(robot, begin + absl::Milliseconds(i))).ok());
      }
    }
  }
  ASSERT_EQ(server_.Start(), absl::OkStatus());
  auto outbox = Open();
  ASSERT_EQ(outbox->AwaitEmpty(kPatience), absl::OkStatus());
  EXPECT_EQ(outbox->state()->delivered, 80);
  EXPECT_THAT(Known("cart"), ElementsAre(std::pair(0, 39)));
  EXPECT_THAT(Known("drone"), ElementsAre(std::pair(0, 39)));
}

TEST_F(OutboxTest, SequencesGoOnAfterThoseTheServerHas) {
  MakeSeen();
  {
    Client client = NewClient();
    auto stream = client.Observe("site", "seen", {.robot = "cart"});
    ASSERT_TRUE(stream.ok());
    Observation earlier = Seen("cart", absl::Now());
    earlier.sequence = 41;
    (*stream)->Write(earlier);
    (*stream)->WritesDone();
    ASSERT_EQ((*stream)->Read()->outcome, ObservationOutcome::kAccepted);
  }
  auto outbox = Open();
  ASSERT_TRUE(outbox->Put("site", "seen", Seen("cart", absl::Now())).ok());
  ASSERT_EQ(outbox->AwaitEmpty(kPatience), absl::OkStatus());
  EXPECT_THAT(Known("cart"), ElementsAre(std::pair(41, 42)));
}

TEST_F(OutboxTest, ObservationsThatAreRefusedAreSetAside) {
  MakeSeen();
  auto outbox = Open();
  ASSERT_TRUE(outbox->Put("site", "seen", Seen("cart", absl::Now())).ok());
  ASSERT_EQ(outbox->AwaitEmpty(kPatience), absl::OkStatus());
  ASSERT_TRUE(outbox->Put("site", "seen", Seen("cart", absl::Now() - absl::Hours(1))).ok());
  ASSERT_TRUE(outbox->Put("site", "seen", Seen("cart", absl::Now())).ok());
  ASSERT_EQ(outbox->AwaitEmpty(kPatience), absl::OkStatus());
  EXPECT_EQ(outbox->state()->delivered, 2);
  const std::vector<RefusedEntry> refused = *outbox->Refused();
  ASSERT_THAT(refused, SizeIs(1));
  EXPECT_THAT(std::string(refused[0].why.message()), HasSubstr("refused_late"));
  EXPECT_EQ(refused[0].layer, "seen");
  EXPECT_EQ(std::get<Observation>(refused[0].content).robot, "cart");
}

TEST_F(OutboxTest, ObservationsOfALayerThatIsNotThereHoldUpNoOthers) {
  MakeSeen();
  auto outbox = Open();
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(outbox->Put("site", "gone", Seen("cart", absl::Now())).ok());
    ASSERT_TRUE(outbox->Put("site", "seen", Seen("cart", absl::Now())).ok());
  }
  ASSERT_EQ(outbox->AwaitEmpty(kPatience), absl::OkStatus());
  EXPECT_EQ(outbox->state()->delivered, 3);
  EXPECT_EQ(outbox->state()->refused, 3);
}

TEST_F(OutboxTest, FloorIsMarkedInTheLayerThatIsNamed) {
  MakeSeen();
  LayerSpec explored;
  explored.name = "explored";
  explored.kind = LayerKind::kExploration;
  explored.grid = GridGeometry{PlanarTransform(), 0.5};
  ASSERT_TRUE(NewClient().CreateLayer("site", explored).ok());
  auto outbox = Open();
  ASSERT_TRUE(outbox->Put("site", "seen", Seen("cart", absl::Now()), "explored").ok());
  ASSERT_EQ(outbox->AwaitEmpty(kPatience), absl::OkStatus());
  EXPECT_GT(NewClient().GetLayer("site", "explored")->size, 0);
}

// Nothing is lost, repeated or reordered, whenever the server is killed.
TEST_F(OutboxTest, KillsOfTheServerChangeNothing) {
  MakeSeen();
  constexpr int kEach = 60;
  auto outbox = Open();
  std::vector<std::string> put;
  const absl::Time begin = absl::Now() - absl::Seconds(60);
  for (int i = 0; i < kEach; ++i) {
    put.push_back("thing " + std::to_string(i));
    ASSERT_TRUE(outbox->Put("site", PutThing(put.back())).ok());
    ASSERT_TRUE(outbox->Put("site", "seen", Seen("cart", begin + absl::Milliseconds(i))).ok());
    if (i % 20 == 10) {
      server_.Kill();
      ASSERT_EQ(server_.Start(), absl::OkStatus());
    }
  }
  ASSERT_EQ(outbox->AwaitEmpty(kPatience), absl::OkStatus());
  EXPECT_EQ(Labels(), put);
  EXPECT_THAT(Known("cart"), ElementsAre(std::pair(0, kEach - 1)));
  EXPECT_EQ(outbox->state()->delivered, 2 * kEach);
}

TEST_F(OutboxTest, WithoutATokenItWaitsForOne) {
  auto outbox = Outbox::Open(
      Client(server_.address(), {.token = [this] { return TokenFromFile(folder_ / "token")(); }}),
      file_);
  ASSERT_TRUE(outbox.ok()) << outbox.status();
  ASSERT_TRUE((*outbox)->Put("site", PutThing("a")).ok());
  EXPECT_TRUE(testing::Eventually([&] { return !(*outbox)->state()->problem.ok(); }));
  EXPECT_TRUE(absl::IsUnauthenticated((*outbox)->state()->problem));
  folder_.Write("token", "abc");
  ASSERT_EQ((*outbox)->AwaitEmpty(kPatience), absl::OkStatus());
  EXPECT_THAT(*(*outbox)->Refused(), IsEmpty());
}

}  // namespace
}  // namespace hypermap::client
