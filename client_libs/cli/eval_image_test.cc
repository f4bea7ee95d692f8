#include "client_libs/cli/eval_image.h"

#include <gtest/gtest.h>

#include <set>

#include "client_libs/cli/testing/image.h"

namespace hypermap::cli {
namespace {

using evaluation::Evaluate;
using evaluation::Object;

// The colours of the plan, without the legend on its right.
std::set<uint32_t> ColoursOfThePlan(const std::vector<Object>& truth,
                                    const std::vector<Object>& map) {
  const auto png = DrawEvaluation(truth, map, Evaluate(truth, map));
  EXPECT_TRUE(png.ok()) << png.status();
  const Pixels pixels(*png);
  std::set<uint32_t> colours;
  for (int y = 0; y < pixels.height() - 40; ++y) {
    for (int x = 0; x < pixels.width() - 280; ++x) colours.insert(pixels.At(x, y));
  }
  return colours;
}

bool HasRed(const std::set<uint32_t>& colours) { return colours.contains(0xD90000); }
bool HasBlue(const std::set<uint32_t>& colours) {
  for (const uint32_t c : colours) {
    if ((c >> 16) < 0x40 && (c & 0xFF) > 0xC0) return true;
  }
  return false;
}

Object Square(const std::string& label, double x, double y) {
  return {label, Polygon::FromBox({{x, y}, {x + 1, y + 1}}), 1.0};
}

TEST(EvalImageTest, MarksWhatHasNoPair) {
  const std::vector<Object> chair{Square("chair", 0, 0)};
  const std::vector<Object> far{Square("chair", 5, 0)};
  const std::set<uint32_t> matched = ColoursOfThePlan(chair, chair);
  EXPECT_FALSE(HasRed(matched));
  EXPECT_FALSE(HasBlue(matched));
  EXPECT_GT(matched.size(), 2u);
  const std::set<uint32_t> apart = ColoursOfThePlan(chair, far);
  EXPECT_TRUE(HasRed(apart));
  EXPECT_TRUE(HasBlue(apart));
}

TEST(EvalImageTest, OfNothingIsAPicture) { EXPECT_FALSE(ColoursOfThePlan({}, {}).empty()); }

}  // namespace
}  // namespace hypermap::cli
