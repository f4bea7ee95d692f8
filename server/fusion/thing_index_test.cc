#include "server/fusion/thing_index.h"

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>

namespace hypermap::server {
namespace {

ObjectPtr Thing(const std::string& label, const Shape& shape) {
  auto object = std::make_shared<SemanticObject>();
  object->label = label;
  object->shape = shape;
  return object;
}

TEST(ThingIndexTest, FindsByLabelAndShape) {
  const Shape shapes[] = {Polygon::FromBox({{0, 0}, {2, 1}}),
                          *Polygon::Make({{0, 0}, {2, 0}, {2, 1}}),
                          *LineString::Make({{0, 0}, {2, 0}, {2, 1}}), *Shape::MakePoint({0, 0})};
  ThingIndex things;
  size_t number = 0;
  for (const Shape& shape : shapes) {
    for (const char* label : {"cup", "sofa"}) things.Add(Thing(label, shape), number++);
  }
  number = 0;
  for (const Shape& shape : shapes) {
    for (const char* label : {"cup", "sofa"}) {
      EXPECT_EQ(things.Find(*Thing(label, shape)), number++);
    }
    EXPECT_EQ(things.Find(*Thing("lamp", shape)), std::nullopt);
  }
  EXPECT_EQ(things.Find(*Thing("cup", *Shape::MakePoint({0, 1}))), std::nullopt);
  EXPECT_EQ(things.Find(*Thing("cup", *Shape::MakePoint({-0.0, 0}))), 6u);
}

TEST(ThingIndexTest, EqualThingsAreTakenInTheirOrder) {
  const Shape place = *Shape::MakePoint({3, 4});
  ThingIndex things;
  for (const size_t number : {5, 2, 8}) things.Add(Thing("cup", place), number);
  const ObjectPtr cup = Thing("cup", place);
  for (const size_t number : {5, 2, 8}) {
    EXPECT_EQ(things.Find(*cup), number);
    EXPECT_EQ(things.Take(*cup), number);
  }
  EXPECT_EQ(things.Find(*cup), std::nullopt);
  EXPECT_EQ(things.Take(*cup), std::nullopt);
}

}  // namespace
}  // namespace hypermap::server
