#include <png.h>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/interchange/grey_alpha_image.h"
#include "storage/interchange/pgm.h"
#include "storage/interchange/png_codec.h"
#include "storage/interchange/testing/content.h"

namespace hypermap::storage {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr int64_t kManyPixels = 1 << 20;

std::vector<GreyAlpha> Pixels(const absl::StatusOr<GreyAlphaImage>& image) {
  EXPECT_TRUE(image.ok()) << image.status();
  return image.ok() ? image->pixels : std::vector<GreyAlpha>();
}

// A PNG of any kind by libpng itself; `rows` as they are packed.
struct PngRecipe {
  int width = 0;
  int bit_depth = 8;
  int color_type = PNG_COLOR_TYPE_GRAY;
  int interlace = PNG_INTERLACE_NONE;
  std::vector<png_color> palette;
  std::vector<png_byte> palette_alpha;
  double gamma = 0.0;
  std::vector<std::vector<png_byte>> rows;
};

void AppendTo(png_structp png, png_bytep bytes, png_size_t n) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<char*>(bytes), n);
}

std::string Bake(PngRecipe recipe) {
  std::string data;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(png, &data, AppendTo, nullptr);
  png_set_IHDR(png, info, recipe.width, recipe.rows.size(), recipe.bit_depth, recipe.color_type,
               recipe.interlace, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (!recipe.palette.empty()) {
    png_set_PLTE(png, info, recipe.palette.data(), recipe.palette.size());
  }
  if (!recipe.palette_alpha.empty()) {
    png_set_tRNS(png, info, recipe.palette_alpha.data(), recipe.palette_alpha.size(), nullptr);
  }
  if (recipe.gamma > 0.0) png_set_gAMA(png, info, recipe.gamma);
  std::vector<png_bytep> rows;
  for (auto& row : recipe.rows) rows.push_back(row.data());
  png_write_info(png, info);
  png_write_image(png, rows.data());
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return data;
}

TEST(PngTest, ComesBackAsWritten) {
  GreyAlphaImage image{3, 2, {{0, 255}, {1, 0}, {127, 0}, {254, 128}, {255, 255}, {205, 255}}};
  const absl::StatusOr<GreyAlphaImage> again =
      DecodePng(*EncodePng(image, PngChannels::kGreyAlpha), kManyPixels);
  EXPECT_EQ(Pixels(again), image.pixels);
  EXPECT_EQ(again->width, 3);
  EXPECT_EQ(again->height, 2);
  EXPECT_THAT(Pixels(DecodePng(*EncodePng({2, 1, {{7, 0}, {9, 255}}}, PngChannels::kGrey), 2)),
              ElementsAre(GreyAlpha{7, 255}, GreyAlpha{9, 255}));
}

TEST(PngTest, ColourBecomesGreyAsTheOriginalDoesIt) {
  const std::string rgb = Bake(
      {.width = 3, .color_type = PNG_COLOR_TYPE_RGB, .rows = {{255, 0, 0, 0, 255, 0, 9, 8, 7}}});
  EXPECT_THAT(Pixels(DecodePng(rgb, kManyPixels)),
              ElementsAre(GreyAlpha{(77 * 255) >> 8, 255}, GreyAlpha{(150 * 255) >> 8, 255},
                          GreyAlpha{(77 * 9 + 150 * 8 + 29 * 7) >> 8, 255}));
  const std::string rgba = Bake({.width = 2,
                                 .color_type = PNG_COLOR_TYPE_RGB_ALPHA,
                                 .rows = {{100, 100, 100, 255, 0, 0, 255, 3}}});
  EXPECT_THAT(Pixels(DecodePng(rgba, kManyPixels)),
              ElementsAre(GreyAlpha{100, 255}, GreyAlpha{(29 * 255) >> 8, 3}));
}

TEST(PngTest, PaletteWithTransparency) {
  const std::string png = Bake({.width = 4,
                                .bit_depth = 2,
                                .color_type = PNG_COLOR_TYPE_PALETTE,
                                .palette = {{0, 0, 0}, {255, 255, 255}, {10, 20, 30}},
                                .palette_alpha = {255, 0},
                                .rows = {{0b00011000}}});
  EXPECT_THAT(Pixels(DecodePng(png, kManyPixels)),
              ElementsAre(GreyAlpha{0, 255}, GreyAlpha{255, 0},
                          GreyAlpha{(77 * 10 + 150 * 20 + 29 * 30) >> 8, 255}, GreyAlpha{0, 255}));
}

TEST(PngTest, OneBitAndSixteenBits) {
  const std::string one = Bake({.width = 3, .bit_depth = 1, .rows = {{0b10100000}}});
  EXPECT_THAT(Pixels(DecodePng(one, kManyPixels)),
              ElementsAre(GreyAlpha{255, 255}, GreyAlpha{0, 255}, GreyAlpha{255, 255}));
  const std::string sixteen = Bake({.width = 2,
                                    .bit_depth = 16,
                                    .color_type = PNG_COLOR_TYPE_GRAY_ALPHA,
                                    .rows = {{0x12, 0xFF, 0xFF, 0xFF, 0xAB, 0x00, 0x7F, 0xFF}}});
  EXPECT_THAT(Pixels(DecodePng(sixteen, kManyPixels)),
              ElementsAre(GreyAlpha{0x12, 255}, GreyAlpha{0xAB, 0x7F}));
}

TEST(PngTest, GammaLeavesSamplesAlone) {
  const std::string png = Bake({.width = 3, .gamma = 1.0, .rows = {{10, 100, 200}}});
  EXPECT_THAT(Pixels(DecodePng(png, kManyPixels)),
              ElementsAre(GreyAlpha{10, 255}, GreyAlpha{100, 255}, GreyAlpha{200, 255}));
}

TEST(PngTest, InterlacedIsTheSameImage) {
  std::vector<std::vector<png_byte>> rows;
  for (int y = 0; y < 13; ++y) {
    rows.emplace_back();
    for (int x = 0; x < 11; ++x) rows.back().push_back(x * 20 + y);
  }
  const auto plain = Pixels(DecodePng(Bake({.width = 11, .rows = rows}), kManyPixels));
  const auto interlaced = Pixels(
      DecodePng(Bake({.width = 11, .interlace = PNG_INTERLACE_ADAM7, .rows = rows}), kManyPixels));
  EXPECT_EQ(interlaced, plain);
}

TEST(PngTest, EveryTruncationIsRefused) {
  GreyAlphaImage image{20, 20, std::vector<GreyAlpha>(400)};
  for (size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i].grey = i * 7;
  const std::string png = *EncodePng(image, PngChannels::kGreyAlpha);
  // The last 12 bytes are IEND and the 4 before them the checksum of the pixels.
  for (size_t size = 0; size + 16 < png.size(); ++size) {
    const absl::Status status = DecodeImage(png.substr(0, size), kManyPixels).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << size;
  }
}

TEST(PngTest, SizeIsCheckedBeforeMemoryIsTaken) {
  std::string png = *EncodePng({1, 1, {{0, 255}}}, PngChannels::kGrey);
  EXPECT_EQ(DecodePng(png, 0).status().code(), absl::StatusCode::kResourceExhausted);
  // 2^31 - 1 pixels a side; the header's checksum is of the true one.
  png.replace(16, 8, std::string("\x7F\xFF\xFF\xFF\x7F\xFF\xFF\xFF", 8));
  EXPECT_FALSE(DecodePng(png, kManyPixels).ok());
}

TEST(PngTest, DimensionsThatTheDataCanNotFillAreRefused) {
  // 10,000 x 10,000 pixels with a correct header and nothing behind it.
  PngRecipe recipe{.width = 10000, .rows = {std::vector<png_byte>(10000)}};
  recipe.rows.resize(10000, recipe.rows[0]);
  const std::string png = Bake(recipe).substr(0, 2000);
  const absl::Status status = DecodePng(png, 1 << 28).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("too short for its dimensions"));
}

