// Decodes the pictures that commands write, for tests.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_TESTING_IMAGE_H_
#define HYPERMAP_CLIENT_LIBS_CLI_TESTING_IMAGE_H_

#include <cairo.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>

#include "client_libs/cli/canvas.h"

namespace hypermap::cli {

// The 0xRRGGBB that cairo paints for an opaque colour: it cuts channels of 16 bits down to 8.
inline uint32_t RgbOf(const Colour& c) {
  const auto channel = [](double level) {
    return static_cast<uint32_t>(std::min(level * 0x10000, 65535.0)) >> 8;
  };
  return channel(c.red) << 16 | channel(c.green) << 8 | channel(c.blue);
}

// The pixels of a PNG.
class Pixels {
 public:
  explicit Pixels(std::string png) {
    const auto read = [](void* source, unsigned char* data, unsigned int size) {
      auto* rest = static_cast<std::string*>(source);
      if (rest->size() < size) return CAIRO_STATUS_READ_ERROR;
      rest->copy(reinterpret_cast<char*>(data), size);
      rest->erase(0, size);
      return CAIRO_STATUS_SUCCESS;
    };
    surface_.reset(cairo_image_surface_create_from_png_stream(read, &png));
    EXPECT_EQ(cairo_surface_status(surface_.get()), CAIRO_STATUS_SUCCESS);
  }

  int width() const { return cairo_image_surface_get_width(surface_.get()); }
  int height() const { return cairo_image_surface_get_height(surface_.get()); }
  // 0xRRGGBB.
  uint32_t At(int x, int y) const {
    const unsigned char* data = cairo_image_surface_get_data(surface_.get());
    const int stride = cairo_image_surface_get_stride(surface_.get());
    return reinterpret_cast<const uint32_t*>(data + y * stride)[x] & 0xFFFFFF;
  }

 private:
  struct Deleter {
    void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  };
  std::unique_ptr<cairo_surface_t, Deleter> surface_;
};

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_TESTING_IMAGE_H_
