// Batches whose caller has gone are given up and change nothing.
#include <optional>
#include <utility>

#include "base/cancellation/testing/cancelled_after.h"
#include "gtest/gtest.h"
#include "map/edits/apply.h"
#include "map/layers/grid_layer.h"
#include "map/query/query.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using testing::MakeSnapshot;

LayerSpec Grid() {
  return {
      .name = "grid", .kind = LayerKind::kOccupancy, .grid = GridGeometry{PlanarTransform(), 1.0}};
}

Edit Fill(double side, double value) {
  return FillPolygon{"grid", Polygon::FromBox({{0, 0}, {side, side}}), "", CellRule::kCentre,
                     value};
}

TEST(ApplyCancellationTest, A4_FillIsGivenUpAndChangesNothing) {
  const Snapshot before = MakeSnapshot("m", {{CreateLayer{Grid()}, Fill(10, 1.0)}});
  const EditBatch batch{{Fill(300, 0.0)}};
  EXPECT_GT(TimesCancelled([&] { return Apply(before, batch).status(); }), 10);
  EXPECT_EQ(before.revision, 1);
  EXPECT_EQ(before.FindGrid("grid")->extent(), (CellBox{0, 10, 0, 10}));
  EXPECT_EQ(before.FindGrid("grid")->ValueAt({5, 5}), 1.0);
  const auto applied = Apply(before, batch);
  ASSERT_TRUE(applied.ok()) << applied.status();
  EXPECT_EQ(applied->snapshot->FindGrid("grid")->ValueAt({299, 299}), 0.0);
}

TEST(ApplyCancellationTest, A4_ManyEditsAreGivenUp) {
  const Snapshot before = MakeSnapshot("m", {{CreateLayer{{.name = "things"}}}});
  SemanticObject cup{.label = "cup", .shape = Polygon::FromBox({{0, 0}, {1, 1}})};
  const EditBatch batch{std::vector<Edit>(200, PutObject{"things", cup, ""})};
  EXPECT_GT(TimesCancelled([&] { return Apply(before, batch).status(); }), 10);
}

TEST(ApplyCancellationTest, A4_NearestIsGivenUp) {
  const Snapshot map = MakeSnapshot("m", {{CreateLayer{Grid()}, Fill(1000, 0.0),
                                           WriteCells{"grid", {999, 1000, 999, 1000}, {1.0}}}});
  const auto ask = [&map] { return Nearest(map, {}, {0, 0}, ValueKeyword::kOccupied, 1); };
  EXPECT_GT(TimesCancelled([&ask] { return ask().status(); }), 5);
  const auto answer = ask();
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->entries.size(), 1u);
}

TEST(ApplyCancellationTest, A4_NearestOfManyObjectsIsGivenUp) {
  std::vector<Edit> edits{CreateLayer{{.name = "things"}}};
  for (int i = 0; i < 2000; ++i) {
    SemanticObject cup{.label = "cup", .shape = Polygon::FromBox({{i * 2.0, 0}, {i * 2.0 + 1, 1}})};
    edits.push_back(PutObject{"things", std::move(cup), ""});
  }
  const Snapshot map = MakeSnapshot("m", {std::move(edits)});
  const auto ask = [&map] { return Nearest(map, {}, {0, 0}, ValueLabel{"cup"}, 1500); };
  EXPECT_GT(TimesCancelled([&ask] { return ask().status(); }), 5);
}

}  // namespace
}  // namespace hypermap
