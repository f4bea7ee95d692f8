#include "ingest/sources/testing/recording.h"

#include <png.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace hypermap::ingest {

namespace fs = std::filesystem;

std::string GreyPng(int width, int height, const std::vector<uint16_t>& samples, int bits) {
  std::string data;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(
      png, &data,
      [](png_structp p, png_bytep bytes, png_size_t n) {
        static_cast<std::string*>(png_get_io_ptr(p))->append(reinterpret_cast<char*>(bytes), n);
      },
      nullptr);
  png_set_IHDR(png, info, width, height, bits, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  std::vector<png_byte> row;
  for (int v = 0; v < height; ++v) {
    row.clear();
    for (int u = 0; u < width; ++u) {
      const uint16_t sample = samples[static_cast<size_t>(v) * width + u];
      if (bits == 16) row.push_back(static_cast<png_byte>(sample >> 8));
      row.push_back(static_cast<png_byte>(sample));
    }
    png_write_row(png, row.data());
  }
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return data;
}

}  // namespace hypermap::ingest
