#include "server/watch/watch_group.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "base/metering/memory_meter.h"
#include "base/sync/steady_time.h"
#include "map/edits/apply.h"
#include "map/watch/structure.h"
#include "server/services/testing/test_server.h"
#include "server/watch/watch_messages.h"
#include "server/watch/watch_source.h"
#include "tests/support/random_map.h"
#include "wire/geometry.h"

namespace hypermap::server {
namespace {

using ::testing::ElementsAre;
using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;
using Form = WatchGroup::Form;

hypermap::PutObject Put(const std::string& label, double x, ObjectId id = 0) {
  hypermap::PutObject put{"things", {}, ""};
  put.object.id = id;
  put.object.label = label;
  put.object.shape = Polygon::FromBox({{x, 0}, {x + 1, 1}});
  return put;
}

hypermap::CreateLayer Layer(const std::string& name) {
  LayerSpec spec;
  spec.name = name;
  return {spec};
}

// The bytes of each message in a coalesced one; a message that is not coalesced as it is.
std::vector<std::string> Unpacked(const grpc::Slice& slice) {
  v1::WatchResponse message;
  EXPECT_TRUE(message.ParseFromArray(slice.begin(), static_cast<int>(slice.size())));
  std::vector<std::string> single;
  for (const v1::WatchResponse& one : message.coalesced())
    single.push_back(one.SerializeAsString());
  if (single.empty()) single.push_back(message.SerializeAsString());
  return single;
}

std::vector<Revision> RevisionsIn(const grpc::Slice& slice) {
  std::vector<Revision> revisions;
  for (const std::string& bytes : Unpacked(slice)) {
    v1::WatchResponse message;
    EXPECT_TRUE(message.ParseFromString(bytes));
    revisions.push_back(message.revision());
  }
  return revisions;
}

// A feed of a map with the layer "things" at revision 1, and watches of it.
class WatchGroupTest : public ::testing::Test {
 protected:
  struct Watch {
    std::shared_ptr<WatchGroup> group;
    StructurePtr structure;
    Follower follower;

    std::optional<WatchGroup::Run> Take(Revision after, Form form) {
      return group->Take(after, structure, follower, form);
    }
  };

  WatchGroupTest()
      : map_(std::make_shared<Snapshot>(testing::MakeSnapshot("m", {{Layer("things")}}))),
        feed_(map_->revision, StructureOf(*map_), {}) {
    limits_.chunk_items = 3;
  }

  void Commit(std::vector<hypermap::Edit> edits) {
    const auto applied = Apply(*map_, EditBatch{std::move(edits)});
    ASSERT_TRUE(applied.ok()) << applied.status();
    map_ = applied->snapshot;
    std::vector<FeedCommit> commits;
    commits.push_back({map_->revision, absl::UnixEpoch(), "test",
                       std::make_shared<const std::vector<Change>>(applied->changes), nullptr});
    feed_.Append(std::move(commits));
  }
  void CommitPuts(int count) {
    for (int i = 0; i < count; ++i) Commit({Put("cup", i)});
  }

  // A watch of `classes` whose cursor is at `revision`.
  Watch WatchAt(Revision revision, std::shared_ptr<WatchGroup> group,
                std::vector<std::string> classes = {}) {
    const StructurePtr structure = *feed_.StructureAt(revision);
    WatchFilter filter;
    filter.classes = std::move(classes);
    return {std::move(group), structure, *Follower::Make(filter, structure)};
  }
  std::shared_ptr<WatchGroup> Group(const WatchTuning& tuning = {}) {
    return std::make_shared<WatchGroup>(&feed_, /*incarnation=*/7, limits_, tuning, &bytes_);
  }

