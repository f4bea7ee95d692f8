#include "map/edits/batch_layers.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using testing::MakeSnapshot;

CreateLayer Creation(const std::string& name) { return {LayerSpec{.name = name}}; }

// Checks a batch for a map with the layers "a" and "b".
std::string ErrorOf(const EditBatch& batch, int max_layers) {
  const Snapshot map = MakeSnapshot("m", {{Creation("a"), Creation("b")}});
  const absl::Status status = CheckLayers(map, batch, max_layers);
  EXPECT_TRUE(status.ok() || absl::IsResourceExhausted(status)) << status;
  return std::string(status.message());
}

TEST(BatchLayersTest, AMapGetsNoMoreLayersThanTheLimit) {
  const EditBatch batch{{Creation("c"), Creation("d")}};
  EXPECT_EQ(ErrorOf(batch, 4), "");
  EXPECT_EQ(ErrorOf(batch, 3), "edits[1]: the map has 3 layers up to here, and --max_layers is 3");
}

TEST(BatchLayersTest, AMapThatHasMoreStaysAndMayLoseSome) {
  EXPECT_EQ(ErrorOf({{DeleteLayer{"a"}}}, 1), "");
  EXPECT_EQ(ErrorOf({{DeleteLayer{"a"}, DeleteLayer{"b"}, Creation("a")}}, 1), "");
  EXPECT_EQ(ErrorOf({{DeleteLayer{"a"}, DeleteLayer{"a"}, Creation("a")}}, 1),
            "edits[2]: the map has 1 layers up to here, and --max_layers is 1");
}

TEST(BatchLayersTest, LayersThatTheBatchDeletesAgainAreCounted) {
  EditBatch batch;
  for (int i = 0; i < 5; ++i) {
    batch.edits.push_back(Creation("c"));
    batch.edits.push_back(DeleteLayer{"c"});
  }
  EXPECT_EQ(ErrorOf(batch, 5), "");
  EXPECT_EQ(ErrorOf(batch, 4),
            "edits[8]: the batch creates 4 layers up to here, and --max_layers is 4");
}

TEST(BatchLayersTest, EditsThatApplyRefusesAreNotCounted) {
  EXPECT_EQ(ErrorOf({{Creation("a"), Creation("b"), DeleteLayer{"x"}, Creation("c")}}, 3), "");
}

TEST(BatchLayersTest, ConditionsNameNoMoreLayersThanTheLimit) {
  EditBatch batch{{DeleteLayer{"a"}}};
  batch.if_layers = {{"a", 1}, {"b", 1}};
  EXPECT_EQ(ErrorOf(batch, 2), "");
  batch.if_layers.push_back({"a", 1});
  EXPECT_EQ(ErrorOf(batch, 2), "if_layers has 3 layers, and --max_layers is 2");
}

}  // namespace
}  // namespace hypermap
