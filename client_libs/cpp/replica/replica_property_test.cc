// Compares a replica with its server: the same queries at the same revision, after random edits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client_libs/cpp/replica/replica.h"
#include "client_libs/cpp/replica/testing/answer_text.h"
#include "client_libs/cpp/replica/testing/site_server.h"
#include "map/digest/content_digest.h"
#include "tests/support/random_map.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::client {
namespace {

using ::hypermap::testing::RandomPolygon;
using ::hypermap::testing::Rng;
using ::hypermap::testing::TemporaryFolder;
using ::hypermap::testing::Uniform;
using ::hypermap::testing::UniformInt;

template <typename T>
const T& OneOf(Rng& rng, const std::vector<T>& all) {
  return all[UniformInt(rng, 0, static_cast<int>(all.size()) - 1)];
}

// Random options: some layers or all, in an area in some frame or everywhere.
ReplicaOptions RandomSelection(Rng& rng) {
  ReplicaOptions options{.map = "site"};
  if (UniformInt(rng, 0, 1)) {
    for (const char* layer :
         {"semantic", "dock.objects", "occupancy", "exploration", "wifi", "adrift-grid", "extra"}) {
      if (UniformInt(rng, 0, 2)) options.layers.emplace_back(layer);
    }
  }
  if (UniformInt(rng, 0, 2)) {
    const Point centre{Uniform(rng, -10, 10), Uniform(rng, -10, 10)};
    options.area = RandomPolygon(rng, centre, Uniform(rng, 5, 30), UniformInt(rng, 0, 1) * 0.25);
    options.frame_id = OneOf<std::string>(rng, {"", "dock", "bench", "raft"});
  }
  options.write_delay = absl::Milliseconds(UniformInt(rng, 0, 20));
  return options;
}

// Queries a replica and its server, and counts the queries that the replica could answer.
class Questioner {
 public:
  Questioner(Rng& rng, Client client, const Replica& replica, const ReplicaOptions& options)
      : rng_(rng), client_(std::move(client)), replica_(replica), options_(options) {}

  // The replica must not change meanwhile.
  void Ask() {
    then_.as_of.revision = replica_.state().revision;
    Scope local;
    local.frame_id = OneOf<std::string>(rng_, {"", "map", "dock", "bench", "raft"});
    for (const LayerEntry& layer : replica_.ListLayers().layers) {
      if (UniformInt(rng_, 0, 2) == 0) local.layers.push_back(layer.spec.name);
    }
    Scope remote = local;
    // A query without layers asks all mirrored ones.
    if (remote.layers.empty()) {
      for (const LayerEntry& layer : replica_.ListLayers().layers) {
        remote.layers.push_back(layer.spec.name);
      }
    }
    if (remote.layers.empty()) return;
    AskPoints(local, remote);
    AskArea(local, remote);
    AskValue(local, remote);
    AskNearest(local, remote);
  }

  // Compares the lists of layers and frames. The server must not change meanwhile, either.
  void CompareStructure() {
    const auto layers = client_.ListLayers("site");
    ASSERT_TRUE(layers.ok()) << layers.status();
    const LayerList mirrored = replica_.ListLayers();
    EXPECT_EQ(mirrored.revision, layers->revision);
    for (const LayerEntry& layer : mirrored.layers) {
      const auto there = std::find_if(
          layers->layers.begin(), layers->layers.end(),
          [&layer](const LayerEntry& other) { return other.spec.name == layer.spec.name; });
      ASSERT_NE(there, layers->layers.end()) << layer.spec.name;
      EXPECT_EQ(layer.spec, there->spec);
      EXPECT_EQ(layer.extent, there->extent);
      if (options_.area) continue;
      EXPECT_EQ(layer.size, there->size);
      EXPECT_EQ(layer.version, there->version) << layer.spec.name;
    }
    const auto frames = client_.ListTransforms("site");
    ASSERT_TRUE(frames.ok()) << frames.status();
    EXPECT_EQ(replica_.ListTransforms().transforms, frames->transforms);
    EXPECT_EQ(replica_.ListTransforms().frame_id, frames->frame_id);
    if (!options_.area) CompareDigests();
  }

  int num_known() const { return num_known_; }
  int num_unknown() const { return num_unknown_; }

 private:
  Point RandomPoint() {
    // Half of the coordinates lie on edges of cells.
    const double snap = UniformInt(rng_, 0, 1) ? 0.25 : 1e-6;
    const auto coordinate = [&] { return std::round(Uniform(rng_, -15, 15) / snap) * snap; };
    return {coordinate(), coordinate()};
  }

  void CompareDigests() {
    const auto there = client_.DigestMap("site");
    ASSERT_TRUE(there.ok()) << there.status();
    const ContentDigest here = DigestOf(*replica_.snapshot());
    EXPECT_EQ(here.revision, there->digest.revision);
    EXPECT_EQ(here.frames, there->digest.frames);
    for (const auto& [layer, digest] : here.layers) {
      EXPECT_EQ(digest, there->digest.layers.at(layer)) << layer;
    }
  }

