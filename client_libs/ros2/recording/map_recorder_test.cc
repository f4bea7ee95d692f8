#include "client_libs/ros2/recording/map_recorder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client_libs/ros2/mcap/testing/mcap_file.h"
#include "client_libs/ros2/messages/messages.h"
#include "map/edits/apply.h"

namespace hypermap::ros2 {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

LayerSpec Floor() {
  LayerSpec spec;
  spec.name = "floor";
  spec.kind = LayerKind::kOccupancy;
  spec.grid = GridGeometry{{}, 0.5};
  return spec;
}

LayerSpec Things() {
  LayerSpec spec;
  spec.name = "the.things";
  return spec;
}

WriteCells Cell(int32_t row, int32_t col, double value) {
  return {"floor", {row, row + 1, col, col + 1}, {value}};
}

PutObject Sign(const Point& p) {
  SemanticObject object;
  object.label = "sign";
  object.shape = Shape::MakePointUnchecked(p);
  return {"the.things", object, ""};
}

// Records a map that is edited step by step; step n at n seconds since 1970.
class MapRecorderTest : public testing::Test {
 protected:
  MapRecorderTest() { Start({}); }

  void Start(RecorderOptions options) {
    file_.clear();
    auto bag = BagWriter::Begin([this](absl::string_view bytes) {
      absl::StrAppend(&file_, bytes);
      return absl::OkStatus();
    });
    ASSERT_TRUE(bag.ok()) << bag.status();
    bag_.emplace(*std::move(bag));
    recorder_.emplace(&*bag_, std::move(options));
  }
  void Step(std::vector<Edit> edits) {
    if (!edits.empty()) {
      EditBatch batch;
      batch.edits = std::move(edits);
      auto applied = Apply(*map_, batch);
      ASSERT_TRUE(applied.ok()) << applied.status();
      map_ = applied->snapshot;
    }
    ++step_;
    ASSERT_TRUE(recorder_->Record(map_, absl::FromUnixSeconds(step_)).ok());
  }
  std::vector<McapMessage> End() {
    EXPECT_TRUE(recorder_->End().ok());
    EXPECT_TRUE(bag_->Finish().ok());
    return MessagesOf(file_);
  }
  // The topics of a step's messages.
  static std::vector<std::string> TopicsAt(int step, const std::vector<McapMessage>& messages) {
    std::vector<std::string> topics;
    for (const McapMessage& message : messages) {
      if (message.time == step * uint64_t{1'000'000'000}) topics.push_back(message.topic);
    }
    return topics;
  }
  // The messages of a topic.
  template <typename Message>
  static std::vector<Message> Decode(const std::string& topic,
                                     const std::vector<McapMessage>& messages) {
    std::vector<Message> decoded;
    for (const McapMessage& message : messages) {
      if (message.topic == topic) decoded.push_back(*DecodeCdr<Message>(message.data));
    }
    return decoded;
  }

  SnapshotPtr map_ = std::make_shared<const Snapshot>();
  int step_ = 0;
  std::string file_;
  std::optional<BagWriter> bag_;
  std::optional<MapRecorder> recorder_;
};

TEST_F(MapRecorderTest, TheFirstStateIsWholeAndOthersTellWhatChanges) {
  Step({CreateLayer{Floor()}, CreateLayer{Things()}, Cell(0, 0, 1.0), Sign({1, 2})});
  Step({});
  Step({Cell(0, 0, 0.0)});
  Step({Sign({3, 4})});
  Step({SetTransform{{"map", "dock", PlanarTransform(1, 2, 0)}}});
  const auto messages = End();
  EXPECT_THAT(TopicsAt(1, messages),
              UnorderedElementsAre("/tf_static", "/map", "/hypermap/grids/floor",
                                   "/hypermap/the_things_semmap", "/hypermap/markers"));
  EXPECT_THAT(TopicsAt(2, messages), IsEmpty());
  EXPECT_THAT(TopicsAt(3, messages), UnorderedElementsAre("/map", "/hypermap/grids/floor"));
  EXPECT_THAT(TopicsAt(4, messages),
              UnorderedElementsAre("/hypermap/the_things_semmap", "/hypermap/markers"));
  EXPECT_THAT(
      TopicsAt(5, messages),
      UnorderedElementsAre("/tf_static", "/hypermap/the_things_semmap", "/hypermap/markers"));
  const auto things = Decode<hypermap_msgs::SemanticMap>("/hypermap/the_things_semmap", messages);
  ASSERT_EQ(things.size(), 3);
  EXPECT_EQ(things[0].objects.size(), 1);
  EXPECT_EQ(things[1].objects.size(), 2);
}

TEST_F(MapRecorderTest, ALargeGridIsUpdatedAndWholeAgainAfterAsManyCells) {
  Start({.whole_grid_cells = 3});
  Step({CreateLayer{Floor()}, Cell(0, 0, 0.0), Cell(1, 1, 0.0)});
  for (const double value : {1.0, 0.0, 1.0, 0.0, 1.0}) Step({Cell(1, 0, value)});
  const auto messages = End();
  EXPECT_THAT(TopicsAt(2, messages),
              UnorderedElementsAre("/map_updates", "/hypermap/grids/floor_updates"));
  const auto grids = Decode<nav_msgs::OccupancyGrid>("/map", messages);
  const auto updates = Decode<map_msgs::OccupancyGridUpdate>("/map_updates", messages);
  ASSERT_EQ(updates.size(), 4);
  EXPECT_EQ(updates[0].x, 0);
  EXPECT_EQ(updates[0].y, 1);
  EXPECT_THAT(updates[0].data, ElementsAre(100));
  // Whole at first, with the fourth change, and at the end after a last update.
  ASSERT_EQ(grids.size(), 3);
  EXPECT_THAT(grids[1].data, ElementsAre(0, -1, 0, 0));
  EXPECT_THAT(grids[2].data, ElementsAre(0, -1, 100, 0));
  EXPECT_EQ(grids[2].header.stamp.sec, 6);
}

TEST_F(MapRecorderTest, AGridThatGrowsIsWhole) {
  Start({.whole_grid_cells = 0});
  Step({CreateLayer{Floor()}, Cell(0, 0, 0.0)});
  Step({Cell(0, 1, 1.0)});
  const auto grids = Decode<nav_msgs::OccupancyGrid>("/map", End());
  ASSERT_EQ(grids.size(), 2);
  EXPECT_THAT(grids[1].data, ElementsAre(0, 100));
}

TEST_F(MapRecorderTest, LayersThatAreDeletedBecomeEmpty) {
  Step({CreateLayer{Floor()}, CreateLayer{Things()}, Cell(0, 0, 0.0), Sign({1, 2})});
  Step({DeleteLayer{"floor"}, DeleteLayer{"the.things"}});
  const auto messages = End();
  EXPECT_THAT(TopicsAt(2, messages),
              UnorderedElementsAre("/map", "/hypermap/grids/floor", "/hypermap/the_things_semmap",
                                   "/hypermap/markers"));
  EXPECT_THAT(Decode<nav_msgs::OccupancyGrid>("/map", messages).at(1).data, IsEmpty());
  EXPECT_THAT(
      Decode<hypermap_msgs::SemanticMap>("/hypermap/the_things_semmap", messages).at(1).objects,
      IsEmpty());
}

TEST_F(MapRecorderTest, AnEmptyGridIsNotShown) {
  Step({CreateLayer{Floor()}});
  EXPECT_THAT(TopicsAt(1, End()), UnorderedElementsAre("/tf_static", "/hypermap/markers"));
}

TEST_F(MapRecorderTest, TheChosenLayerIsTheMap) {
  LayerSpec annex = Floor();
  annex.name = "annex";
  Start({.occupancy_layer = "floor"});
  Step({CreateLayer{annex}, CreateLayer{Floor()}, Cell(0, 0, 1.0)});
  EXPECT_THAT(Decode<nav_msgs::OccupancyGrid>("/map", End()).at(0).data, ElementsAre(100));
}

}  // namespace
}  // namespace hypermap::ros2
