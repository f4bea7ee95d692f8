// Tests that a damaged layer answers that it can't, and that the others do not notice.
#include <map>
#include <memory>
#include <string>

#include "gtest/gtest.h"
#include "map/layers/layer_registry.h"
#include "map/query/query.h"

namespace hypermap {
namespace {

const absl::Status kDamage = absl::DataLossError("page 7");

LayerSpec SpecOf(const std::string& name) {
  LayerSpec spec;
  spec.name = name;
  spec.kind = LayerKind::kSemantic;
  spec.frame_id = "map";
  return spec;
}

// A map with the empty layer "rooms" and the damaged layer "things".
SnapshotPtr DamagedMap() {
  auto snapshot = std::make_shared<Snapshot>();
  snapshot->map_name = "site";
  snapshot->layers.emplace("rooms", MakeEmptyLayer(SpecOf("rooms")));
  snapshot->damaged.emplace("things", DamagedLayer{MakeEmptyLayer(SpecOf("things")), kDamage});
  return snapshot;
}

const Scope kAll;
const Scope kThings{.layers = {"things"}, .frame_id = ""};

TEST(DamagedLayerTest, AnswersThatItIsDamaged) {
  const SnapshotPtr snapshot = DamagedMap();
  for (const Scope& scope : {kAll, kThings}) {
    const auto content = ContentAt(*snapshot, scope, {0.5, 0.5});
    ASSERT_TRUE(content.ok()) << content.status();
    std::map<std::string, AnswerStatus> statuses;
    for (const LayerPointContent& layer : *content) {
      statuses[layer.layer->spec().name] = layer.content.status;
    }
    EXPECT_EQ(statuses.size(), scope.layers.empty() ? 2u : 1u);
    EXPECT_EQ(statuses["things"], AnswerStatus::kDamaged);
    if (scope.layers.empty()) EXPECT_EQ(statuses["rooms"], AnswerStatus::kValue);

    auto asker = PointsAsker::Make(snapshot, scope);
    ASSERT_TRUE(asker.ok()) << asker.status();
    const auto points = asker->ContentAtEach({{0.5, 0.5}});
    ASSERT_TRUE(points.ok()) << points.status();
    EXPECT_EQ(points->back().status, AnswerStatus::kDamaged);

    const auto nearest = Nearest(*snapshot, scope, {0.5, 0.5}, ValueLabel{"hall"}, 1);
    ASSERT_TRUE(nearest.ok()) << nearest.status();
    ASSERT_EQ(nearest->refusals.size(), 1u);
    EXPECT_EQ(nearest->refusals[0].layer, "things");
    EXPECT_EQ(nearest->refusals[0].status, AnswerStatus::kDamaged);
  }
}

TEST(DamagedLayerTest, AnswersInPartsThatItIsDamaged) {
  auto parts = Search(DamagedMap(), kAll, ValueLabel{"chair"}, std::nullopt);
  ASSERT_TRUE(parts.ok()) << parts.status();
  EXPECT_EQ((*parts)->Next(10).status, AnswerStatus::kValue);
  const LayerAnswerPart part = (*parts)->Next(10);
  EXPECT_EQ(part.layer->spec().name, "things");
  EXPECT_EQ(part.status, AnswerStatus::kDamaged);
  EXPECT_TRUE(part.last);
  EXPECT_TRUE((*parts)->done());
}

TEST(DamagedLayerTest, CallersThatNeedItGetTheReason) {
  const SnapshotPtr snapshot = DamagedMap();
  EXPECT_EQ(snapshot->GetLayer("things").status(), kDamage);
  EXPECT_EQ(snapshot->SelectLayers({}).status(), kDamage);
  EXPECT_EQ(snapshot->SelectLayers({"rooms", "things"}).status(), kDamage);
  EXPECT_EQ(snapshot->SelectLayers({"rooms"})->size(), 1u);
  EXPECT_EQ(snapshot->CheckUndamaged({}), kDamage);
  EXPECT_TRUE(snapshot->CheckUndamaged({"rooms"}).ok());
  EXPECT_TRUE(snapshot->HasLayer("things"));
  EXPECT_EQ(snapshot->FindLayer("things"), nullptr);
}

}  // namespace
}  // namespace hypermap