  void Compare(const std::string& here, const std::string& there) {
    if (options_.area && here.find("OUT_OF_RANGE") == 0) {
      ++num_unknown_;
      return;
    }
    // The frame is known only through layers that are not mirrored.
    if (!options_.layers.empty() && here.find("NOT_FOUND") == 0 &&
        here.find("frame") != here.npos) {
      return;
    }
    ++num_known_;
    EXPECT_EQ(here, there);
  }

  void AskPoints(const Scope& local, const Scope& remote) {
    const Point p = RandomPoint();
    Compare(Text(replica_.QueryPoint(p, local)),
            Text(client_.QueryPoint("site", p, remote, then_)));
    const std::vector<Point> points = {RandomPoint(), RandomPoint(), RandomPoint()};
    const auto stream = client_.QueryPoints("site", remote, then_);
    Compare(Text(replica_.QueryPoints(points, local)), Text(stream->Ask(points)));
  }

  void AskArea(const Scope& local, const Scope& remote) {
    const Polygon area = RandomPolygon(rng_, RandomPoint(), Uniform(rng_, 0.2, 8), 0.25);
    Compare(Text(replica_.QueryArea(area, local)),
            Text(client_.QueryArea("site", area, remote, then_)));
  }

  void AskValue(const Scope& local, const Scope& remote) {
    const std::string value = RandomValue();
    const Polygon area = RandomPolygon(rng_, RandomPoint(), Uniform(rng_, 0.2, 8));
    Compare(Text(replica_.QueryValue(value, area, local)),
            Text(client_.QueryValue("site", value, area, remote, then_)));
    // A value query without an area is limited to the replica's area, given in that area's frame.
    Scope here = local;
    Scope there = remote;
    here.frame_id = there.frame_id = options_.frame_id;
    Compare(Text(replica_.QueryValue(value, std::nullopt, here)),
            Text(client_.QueryValue("site", value, options_.area, there, then_)));
  }

  void AskNearest(const Scope& local, const Scope& remote) {
    const Point p = RandomPoint();
    const std::string value = RandomValue();
    const int k = UniformInt(rng_, 1, 4);
    Compare(Text(replica_.QueryNearest(p, value, k, local)),
            Text(client_.QueryNearest("site", p, value, k, remote, then_)));
  }

  std::string RandomValue() {
    return OneOf<std::string>(rng_, {"chair", "CUP", "seat", "tag:furniture", "free", "occupied",
                                     "unknown", "explored", "unexplored", ">0.5", "-70..-40"});
  }

  Rng& rng_;
  Client client_;
  const Replica& replica_;
  const ReplicaOptions& options_;
  CallOptions then_;
  int num_known_ = 0;
  int num_unknown_ = 0;
};

// A replica is compared with its server during random edits, breaks and restarts.
TEST(ReplicaPropertyTest, AnswersWhatTheServerAnswersAtItsRevision) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  int num_known = 0;
  int num_unknown = 0;
  for (int round = 0; round < 12; ++round) {
    const TemporaryFolder data;
    const TemporaryFolder folder;
    SiteServer server(data.path());
    server.MakeMap("site", hypermap::testing::RandomSite(rng, UniformInt(rng, 0, 40)));
    ReplicaOptions options = RandomSelection(rng);
    options.folder = folder.path();
    const Client client(server.address());
    auto replica = Replica::Open(client, options);
    ASSERT_TRUE(replica.ok()) << replica.status();
    for (int step = 0; step < 6; ++step) {
      Revision revision = 0;
      for (int i = UniformInt(rng, 1, 5); i > 0; --i) {
        revision =
            server.Edit("site", hypermap::testing::RandomEdits(rng, *server.SnapshotOf("site")));
      }
      const int what = UniformInt(rng, 0, 5);
      if (what == 0) {  // a break
        server.Stop();
        server.Start();
      } else if (what == 1) {  // a restart from the file
        replica->reset();
        replica = Replica::Open(client, options);
        ASSERT_TRUE(replica.ok()) << replica.status();
      }
      const absl::Status reached = (*replica)->AwaitRevision(revision, kPatience);
      ASSERT_TRUE(reached.ok()) << reached << (*replica)->state().problem;
      Questioner questioner(rng, client, **replica, options);
      questioner.CompareStructure();
      for (int i = 0; i < 8; ++i) questioner.Ask();
      num_known += questioner.num_known();
      num_unknown += questioner.num_unknown();
      if (::testing::Test::HasFailure()) return;
    }
  }
  // The replica must not pass by refusing most queries.
  EXPECT_GT(num_known, num_unknown / 4);
  EXPECT_GT(num_known, 500);
}

}  // namespace
}  // namespace hypermap::client