TEST(PgmTest, ComesBackAsWritten) {
  const GreyAlphaImage image{2, 2, {{0, 255}, {10, 255}, {32, 255}, {255, 255}}};
  EXPECT_EQ(Pixels(DecodePgm(EncodePgm(image), 4)), image.pixels);
}

TEST(PgmTest, ReadsCommentsPlainAndSixteenBits) {
  EXPECT_THAT(Pixels(DecodePgm("P5 # made by hand\n#\n2 1 # size\n255\n\x07#", 2)),
              ElementsAre(GreyAlpha{7, 255}, GreyAlpha{'#', 255}));
  EXPECT_THAT(Pixels(DecodePgm("P2\n3 1\n4\n0 2\n4\n", 3)),
              ElementsAre(GreyAlpha{0, 255}, GreyAlpha{128, 255}, GreyAlpha{255, 255}));
  EXPECT_THAT(Pixels(DecodePgm(std::string("P5 2 1 65535\n\x80\x00\xFF\xFF", 17), 2)),
              ElementsAre(GreyAlpha{128, 255}, GreyAlpha{255, 255}));
}

TEST(PgmTest, RefusesBrokenOnes) {
  for (const char* data :
       {"P5", "P6\n1 1\n255\nxxx", "P5\n1 1\n255", "P5\n0 1\n255\n", "P5\n1 1\n0\nx",
        "P5\n1 1\n65536\nxx", "P5\n-1 1\n255\nx", "P5\n2 2\n255\nxxx", "P2\n2 1\n255\n1 x",
        "P2\n2 1\n255\n1 256", "P5\n99999999999999999999 1\n255\nx", "P5\n1000 1000\n255\n"}) {
    EXPECT_EQ(DecodePgm(data, kManyPixels).status().code(), absl::StatusCode::kInvalidArgument)
        << data;
  }
  EXPECT_EQ(DecodePgm("P5\n2000 2000\n255\n", kManyPixels).status().code(),
            absl::StatusCode::kResourceExhausted);
}

TEST(DecodeImageTest, TellsFormatsByTheirFirstBytes) {
  EXPECT_TRUE(DecodeImage("P5\n1 1\n255\nx", 1).ok());
  EXPECT_EQ(DecodeImage("GIF89a", 1).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(DecodeImage("", 1).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace hypermap::storage