  Limits limits_;
  std::atomic<int64_t> bytes_ = 0;
  SnapshotPtr map_;
  ChangeFeed feed_;
};

TEST_F(WatchGroupTest, AMessageIsMadeOnceForAll) {
  CommitPuts(3);
  const auto group = Group();
  Watch one = WatchAt(1, group), other = WatchAt(1, group);
  for (const Revision after : {1, 2, 3}) {
    const auto first = one.Take(after, Form::kSingle);
    const auto second = other.Take(after, Form::kSingle);
    ASSERT_TRUE(first && second);
    EXPECT_THAT(RevisionsIn(first->message), ElementsAre(after + 1));
    EXPECT_EQ(first->message.begin(), second->message.begin());
    EXPECT_EQ(second->end, after + 1);
    EXPECT_EQ(second->told, after + 1);
    EXPECT_EQ(second->num_changes, 1);
  }
  EXPECT_EQ(one.Take(4, Form::kSingle), std::nullopt);
}

TEST_F(WatchGroupTest, ThoseWhoComeTogetherGetTheSameBytesAndEndAtTheSamePlace) {
  CommitPuts(3);
  const auto group = Group();
  Watch first = WatchAt(1, group), second = WatchAt(1, group), ahead = WatchAt(2, group);
  const auto run = first.Take(1, Form::kCoalesced);
  ASSERT_TRUE(run);
  EXPECT_THAT(RevisionsIn(run->message), ElementsAre(2, 3, 4));
  EXPECT_EQ(run->num_changes, 3);
  EXPECT_TRUE(run->reaches_end);
  CommitPuts(2);
  EXPECT_EQ(second.Take(1, Form::kCoalesced)->message.begin(), run->message.begin());
  const auto rest = ahead.Take(2, Form::kCoalesced);
  EXPECT_THAT(RevisionsIn(rest->message), ElementsAre(3, 4));
  EXPECT_TRUE(rest->reaches_end);
  EXPECT_THAT(RevisionsIn(ahead.Take(4, Form::kCoalesced)->message), ElementsAre(5, 6));
  EXPECT_EQ(first.Take(6, Form::kCoalesced), std::nullopt);
}

TEST_F(WatchGroupTest, CommitsThatSelectNothingArePassedOver) {
  Commit({Put("chair", 0)});  // 2
  Commit({Put("cup", 1)});    // 3
  Commit({Put("chair", 2)});  // 4
  Watch watch = WatchAt(1, Group(), {"cup"});
  const auto run = watch.Take(1, Form::kCoalesced);
  ASSERT_TRUE(run);
  EXPECT_EQ(run->end, 4);
  EXPECT_EQ(run->told, 3);
  EXPECT_THAT(RevisionsIn(run->message), ElementsAre(3));
  Commit({Put("chair", 3)});  // 5
  const auto nothing = watch.Take(4, Form::kSingle);
  ASSERT_TRUE(nothing);
  EXPECT_EQ(nothing->end, 5);
  EXPECT_EQ(nothing->told, 0);
  EXPECT_EQ(nothing->message.size(), 0u);
}

TEST_F(WatchGroupTest, LargeCommitsAreToldByEachAlone) {
  CommitPuts(1);                                                         // 2
  Commit({Put("cup", 0), Put("cup", 1), Put("cup", 2), Put("cup", 3)});  // 3
  CommitPuts(2);                                                         // 4, 5
  Watch watch = WatchAt(1, Group());
  const auto run = watch.Take(1, Form::kCoalesced);
  ASSERT_TRUE(run);
  EXPECT_EQ(run->end, 2);
  EXPECT_FALSE(run->reaches_end);
  EXPECT_EQ(watch.Take(2, Form::kCoalesced), std::nullopt);
  EXPECT_EQ(watch.Take(2, Form::kSingle), std::nullopt);
  EXPECT_THAT(RevisionsIn(watch.Take(3, Form::kCoalesced)->message), ElementsAre(4, 5));
}

// A comb whose 2,560 slanted teeth stand between the centres of the cells of a tile.
Polygon Comb() {
  Ring ring{{0, -2}, {128, -2}, {128, -1}};
  for (int i = 2'559; i >= 0; --i) {
    ring.insert(ring.end(), {{(i + 0.5) / 20, -1}, {(i + 0.4) / 20, 200}, {(i + 0.3) / 20, -1}});
  }
  ring.push_back({0, -1});
  return *Polygon::Make(std::move(ring));
}

hypermap::WriteCells AllOfTile(const std::string& layer, double value) {
  return {layer, {0, 128, 0, 128}, std::vector<std::optional<double>>(kCellsPerTile, value)};
}

TEST_F(WatchGroupTest, CommitsThatTakeLongToCompareAreToldByEachAlone) {
  Commit(LayerOfCells("cells", 128, 128).edits);  // 2
  Commit({AllOfTile("cells", 0.25)});             // 3
  const StructurePtr structure = *feed_.StructureAt(2);
  const WatchFilter filter{.area = Comb()};
  for (const Form form : {Form::kSingle, Form::kCoalesced}) {
    Watch watch{Group(), structure, *Follower::Make(filter, structure)};
    EXPECT_EQ(watch.Take(2, form), std::nullopt);
    EXPECT_EQ(watch.Take(2, form), std::nullopt);
    // With more time, the group finds that nothing is selected.
    watch.group = Group({.max_encoding = absl::Hours(1)});
    const auto nothing = watch.Take(2, form);
    ASSERT_TRUE(nothing);
    EXPECT_EQ(nothing->end, 3);
    EXPECT_EQ(nothing->num_changes, 0);
  }
}

TEST_F(WatchGroupTest, CommitsThatChangeTheStructureAreToldByEachAlone) {
  CommitPuts(1);             // 2
  Commit({Layer("later")});  // 3
  CommitPuts(1);             // 4
  const auto group = Group();
  Watch before = WatchAt(1, group), after = WatchAt(3, group);
  EXPECT_THAT(RevisionsIn(before.Take(1, Form::kCoalesced)->message), ElementsAre(2));
  EXPECT_EQ(before.Take(2, Form::kCoalesced), std::nullopt);
  // The watch has to move on to the new structure first.
  EXPECT_EQ(before.Take(3, Form::kCoalesced), std::nullopt);
  EXPECT_THAT(RevisionsIn(after.Take(3, Form::kCoalesced)->message), ElementsAre(4));
}

TEST_F(WatchGroupTest, TheRingIsBoundedAndWhoFallsOutOfItIsAlone) {
  const auto group = Group({.max_ring_commits = 4});
  Watch quick = WatchAt(1, group), slow = WatchAt(1, group);
  CommitPuts(10);
  ASSERT_TRUE(quick.Take(9, Form::kSingle));
  EXPECT_EQ(slow.Take(1, Form::kSingle), std::nullopt);
  EXPECT_EQ(slow.Take(6, Form::kCoalesced), std::nullopt);
  EXPECT_THAT(RevisionsIn(slow.Take(9, Form::kCoalesced)->message), ElementsAre(10, 11));
}

TEST_F(WatchGroupTest, AllRingsTogetherAreBounded) {
  const WatchTuning tuning{.max_bytes_of_all_rings = 2000};
  CommitPuts(100);
  std::vector<std::shared_ptr<WatchGroup>> groups;
  for (int i = 0; i < 3; ++i) {
    groups.push_back(Group(tuning));
    Watch watch = WatchAt(1, groups.back());
    for (Revision after = 1; after < 101; ++after) watch.Take(after, Form::kSingle);
    // Each ring keeps its newest message, even if all rings together are over the limit.
    EXPECT_LE(bytes_.load(), 2000 + 300 * i);
  }
  EXPECT_GT(bytes_.load(), 0);
  groups.clear();
  EXPECT_EQ(bytes_.load(), 0);
}

TEST_F(WatchGroupTest, AMessageIsBounded) {
  CommitPuts(1000);
  Watch watch = WatchAt(1, Group({.max_coalesced_messages = 100}));
  Revision told = 1;
  for (bool at_end = false; !at_end;) {
    const auto run = watch.Take(told, Form::kCoalesced);
    ASSERT_TRUE(run);
    const std::vector<Revision> revisions = RevisionsIn(run->message);
    EXPECT_LE(revisions.size(), 100u);
    EXPECT_EQ(revisions.front(), told + 1);
    told = run->end;
    at_end = run->reaches_end;
  }
  EXPECT_EQ(told, 1001);
}

TEST(WatchGroupsTest, WatchesWithTheSameFilterAreAGroupUntilTheLastIsGone) {
  ChangeFeed feed(1, std::make_shared<MapStructure>(), {}),
      other_feed(1, feed.StructureAt(1).value(), {});
  WatchGroups groups{Limits()};
  const WatchFilter filter{.layers = {"things"}, .area = Polygon::FromBox({{0, 0}, {1, 1}})};
  auto group = groups.Join(&feed, /*incarnation=*/1, filter);
  EXPECT_EQ(groups.Join(&feed, /*incarnation=*/1, WatchFilter(filter)), group);
  EXPECT_NE(groups.Join(&other_feed, /*incarnation=*/2, filter), group);
  WatchFilter different = filter;
  different.classes = {"cup"};
  EXPECT_NE(groups.Join(&feed, /*incarnation=*/1, different), group);
  different = filter;
  different.area = Polygon::FromBox({{0, 0}, {1, 2}});
  EXPECT_NE(groups.Join(&feed, /*incarnation=*/1, different), group);
  different = filter;
  different.frames = WatchFilter::Frames::kAsStored;
  EXPECT_NE(groups.Join(&feed, /*incarnation=*/1, different), group);
  const std::weak_ptr<WatchGroup> gone = group;
  group.reset();
  EXPECT_TRUE(gone.expired());
  EXPECT_NE(groups.Join(&feed, /*incarnation=*/1, filter), nullptr);
}

TEST(WatchSourceTest, ACommitThatTakesManyStepsIsChargedWhenTheFeedDropsIt) {
  SessionOptions options;
  options.feed.max_commits = 1;
  TestServer server({}, 1 << 20, options);
  server.MakeMap("site", LayerOfCells("cells", 128, 128));
  MapSession& session = **server.site().Find("site");
  const auto write = [&](double value) {
    return session.SubmitAndWait({{{AllOfTile("cells", value)}}, "test", ""}).status();
  };
  ASSERT_TRUE(write(0.25).ok());
  WorkerPools workers(1);
  const Facilities facilities{&server.site(), {}, &workers, "", nullptr};
  const WatchTuning tuning{.max_encoding = absl::ZeroDuration()};
  WatchGroups groups(Limits(), tuning);
  v1::WatchRequest request;
  request.mutable_scope()->set_map("site");
  wire::EncodePolygon(Comb(), request.mutable_area());
  request.set_start_revision(1);
  const auto source = *WatchSource::Open(facilities, tuning, &groups, request);
  MemoryCap unlimited("", 0);
  MemoryMeter meter(&unlimited);
  const ScopedMeter metered(&meter);
  grpc::Slice message;
  EXPECT_EQ(*source->Next(SteadyTime::Now(), &message), WatchSource::Step::kNothingYet);
  EXPECT_TRUE(source->holds_commits());
  EXPECT_EQ(meter.taken(), 0);
  ASSERT_TRUE(write(0.75).ok());
  EXPECT_EQ(*source->Next(SteadyTime::Now(), &message), WatchSource::Step::kNothingYet);
  EXPECT_GT(meter.taken(), kCellsPerTile);
}

// The first message of a replica describes the map, which messages for all watches do not.
TEST(WatchSourceTest, SharedMessagesDoNotComeBeforeTheFirstOneOfAReplica) {
  TestServer server;
  server.MakeMap("site", LayerOfCells("cells", 8, 8));
  WorkerPools workers(1);
  const Facilities facilities{&server.site(), {}, &workers, "", nullptr};
  const WatchTuning tuning;
  WatchGroups groups(Limits(), tuning);
  v1::ReplicateRequest request;
  request.mutable_scope()->set_map("site");
  request.set_start_revision(1);
  const auto source = *WatchSource::Open(facilities, tuning, &groups, request);
  MapSession& session = **server.site().Find("site");
  ASSERT_TRUE(
      session.SubmitAndWait({{{hypermap::WriteCells{"cells", {0, 1, 0, 1}, {0.5}}}}, "", ""}).ok());
  grpc::Slice bytes;
  EXPECT_FALSE(source->TakeShared(SteadyTime::Now(), &bytes));
  ASSERT_EQ(*source->Next(SteadyTime::Now(), &bytes), WatchSource::Step::kMessage);
  v1::ReplicateResponse first;
  ASSERT_TRUE(first.ParseFromArray(bytes.begin(), static_cast<int>(bytes.size())));
  EXPECT_TRUE(first.has_map());
  EXPECT_TRUE(source->TakeShared(SteadyTime::Now(), &bytes));
}

// Random edits that reset no watch.
std::vector<hypermap::Edit> RandomEdits(Rng& rng, Revision revision, std::vector<ObjectId>& live) {
  if (UniformInt(rng, 0, 15) == 0) return {Layer(absl::StrCat("layer-", revision))};
  if (UniformInt(rng, 0, 15) == 0) {
    return {hypermap::WriteCells{"cells", {0, 1, UniformInt(rng, 0, 300), 301}, {}}};
  }
  std::vector<hypermap::Edit> edits;
  for (int i = UniformInt(rng, 1, UniformInt(rng, 0, 5) == 0 ? 12 : 2); i > 0; --i) {
    const std::string label = UniformInt(rng, 0, 1) == 0 ? "cup" : "chair";
    const bool old = !live.empty() && UniformInt(rng, 0, 1) == 0;
    const size_t which = old ? UniformInt(rng, 0, static_cast<int>(live.size()) - 1) : 0;
    if (old && UniformInt(rng, 0, 2) == 0) {
      edits.push_back(hypermap::DeleteObject{"things", live[which], {}});
      live.erase(live.begin() + static_cast<std::ptrdiff_t>(which));
    } else {
      edits.push_back(Put(label, Uniform(rng, -20, 20), old ? live[which] : 0));
    }
  }
  return edits;
}

// A watch of a map's session without a server, which takes messages when the test asks for them.
class RandomWatch {
 public:
  RandomWatch(const Facilities& facilities, const WatchTuning& tuning, WatchGroups* groups,
              v1::WatchRequest request)
      : request_(std::move(request)),
        source_(*WatchSource::Open(facilities, tuning, groups, request_)) {}

