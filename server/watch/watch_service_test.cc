#include "server/watch/watch_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "server/services/testing/test_server.h"
#include "tests/support/eventually.h"
#include "wire/geometry.h"

namespace hypermap::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A Watch call that takes coalesced messages apart.
class Watching {
 public:
  Watching(TestServer& server, const v1::WatchRequest& request)
      : Watching(*server.watch, request) {}
  Watching(v1::WatchService::Stub& stub, const v1::WatchRequest& request)
      : reader_(stub.Watch(&context_, request)) {}
  ~Watching() {
    context_.TryCancel();
    if (!finished_) reader_->Finish();
  }

  // The next message; nullopt at the end.
  std::optional<v1::WatchResponse> Next() {
    while (together_.empty()) {
      v1::WatchResponse response;
      if (!reader_->Read(&response)) return std::nullopt;
      if (response.coalesced().empty()) return response;
      together_.assign(response.coalesced().begin(), response.coalesced().end());
    }
    v1::WatchResponse first = std::move(together_.front());
    together_.pop_front();
    return first;
  }
  // The next message that has changes or belongs to a snapshot; nullopt at the end.
  std::optional<v1::WatchResponse> NextTold() {
    for (;;) {
      std::optional<v1::WatchResponse> response = Next();
      if (!response || response->changes_size() > 0 || response->snapshot()) return response;
    }
  }
  // All changes up to the end of `revision`, as "REVISION KIND LAYER ID"; those of a snapshot have
  // an "s" after the revision.
  std::vector<std::string> Until(Revision revision) {
    std::vector<std::string> told;
    for (;;) {
      const std::optional<v1::WatchResponse> response = Next();
      if (!response) {
        ADD_FAILURE() << "the watch has ended: " << Finish().error_message();
        return told;
      }
      for (const v1::Change& change : response->changes()) {
        told.push_back(
            absl::StrCat(response->revision(), response->snapshot() ? "s " : " ",
                         v1::ChangeKind_Name(change.kind()).substr(12), " ", change.layer(),
                         change.object_id() == 0 ? "" : absl::StrCat(" ", change.object_id())));
      }
      if (response->revision() >= revision && !response->more()) return told;
    }
  }
  grpc::Status Finish() {
    finished_ = true;
    return reader_->Finish();
  }
  void Cancel() { context_.TryCancel(); }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::WatchResponse>> reader_;
  std::deque<v1::WatchResponse> together_;  // the rest of the last coalesced message
  bool finished_ = false;
};

hypermap::PutObject CupAt(double x, ObjectId id = 0) {
  hypermap::PutObject put{"cups", {}, ""};
  put.object.id = id;
  put.object.label = "cup";
  put.object.shape = Polygon::FromBox({{x, 0}, {x + 1, 1}});
  return put;
}

// More than a test opens at once, because an ended watch counts until the server has noticed.
constexpr int kMaxWatchersOfClient = 16;

// The map "site" with two cups, ids 1 and 2, at x = 0 and 2, at revision 1. The parameter is
// `coalesce`, which makes no difference to the changes that a watch gets.
class WatchServiceTest : public ::testing::TestWithParam<bool> {
 protected:
  static Limits TestLimits() {
    Limits limits;
    limits.watch_progress = absl::Milliseconds(20);
    limits.max_watchers = 2 * kMaxWatchersOfClient;
    limits.max_watch_lag = 1000;
    limits.chunk_items = 5;
    return limits;
  }
  static SessionOptions Options() {
    SessionOptions options;
    options.feed.max_commits = 16;
    options.limits.history_revisions = 2000;
    return options;
  }

  WatchServiceTest() : server_(TestLimits(), 1 << 20, Options()) {
    server_.MakeMap("site", LayerOfCups("cups", 2));
  }

  static v1::WatchRequest Request(std::optional<Revision> start = {}) {
    v1::WatchRequest request;
    request.mutable_scope()->set_map("site");
    if (start) request.set_start_revision(*start);
    request.set_coalesce(GetParam());
    return request;
  }

