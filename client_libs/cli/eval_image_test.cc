#include "client_libs/cli/eval_image.h"

#include <cairo.h>
#include <gtest/gtest.h>

#include <memory>
#include <set>

namespace hypermap::cli {
namespace {

using evaluation::Evaluate;
using evaluation::Object;

struct Deleter {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
using Surface = std::unique_ptr<cairo_surface_t, Deleter>;

Surface Decode(std::string png) {
  const auto read = [](void* source, unsigned char* data, unsigned int size) {
    auto* rest = static_cast<std::string*>(source);
    if (rest->size() < size) return CAIRO_STATUS_READ_ERROR;
    rest->copy(reinterpret_cast<char*>(data), size);
    rest->erase(0, size);
    return CAIRO_STATUS_SUCCESS;
  };
  return Surface(cairo_image_surface_create_from_png_stream(read, &png));
}

// The colours of the plan, without the legend at its right.
std::set<uint32_t> ColoursOfThePlan(const std::vector<Object>& truth,
                                    const std::vector<Object>& map) {
  const auto png = DrawEvaluation(truth, map, Evaluate(truth, map));
  EXPECT_TRUE(png.ok()) << png.status();
  const Surface surface = Decode(*png);
  EXPECT_EQ(cairo_surface_status(surface.get()), CAIRO_STATUS_SUCCESS);
  const unsigned char* data = cairo_image_surface_get_data(surface.get());
  const int stride = cairo_image_surface_get_stride(surface.get());
  std::set<uint32_t> colours;
  for (int y = 0; y < cairo_image_surface_get_height(surface.get()) - 40; ++y) {
    for (int x = 0; x < cairo_image_surface_get_width(surface.get()) - 280; ++x) {
      colours.insert(reinterpret_cast<const uint32_t*>(data + y * stride)[x] & 0xFFFFFF);
    }
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
