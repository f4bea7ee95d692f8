#include "server/services/part_source.h"

#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

#include "base/limits/limits.h"
#include "hypermap/v1/query_service.pb.h"
#include "map/layers/semantic_layer.h"

namespace hypermap::server {
namespace {

using Source = PartSource<v1::QueryAreaResponse>;

// A reader of the given parts.
class ListedParts : public PartReader {
 public:
  explicit ListedParts(std::vector<LayerAnswerPart> parts) : parts_(std::move(parts)) {}
  LayerAnswerPart Next(int) override { return parts_[next_++]; }
  bool done() const override { return next_ == parts_.size(); }

 private:
  const std::vector<LayerAnswerPart> parts_;
  size_t next_ = 0;
};

LayerPtr LayerNamed(const std::string& name) {
  LayerSpec spec;
  spec.name = name;
  spec.frame_id = "map";
  return std::make_shared<SemanticLayer>(spec);
}

LayerAnswerPart PartOf(const LayerPtr& layer, int num_objects, bool last) {
  LayerAnswerPart part;
  part.layer = layer;
  part.last = last;
  for (int i = 0; i < num_objects; ++i) {
    auto object = std::make_shared<SemanticObject>();
    object->label = "cup";
    object->shape = Polygon::FromBox({{0, 0}, {1, 1}});
    part.part.objects.push_back(std::move(object));
  }
  return part;
}

// The layer and the number of objects of each message that the parts become.
std::vector<std::pair<std::string, int>> Sent(std::vector<LayerAnswerPart> parts,
                                              int64_t max_chunk_bytes = 1 << 20) {
  Limits limits;
  limits.max_chunk_bytes = max_chunk_bytes;
  Source source(std::make_unique<ListedParts>(std::move(parts)), /*revision=*/7, /*incarnation=*/11,
                limits);
  std::vector<std::pair<std::string, int>> sent;
  while (true) {
    v1::QueryAreaResponse message;
    const auto step = source.Next(&message);
    EXPECT_TRUE(step.ok()) << step.status();
    if (*step == Source::Step::kEnd) return sent;
    if (*step == Source::Step::kNothingYet) continue;
    v1::QueryAreaResponse received;
    EXPECT_TRUE(received.ParseFromString(message.SerializeAsString()));
    EXPECT_EQ(received.revision(), 7);
    EXPECT_EQ(received.incarnation(), 11);
    sent.emplace_back(received.part().layer(), received.part().objects_size());
  }
}

using Messages = std::vector<std::pair<std::string, int>>;

TEST(PartSource, LayerWithoutMatchesIsOneEmptyPart) {
  const LayerPtr a = LayerNamed("a"), b = LayerNamed("b");
  EXPECT_EQ(
      Sent({PartOf(a, 0, false), PartOf(a, 0, false), PartOf(a, 0, true), PartOf(b, 0, true)}),
      (Messages{{"a", 0}, {"b", 0}}));
}

TEST(PartSource, WithoutLayersTheRevisionIsToldAlone) { EXPECT_EQ(Sent({}), (Messages{{"", 0}})); }

TEST(PartSource, EmptyPartsBesideMatchesAreLeftOut) {
  const LayerPtr a = LayerNamed("a"), b = LayerNamed("b");
  EXPECT_EQ(Sent({PartOf(a, 0, false), PartOf(a, 2, false), PartOf(a, 0, true), PartOf(b, 0, false),
                  PartOf(b, 1, true)}),
            (Messages{{"a", 2}, {"b", 1}}));
}

TEST(PartSource, LargePartIsSeveralMessages) {
  const LayerPtr a = LayerNamed("a"), b = LayerNamed("b");
  EXPECT_EQ(Sent({PartOf(a, 3, true), PartOf(b, 0, true)}, /*max_chunk_bytes=*/1),
            (Messages{{"a", 1}, {"a", 1}, {"a", 1}, {"b", 0}}));
}

TEST(PartSource, RefusalIsOneMessage) {
  LayerAnswerPart refusal = PartOf(LayerNamed("a"), 0, true);
  refusal.status = AnswerStatus::kNoTransform;
  EXPECT_EQ(Sent({refusal}), (Messages{{"a", 0}}));
}

}  // namespace
}  // namespace hypermap::server