  MapSession& session() { return **server_.site().Find("site"); }
  Revision Edit(std::vector<hypermap::Edit> edits) {
    const auto receipt = session().SubmitAndWait({{std::move(edits)}, "test", ""});
    EXPECT_TRUE(receipt.ok()) << receipt.status();
    return receipt.ok() ? receipt->revision : 0;
  }
  // The error with which a watch ends at once.
  grpc::Status Error(const v1::WatchRequest& request) {
    Watching watching(server_, request);
    EXPECT_FALSE(watching.Next().has_value());
    return watching.Finish();
  }

  TestServer server_;
};

INSTANTIATE_TEST_SUITE_P(, WatchServiceTest, ::testing::Bool(), [](const auto& coalesce) {
  return coalesce.param ? "Coalesced" : "Single";
});

TEST_P(WatchServiceTest, TellsASnapshotAndThenEachCommit) {
  Watching watching(server_, Request());
  const auto snapshot = watching.NextTold();
  ASSERT_TRUE(snapshot.has_value());
  EXPECT_EQ(snapshot->revision(), 1);
  EXPECT_TRUE(snapshot->snapshot());
  EXPECT_FALSE(snapshot->more());
  ASSERT_EQ(snapshot->changes_size(), 2);
  EXPECT_EQ(snapshot->changes(0).object().label(), "cup");

  Edit({CupAt(10), CupAt(12)});
  Edit({hypermap::DeleteObject{"cups", 1, {}}});
  const auto put = watching.NextTold();
  ASSERT_TRUE(put.has_value());
  EXPECT_EQ(put->revision(), 2);
  EXPECT_EQ(put->author(), "test");
  EXPECT_TRUE(put->has_time());
  EXPECT_FALSE(put->snapshot());
  EXPECT_EQ(put->changes_size(), 2);
  const auto removed = watching.NextTold();
  ASSERT_TRUE(removed.has_value());
  EXPECT_EQ(removed->revision(), 3);
  EXPECT_EQ(removed->changes(0).kind(), v1::CHANGE_KIND_REMOVE);
  EXPECT_EQ(removed->changes(0).object_id(), 1);
}

TEST_P(WatchServiceTest, SnapshotAndLargeCommitsComeInPartsThatBelongTogether) {
  std::vector<hypermap::Edit> many;
  for (int i = 0; i < 20; ++i) many.push_back(CupAt(i));
  Edit(std::move(many));
  Watching from_snapshot(server_, Request());
  Watching from_history(server_, Request(1));
  for (Watching* watching : {&from_snapshot, &from_history}) {
    int changes = 0, messages = 0;
    std::optional<v1::WatchResponse> part;
    do {
      part = watching->NextTold();
      ASSERT_TRUE(part.has_value());
      EXPECT_EQ(part->revision(), 2);
      EXPECT_LE(part->changes_size(), 5);
      changes += part->changes_size();
      ++messages;
    } while (part->more());
    EXPECT_EQ(changes, watching == &from_snapshot ? 22 : 20);
    EXPECT_GE(messages, 4);
  }
}

TEST_P(WatchServiceTest, EmptySelectionIsTold) {
  v1::WatchRequest request = Request();
  request.mutable_scope()->add_layers("not there yet");
  Watching watching(server_, request);
  const auto snapshot = watching.NextTold();
  ASSERT_TRUE(snapshot.has_value());
  EXPECT_TRUE(snapshot->snapshot());
  EXPECT_FALSE(snapshot->more());
  EXPECT_EQ(snapshot->changes_size(), 0);
}