  // Takes at most `max_messages` messages. Returns false if there is nothing new.
  bool Take(int max_messages) {
    grpc::Slice message;
    for (int i = 0; i < max_messages;) {
      const auto step = source_->Next(SteadyTime::Now(), &message);
      EXPECT_TRUE(step.ok()) << step.status();
      if (!step.ok() || *step == WatchSource::Step::kNothingNew) return false;
      if (*step == WatchSource::Step::kNothingYet) continue;
      ++i;
      for (std::string& single : Unpacked(message)) {
        v1::WatchResponse response;
        EXPECT_TRUE(response.ParseFromString(single));
        if (response.changes_size() > 0) told_.push_back(std::move(single));
      }
    }
    return true;
  }

  const v1::WatchRequest& request() const { return request_; }
  const std::vector<std::string>& told() const { return told_; }

 private:
  const v1::WatchRequest request_;
  const std::unique_ptr<WatchSource> source_;
  std::vector<std::string> told_;
};

// Oracle: the messages of all commits after `start`, filtered and encoded without a group.
std::vector<std::string> ToldAlone(const ChangeFeed& feed, uint64_t incarnation,
                                   const Limits& limits, const WatchFilter& filter,
                                   Revision start) {
  std::vector<std::string> messages;
  Follower follower = *Follower::Make(filter, *feed.StructureAt(start));
  const auto commits = feed.Read(start, 1'000'000);
  EXPECT_TRUE(commits.has_value());
  if (!commits) return messages;
  for (const FeedCommit& commit : *commits) {
    const auto parts = follower.ReadCommit(commit.changes, commit.structure);
    EXPECT_NE(parts, nullptr);
    std::vector<MapChange> told;
    while (parts && !parts->done()) {
      for (MapChange& change : parts->Next(1'000)) told.push_back(std::move(change));
    }
    for (MapChange& change : told) {
      if (change.layer_now) change.layer_now->version = commit.revision;
    }
    for (size_t next = 0; next < told.size();) {
      WatchMessage message = MessageOf(commit, incarnation);
      next = EncodeChanges(told, next, limits, message.mutable_changes());
      message.set_more(next < told.size());
      messages.push_back(message.SerializeAsString());
    }
  }
  return messages;
}

TEST(WatchGroupPropertyTest, WhatIsSharedIsWhatEachWouldBeToldAlone) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(absl::StrCat("HYPERMAP_TEST_SEED=", seed));
  Rng rng(seed);
  Limits limits;
  limits.chunk_items = 5;
  TestServer server(limits);
  EditBatch site = LayerOfCells("cells", 1, 301);
  site.edits.push_back(Layer("things"));
  server.MakeMap("site", std::move(site));
  MapSession& session = **server.site().Find("site");
  WorkerPools workers(1);
  const Facilities facilities{&server.site(), limits, &workers, "", nullptr};
  // The ring is so small that watches are behind it now and then. Without time, each watch of an
  // area encodes for itself.
  const bool has_time = UniformInt(rng, 0, 1) == 0;
  const WatchTuning tuning{.max_ring_commits = 20,
                           .max_encoding = has_time ? absl::Milliseconds(2) : absl::ZeroDuration()};
  WatchGroups groups(limits, tuning);

  std::vector<WatchFilter> filters(5);
  filters[1].area = Polygon::FromBox({{-5, -1}, {5, 2}});
  filters[2].classes = {"cup"};
  filters[3].layers = {"cells"};
  filters[4].layers = {"elsewhere"};
  const auto request_of = [&](size_t filter) {
    v1::WatchRequest request;
    request.mutable_scope()->set_map("site");
    for (const std::string& layer : filters[filter].layers)
      request.mutable_scope()->add_layers(layer);
    for (const std::string& word : filters[filter].classes) request.add_classes(word);
    if (filters[filter].area) {
      wire::EncodePolygon(*filters[filter].area, request.mutable_area());
    }
    return request;
  };

  std::vector<std::pair<size_t, std::unique_ptr<RandomWatch>>> watches;
  std::vector<ObjectId> live;
  ObjectId last_id = 0;
  for (int step = 0; step < 400; ++step) {
    const Revision newest = session.feed().newest();
    std::vector<hypermap::Edit> edits = RandomEdits(rng, newest, live);
    if (auto* write = std::get_if<hypermap::WriteCells>(&edits[0])) {
      for (int col = write->box.col_begin; col < write->box.col_end; ++col) {
        write->values.push_back(Uniform(rng, 0, 1));
      }
    }
    const auto receipt = session.SubmitAndWait({{std::move(edits)}, "test", ""});
    ASSERT_TRUE(receipt.ok()) << receipt.status();
    for (const ObjectId id : receipt->object_ids) {
      if (id > last_id) live.push_back(last_id = id);
    }
    if (watches.size() < 40 && UniformInt(rng, 0, 4) == 0) {
      const size_t filter = UniformInt(rng, 0, 4);
      v1::WatchRequest request = request_of(filter);
      request.set_coalesce(UniformInt(rng, 0, 1) == 0);
      request.set_start_revision(UniformInt(rng, 1, static_cast<int>(session.feed().newest())));
      watches.emplace_back(
          filter, std::make_unique<RandomWatch>(facilities, tuning, &groups, std::move(request)));
    }
    for (const auto& [filter, watch] : watches) {
      if (UniformInt(rng, 0, 9) == 0) watch->Take(UniformInt(rng, 1, 10));
    }
  }
  ASSERT_GT(watches.size(), 10u);
  for (const auto& [filter, watch] : watches) {
    while (watch->Take(1)) {
    }
    SCOPED_TRACE(watch->request().ShortDebugString());
    EXPECT_EQ(watch->told(), ToldAlone(session.feed(), session.incarnation(), limits,
                                       filters[filter], watch->request().start_revision()));
  }
}

}  // namespace
}  // namespace hypermap::server
