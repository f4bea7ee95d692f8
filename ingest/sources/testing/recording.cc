#include "ingest/sources/testing/recording.h"

#include <gtest/gtest.h>

#include <utility>

#include "base/images/png.h"

namespace hypermap::ingest {

std::string GreyPng(int width, int height, const std::vector<uint16_t>& samples, int bits) {
  PngWriter writer =
      PngWriter::Begin({.width = width, .height = height, .bit_depth = bits}).value();
  std::vector<uint8_t> row;
  for (int v = 0; v < height; ++v) {
    row.clear();
    for (int u = 0; u < width; ++u) {
      const uint16_t sample = samples[static_cast<size_t>(v) * width + u];
      if (bits == 16) row.push_back(static_cast<uint8_t>(sample >> 8));
      row.push_back(static_cast<uint8_t>(sample));
    }
    EXPECT_TRUE(writer.WriteRow(row.data()).ok());
  }
  return std::move(writer).Finish().value();
}

}  // namespace hypermap::ingest