TEST_P(WatchServiceTest, TellsWhoComesIntoTheAreaAndLeavesIt) {
  v1::WatchRequest request = Request();
  wire::EncodePolygon(Polygon::FromBox({{-1, -1}, {1.5, 2}}), request.mutable_area());
  Watching watching(server_, request);
  EXPECT_THAT(watching.Until(1), ElementsAre("1s PUT cups 1"));
  Edit({CupAt(0.25, 1)});                         // 2: moves inside
  Edit({CupAt(50, 1)});                           // 3: out
  Edit({CupAt(60, 1)});                           // 4: outside
  Edit({CupAt(0.5, 1), CupAt(1, 2)});             // 5: both in
  Edit({hypermap::DeleteObject{"cups", 2, {}}});  // 6
  Edit({CupAt(0)});                               // 7: a new one
  EXPECT_THAT(watching.Until(7), ElementsAre("2 PUT cups 1", "3 LEAVE cups 1", "5 ENTER cups 1",
                                             "5 ENTER cups 2", "6 REMOVE cups 2", "7 PUT cups 3"));
}

TEST_P(WatchServiceTest, TellsOfLayersAndCells) {
  Watching watching(server_, Request(1));
  const EditBatch cells = LayerOfCells("cells", 1, 2);
  Edit(cells.edits);
  Edit({hypermap::WriteCells{"cells", {0, 1, 0, 2}, {0.0, 0.0}}});
  Edit({hypermap::DeleteLayer{"cells"}});
  EXPECT_THAT(watching.Until(4),
              ElementsAre("2 LAYER_CREATED cells", "2 LAYER_CHANGED cells", "2 CELLS cells",
                          "3 CELLS cells", "4 LAYER_DELETED cells"));
}

TEST_P(WatchServiceTest, ResumesFromTheRingAndFromTheHistory) {
  std::vector<std::string> all;
  for (int i = 0; i < 40; ++i) {
    const Revision revision = Edit({CupAt(i)});
    all.push_back(absl::StrCat(revision, " PUT cups ", i + 3));
  }
  for (const Revision start : {1, 5, 20, 26, 30, 40}) {
    SCOPED_TRACE(start);
    Watching watching(server_, Request(start));
    EXPECT_EQ(watching.Until(41), std::vector<std::string>(all.begin() + start - 1, all.end()));
  }
  Watching up_to_date(server_, Request(41));
  Edit({CupAt(100)});
  EXPECT_THAT(up_to_date.Until(42), ElementsAre("42 PUT cups 43"));
}

TEST_P(WatchServiceTest, TransformThatMovesTheAnswersResetsTheWatch) {
  LayerSpec spec;
  spec.name = "robot";
  spec.frame_id = "base";
  Edit({hypermap::SetTransform{{"map", "base", PlanarTransform(1, 0, 0)}},
        hypermap::CreateLayer{spec}});
  Watching watching(server_, Request());
  EXPECT_THAT(watching.Until(2), ElementsAre("2s PUT cups 1", "2s PUT cups 2"));
  Edit({hypermap::SetTransform{{"map", "base", PlanarTransform(2, 0, 0)}}});
  const auto reset = watching.NextTold();
  ASSERT_TRUE(reset.has_value());
  EXPECT_TRUE(reset->snapshot());
  EXPECT_TRUE(reset->reset());
  EXPECT_EQ(reset->revision(), 3);
  EXPECT_EQ(reset->changes_size(), 2);
  if (reset->more()) {
    EXPECT_THAT(watching.Until(3), IsEmpty());
  }
  Edit({CupAt(7)});
  EXPECT_THAT(watching.Until(4), ElementsAre("4 PUT cups 3"));
}

TEST_P(WatchServiceTest, ToldHowFarTheMapIsWhenNothingIsSelected) {
  v1::WatchRequest request = Request(1);
  request.mutable_scope()->add_layers("elsewhere");
  Watching watching(server_, request);
  EXPECT_EQ(watching.Next()->revision(), 1);
  Edit({CupAt(10)});
  std::optional<v1::WatchResponse> progress;
  do {
    progress = watching.Next();
    ASSERT_TRUE(progress.has_value());
    EXPECT_EQ(progress->changes_size(), 0);
  } while (progress->revision() < 2);
  // Progress also comes now and then while nothing happens.
  EXPECT_EQ(watching.Next()->revision(), 2);
}

TEST_P(WatchServiceTest, StartsThatCanNotBeAreRefused) {
  v1::WatchRequest unknown_map = Request(), unknown_frame = Request(), bad_area = Request();
  unknown_map.mutable_scope()->set_map("attic");
  unknown_frame.mutable_scope()->set_frame_id("moon");
  bad_area.mutable_area()->mutable_outer();
  EXPECT_EQ(Error(unknown_map).error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(Error(unknown_frame).error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(Error(bad_area).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(Error(Request(-1)).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  const grpc::Status future = Error(Request(2));
  EXPECT_EQ(future.error_code(), grpc::StatusCode::OUT_OF_RANGE);
  EXPECT_THAT(future.error_message(), HasSubstr("newest is 1"));
}

TEST_P(WatchServiceTest, StartBeforeTheOldestKeptNamesIt) {
  for (int i = 0; i < 2400; ++i) Edit({CupAt(i)});
  const auto kept = [this] { return (*session().OpenHistory())->Kept()->oldest; };
  // The writer compacts after any work.
  while (kept() == 0) ASSERT_TRUE(session().ReadRobotClocks().ok());
  // Compaction goes on meanwhile: repeat until the oldest revision is the same before and after.
  Revision oldest = 0;
  grpc::Status gone;
  do {
    oldest = kept();
    gone = Error(Request(0));
  } while (kept() != oldest);
  EXPECT_EQ(gone.error_code(), grpc::StatusCode::OUT_OF_RANGE);
  EXPECT_THAT(gone.error_message(), HasSubstr(absl::StrCat(oldest)));
}

TEST_P(WatchServiceTest, OneWatchTooManyOfAClientIsRefusedNamingTheLimit) {
  std::vector<std::unique_ptr<Watching>> watches;
  for (int i = 0; i < kMaxWatchersOfClient; ++i) {
    watches.push_back(std::make_unique<Watching>(server_, Request()));
    ASSERT_TRUE(watches.back()->Next().has_value());
  }
  const grpc::Status refused = Error(Request());
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error_message(), HasSubstr("--max_watchers"));
  // A watch that ends makes room.
  watches.pop_back();
  for (bool admitted = false; !admitted;) {
    Watching again(server_, Request());
    admitted = again.Next().has_value();
  }
}

// A watch of a regular polygon round the origin.
v1::WatchRequest RequestOfArea(int vertices) {
  v1::WatchRequest request;
  request.mutable_scope()->set_map("site");
  for (int i = 0; i < vertices; ++i) {
    const double angle = 2 * M_PI * i / vertices;
    request.mutable_area()->mutable_outer()->add_xs(std::cos(angle));
    request.mutable_area()->mutable_outer()->add_ys(std::sin(angle));
  }
  return request;
}

TEST(WatchMemoryTest, AnAreaIsChargedUntilTheWatchEnds) {
  Limits limits;
  limits.max_request_bytes = 1 << 20;
  TestServer server(limits);
  server.MakeMap("site", LayerOfCups("cups", 1));
  const admission::Budget& charged = server.budgets().request_bytes;
  {
    Watching plain(server, RequestOfArea(0));
    ASSERT_TRUE(plain.Next().has_value());
    EXPECT_EQ(charged.used(), 0);
    Watching first(server, RequestOfArea(1'000));
    ASSERT_TRUE(first.Next().has_value());
    const int64_t of_first = charged.used();
    EXPECT_GT(of_first, 1'000 * static_cast<int64_t>(sizeof(Point)));
    Watching second(server, RequestOfArea(1'000));
    EXPECT_FALSE(second.Next().has_value());
    const grpc::Status refused = second.Finish();
    EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_THAT(refused.error_message(), HasSubstr("--max_request_bytes"));
    EXPECT_EQ(charged.used(), of_first);
  }
  for (bool admitted = false; !admitted;) {
    Watching again(server, RequestOfArea(1'000));
    admitted = again.Next().has_value();
  }
}

TEST(WatchMemoryTest, AListOfRevisionsIsCharged) {
  Limits limits;
  limits.max_request_bytes = 128 << 10;
  TestServer server(limits);
  server.MakeMap("site", LayerOfCups("cups", 1));
  MapSession& session = **server.site().Find("site");
  const std::string author(FixedLimits::kMaxAuthorLength, 'a');
  for (int i = 0; i < 300; ++i) {
    ASSERT_TRUE(session.SubmitAndWait({{{CupAt(i)}}, author, ""}).ok());
  }
  const auto list = [&](int page_size) {
    v1::ListRevisionsRequest request;
    request.set_map("site");
    request.set_page_size(page_size);
    v1::ListRevisionsResponse response;
    grpc::ClientContext context;
    const grpc::Status status = server.watch->ListRevisions(&context, request, &response);
    if (status.ok()) EXPECT_EQ(response.revisions_size(), page_size);
    return status;
  };
  EXPECT_TRUE(list(100).ok());
  const grpc::Status refused = list(300);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error_message(), HasSubstr("--max_request_bytes"));
  EXPECT_TRUE(list(100).ok());
}

TEST(WatchMemoryTest, AnAreaIsChargedAlikeWhateverTheNumberOfLayers) {
  TestServer server;
  server.MakeMap("site", LayerOfCups("cups", 1));
  const admission::Budget& charged = server.budgets().request_bytes;
  Watching first(server, RequestOfArea(1'000));
  ASSERT_TRUE(first.Next().has_value());
  const int64_t of_first = charged.used();
  EditBatch layers;
  for (int i = 0; i < 50; ++i) {
    const std::string name = absl::StrCat("layer", i);
    layers.edits.push_back(hypermap::SetTransform{{"map", name, PlanarTransform(i, 0, 0)}});
    layers.edits.push_back(hypermap::CreateLayer{{.name = name, .frame_id = name}});
  }
  ASSERT_TRUE((*server.site().Find("site"))->SubmitAndWait({layers, "test", ""}).ok());
  Watching second(server, RequestOfArea(1'000));
  ASSERT_TRUE(second.Next().has_value());
  EXPECT_EQ(charged.used(), 2 * of_first);
}

TEST_P(WatchServiceTest, DeadlineAndCancelEndAWatchThatWaits) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(100));
  auto reader = server_.watch->Watch(&context, Request());
  ReadAll(*reader);
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  Watching watching(server_, Request());
  ASSERT_TRUE(watching.Next().has_value());
  watching.Cancel();
  while (watching.Next()) {
  }
  EXPECT_EQ(watching.Finish().error_code(), grpc::StatusCode::CANCELLED);
}

// A watch of a comb from (0, 0) to (8192, 8192), whose slanted teeth stand between the centres of
// cells of 1 m.
v1::WatchRequest RequestOfComb() {
  v1::WatchRequest request;
  request.mutable_scope()->set_map("site");
  v1::Ring& ring = *request.mutable_area()->mutable_outer();
  const auto add = [&ring](double x, double y) {
    ring.add_xs(x);
    ring.add_ys(y);
  };
  add(0, -2);
  add(8192, -2);
  add(8192, -1);
  for (int x = 3 * 2729; x >= 0; x -= 3) {
    add(x + 1.5, -1);
    add(x + 1.2, 8192);
    add(x + 0.9, -1);
  }
  add(0, -1);
  return request;
}

TEST(WatchWorkTest, ALargeCommitIsNotComparedWithALargeAreaForAClientThatHasGone) {
  TestServer server;
  LayerSpec floor{.name = "floor", .kind = LayerKind::kOccupancy};
  floor.grid = GridGeometry{PlanarTransform(), 1.0};
  server.MakeMap("site", {{hypermap::CreateLayer{floor}}});
  MapSession& session = **server.site().Find("site");
  hypermap::FillPolygon fill{.layer = "floor", .area = Polygon::FromBox({{0, 0}, {8064, 8064}})};
  for (const double value : {0.25, 0.75}) {
    fill.value = value;
    const auto receipt = session.SubmitAndWait({{{fill}}, "test", ""});
    ASSERT_TRUE(receipt.ok()) << receipt.status();
  }
  for (const bool coalesce : {false, true}) {
    v1::WatchRequest request = RequestOfComb();
    request.set_start_revision(2);
    request.set_coalesce(coalesce);
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(300));
    const auto reader = server.watch->Watch(&context, request);
    ReadAll(*reader);
    EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  }
  // To compare each of the 3,969 tiles with all teeth takes a minute.
  const absl::Time begin = absl::Now();
  EXPECT_TRUE(hypermap::testing::Eventually([&] { return server.budgets().watchers.used() == 0; }));
  EXPECT_LT(absl::Now() - begin, absl::Seconds(20));
}

// Writes every cell of a tile, so that a few commits fill gRPC's buffers for a reader that does not
// read.
std::vector<hypermap::Edit> Checkered(bool odd) {
  hypermap::WriteCells write{"cells", {0, 128, 0, 128}, {}};
  for (int i = 0; i < 128 * 128; ++i) {
    write.values.push_back((i + i / 128 + (odd ? 1 : 0)) % 2 == 0 ? 0.0 : 1.0);
  }
  return {write};
}

TEST_P(WatchServiceTest, ReaderThatDoesNotReadHoldsNobodyUpAndIsToldWhereToResume) {
  Edit(LayerOfCells("cells", 1, 1).edits);
  // Receives only a few bytes ahead of its reader.
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 1024);
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  const auto stub = v1::WatchService::NewStub(
      grpc::CreateCustomChannel(server_.address(), grpc::InsecureChannelCredentials(), arguments));
  Watching slow(*stub, Request(2));
  Watching quick(server_, Request(2));
  ASSERT_TRUE(slow.Next().has_value());
  for (int i = 0; i < 40; ++i) Edit(Checkered(i % 2 == 0));
  EXPECT_EQ(quick.Until(42).size(), 41u);
  Revision newest = 42;
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 500; ++i) newest = Edit({CupAt(i)});
    EXPECT_EQ(quick.Until(newest).size(), 500u);
  }
  Revision last = 2;
  while (const auto response = slow.Next()) {
    if (response->changes_size() > 0) {
      EXPECT_EQ(response->revision(), last + 1);
    }
    if (!response->more()) last = response->revision();
  }
  const grpc::Status status = slow.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), HasSubstr("--max_watch_lag"));
  EXPECT_THAT(status.error_message(), HasSubstr(absl::StrCat("resume from revision ", last)));
  EXPECT_LT(last, newest - 1000);
  Watching resumed(server_, Request(last));
  const std::vector<std::string> rest = resumed.Until(newest);
  EXPECT_THAT(rest.front(), HasSubstr(absl::StrCat(last + 1, " ")));
}

TEST_P(WatchServiceTest, ShutdownEndsWatchesSayingWhereToResume) {
  Watching waiting(server_, Request());
  ASSERT_TRUE(waiting.NextTold().has_value());
  Edit({CupAt(4)});
  ASSERT_TRUE(waiting.NextTold().has_value());
  const absl::Time begin = absl::Now();
  std::thread shutdown([this] { server_.Shutdown(absl::Seconds(60)); });
  while (waiting.Next()) {
  }
  const grpc::Status status = waiting.Finish();
  shutdown.join();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(status.error_message(), HasSubstr("resume from revision 2"));
  EXPECT_LT(absl::Now() - begin, absl::Seconds(30));
}

TEST_P(WatchServiceTest, ShutdownDoesNotWaitForAReaderThatDoesNotRead) {
  Edit(LayerOfCells("cells", 1, 1).edits);
  Watching slow(server_, Request(2));
  ASSERT_TRUE(slow.Next().has_value());
  for (int i = 0; i < 40; ++i) Edit(Checkered(i % 2 == 0));
  const absl::Time begin = absl::Now();
  server_.Shutdown(absl::Seconds(60));
  EXPECT_LT(absl::Now() - begin, absl::Seconds(30));
}

TEST_P(WatchServiceTest, WatchOfADeletedMapEnds) {
  Watching watching(server_, Request());
  ASSERT_TRUE(watching.NextTold().has_value());
  ASSERT_TRUE(server_.site().Delete("site", "").ok());
  while (watching.Next()) {
  }
  EXPECT_EQ(watching.Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(Error(Request()).error_code(), grpc::StatusCode::NOT_FOUND);
}

// The map's content according to the messages of a watch.
class Replica {
 public:
  void Take(const v1::WatchResponse& response) {
    if (response.changes_size() > 0 && !response.snapshot()) {
      EXPECT_TRUE(response.revision() > revision_ || open_) << "repeated or out of order";
    }
    for (const v1::Change& change : response.changes()) {
      switch (change.kind()) {
        case v1::CHANGE_KIND_PUT:
        case v1::CHANGE_KIND_ENTER:
          objects_[change.object_id()] = change.object().version();
          break;
        default:
          EXPECT_EQ(objects_.erase(change.object_id()), 1u) << change.ShortDebugString();
      }
    }
    open_ = response.more();
    if (!open_) revision_ = response.revision();
  }
  Revision revision() const { return revision_; }
  const std::map<ObjectId, int64_t>& objects() const { return objects_; }

 private:
  Revision revision_ = 0;
  bool open_ = false;
  std::map<ObjectId, int64_t> objects_;
};

// The map's content according to QueryArea.
std::map<ObjectId, int64_t> Ask(TestServer& server, const v1::Polygon& area, Revision revision) {
  v1::QueryAreaRequest request;
  request.mutable_scope()->set_map("site");
  request.mutable_scope()->add_layers("cups");
  request.mutable_as_of()->set_at_revision(revision);
  *request.mutable_area() = area;
  grpc::ClientContext context;
  auto reader = server.query->QueryArea(&context, request);
  std::map<ObjectId, int64_t> objects;
  for (const v1::QueryAreaResponse& response : ReadAll(*reader)) {
    for (const v1::Object& object : response.part().objects()) {
      objects[object.id()] = object.version();
    }
  }
  EXPECT_TRUE(reader->Finish().ok());
  return objects;
}

TEST_P(WatchServiceTest, CutAndResumedAtRandomItStaysWhatAQuestionAnswers) {
  const unsigned seed = std::random_device()();
  SCOPED_TRACE(absl::StrCat("seed ", seed));
  constexpr int kEdits = 600;
  std::thread writer([&] {
    std::mt19937 random(seed);
    std::vector<ObjectId> live{1, 2};
    for (int i = 0; i < kEdits; ++i) {
      const double x = std::uniform_real_distribution<>(-20, 20)(random);
      const size_t which = random() % live.size();
      const int what = random() % 3;
      if (what == 0 || live.size() < 3) {
        const auto receipt = session().SubmitAndWait({{{CupAt(x)}}, "test", ""});
        live.push_back(receipt->object_ids[0]);
      } else if (what == 1) {
        Edit({CupAt(x, live[which])});
      } else {
        Edit({hypermap::DeleteObject{"cups", live[which], {}}});
        live.erase(live.begin() + static_cast<std::ptrdiff_t>(which));
      }
    }
  });
  v1::WatchRequest request = Request();
  wire::EncodePolygon(Polygon::FromBox({{-5, -1}, {5, 2}}), request.mutable_area());
  std::mt19937 random(seed + 1);
  Replica replica;
  while (replica.revision() < kEdits + 1) {
    Watching watching(server_, request);
    const int cut_after = static_cast<int>(random() % 60) + 1;
    for (int i = 0; (i < cut_after || replica.revision() == 0); ++i) {
      const auto response = watching.Next();
      ASSERT_TRUE(response.has_value());
      replica.Take(*response);
      if (replica.revision() == kEdits + 1) break;
      if (i % 20 == 0 && replica.revision() > 0) {
        EXPECT_EQ(replica.objects(), Ask(server_, request.area(), replica.revision()));
      }
    }
    request.set_start_revision(replica.revision());
  }
  writer.join();
  EXPECT_EQ(replica.objects(), Ask(server_, request.area(), kEdits + 1));
}

TEST_P(WatchServiceTest, DifferenceOfTwoRevisionsTellsEachThingOnce) {
  Edit({CupAt(10)});                              // 2: id 3
  Edit({CupAt(20, 1), CupAt(30, 3)});             // 3
  Edit({hypermap::DeleteObject{"cups", 2, {}}});  // 4
  Edit({CupAt(21, 1)});                           // 5
  v1::ListChangesRequest request;
  request.mutable_scope()->set_map("site");
  request.set_from_revision(1);
  const auto ask = [&](std::vector<v1::ListChangesResponse>* responses) {
    grpc::ClientContext context;
    auto reader = server_.watch->ListChanges(&context, request);
    *responses = ReadAll(*reader);
    return reader->Finish();
  };
  std::vector<v1::ListChangesResponse> responses;
  ASSERT_TRUE(ask(&responses).ok());
  ASSERT_EQ(responses.size(), 1u);
  EXPECT_EQ(responses[0].from_revision(), 1);
  EXPECT_EQ(responses[0].to_revision(), 5);
  ASSERT_EQ(responses[0].changes_size(), 3);
  const v1::Change& moved = responses[0].changes(0);
  EXPECT_EQ(moved.kind(), v1::CHANGE_KIND_PUT);
  EXPECT_EQ(moved.object_before().version(), 1);
  EXPECT_EQ(moved.object().version(), 5);
  EXPECT_EQ(responses[0].changes(1).kind(), v1::CHANGE_KIND_REMOVE);
  EXPECT_FALSE(responses[0].changes(2).has_object_before());

  request.set_from_revision(5);
  ASSERT_TRUE(ask(&responses).ok());
  ASSERT_EQ(responses.size(), 1u);
  EXPECT_EQ(responses[0].changes_size(), 0);
  request.set_to_revision(4);
  EXPECT_EQ(ask(&responses).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  request.set_to_revision(6);
  EXPECT_EQ(ask(&responses).error_code(), grpc::StatusCode::OUT_OF_RANGE);
  request.clear_to_revision();
  request.mutable_scope()->add_layers("nowhere");
  EXPECT_EQ(ask(&responses).error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_P(WatchServiceTest, RevisionsAreListedInPages) {
  for (int i = 0; i < 9; ++i) Edit({CupAt(i)});
  const auto list = [&](int after, int before, int page, bool newest_first) {
    v1::ListRevisionsRequest request;
    request.set_map("site");
    request.set_after_revision(after);
    request.set_before_revision(before);
    request.set_page_size(page);
    request.set_newest_first(newest_first);
    v1::ListRevisionsResponse response;
    grpc::ClientContext context;
    EXPECT_TRUE(server_.watch->ListRevisions(&context, request, &response).ok());
    EXPECT_EQ(response.newest_revision(), 10);
    EXPECT_EQ(response.oldest_revision(), 0);
    std::vector<int> revisions;
    for (const v1::RevisionInfo& info : response.revisions()) {
      EXPECT_EQ(info.author(), "test");
      EXPECT_TRUE(info.has_time());
      EXPECT_GE(info.num_changes(), 1);
      revisions.push_back(static_cast<int>(info.revision()));
    }
    return revisions;
  };
  EXPECT_THAT(list(0, 0, 3, false), ElementsAre(1, 2, 3));
  EXPECT_THAT(list(8, 0, 0, false), ElementsAre(9, 10));
  EXPECT_THAT(list(0, 0, 2, true), ElementsAre(10, 9));
  EXPECT_THAT(list(0, 9, 2, true), ElementsAre(8, 7));
  EXPECT_THAT(list(10, 0, 5, false), IsEmpty());
}

}  // namespace
}  // namespace hypermap::server
