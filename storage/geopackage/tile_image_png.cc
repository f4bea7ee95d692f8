#include <png.h>

#include <cstring>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "storage/geopackage/tile_image.h"

// libpng reports errors by longjmp. What is alive across a setjmp here is trivial or lives in the
// caller's frame, so that no destructor is skipped.

namespace hypermap::storage {
namespace {

constexpr int kBitDepth = 16;

struct Failure {
  char message[128] = "";
};

[[noreturn]] void OnError(png_structp png, png_const_charp message) {
  auto* failure = static_cast<Failure*>(png_get_error_ptr(png));
  std::strncpy(failure->message, message, sizeof(failure->message) - 1);
  png_longjmp(png, 1);
}

void OnWarning(png_structp, png_const_charp) {}

void Append(png_structp png, png_bytep bytes, size_t size) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<char*>(bytes), size);
}

void Take(png_structp png, png_bytep bytes, size_t size) {
  auto* rest = static_cast<absl::string_view*>(png_get_io_ptr(png));
  if (rest->size() < size) png_error(png, "the image is cut short");
  std::memcpy(bytes, rest->data(), size);
  rest->remove_prefix(size);
}

// PNG has the high byte first.
void ToBytes(const TileImage<uint16_t>& image, png_byte* bytes) {
  for (const uint16_t pixel : image) {
    *bytes++ = static_cast<png_byte>(pixel >> 8);
    *bytes++ = static_cast<png_byte>(pixel);
  }
}

constexpr size_t kRowBytes = kTileSide * kBitDepth / 8;
using ImageBytes = std::array<png_byte, kRowBytes * kTileSide>;

bool Write(png_structp png, png_infop info, png_bytepp rows) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_IHDR(png, info, kTileSide, kTileSide, kBitDepth, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  // Maps are mostly runs of equal cells: fast settings lose little.
  png_set_compression_level(png, 3);
  png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_UP);
  png_write_info(png, info);
  png_write_image(png, rows);
  png_write_end(png, nullptr);
  return true;
}

bool Read(png_structp png, png_infop info, png_bytepp rows) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_user_limits(png, kTileSide, kTileSide);
  png_set_chunk_cache_max(png, 16);
  png_set_chunk_malloc_max(png, 1 << 20);
  png_read_info(png, info);
  if (png_get_image_width(png, info) != kTileSide || png_get_image_height(png, info) != kTileSide ||
      png_get_bit_depth(png, info) != kBitDepth ||
      png_get_color_type(png, info) != PNG_COLOR_TYPE_GRAY) {
    png_error(png, "not a 16-bit grey image of a tile's size");
  }
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
  png_read_image(png, rows);
  png_read_end(png, nullptr);
  return true;
}

std::array<png_bytep, kTileSide> RowsOf(ImageBytes* bytes) {
  std::array<png_bytep, kTileSide> rows;
  for (int i = 0; i < kTileSide; ++i) rows[i] = bytes->data() + i * kRowBytes;
  return rows;
}

}  // namespace

absl::StatusOr<std::string> EncodePng(const TileImage<uint16_t>& image) {
  ImageBytes bytes;
  ToBytes(image, bytes.data());
  std::array<png_bytep, kTileSide> rows = RowsOf(&bytes);
  std::string data;
  Failure failure;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &failure, OnError, OnWarning);
  png_infop info = png == nullptr ? nullptr : png_create_info_struct(png);
  bool written = false;
  if (info != nullptr) {
    png_set_write_fn(png, &data, Append, nullptr);
    written = Write(png, info, rows.data());
  }
  png_destroy_write_struct(&png, &info);
  if (!written) return absl::InternalError(absl::StrCat("cannot write PNG: ", failure.message));
  return data;
}

absl::Status DecodePng(absl::string_view data, TileImage<uint16_t>* image) {
  ImageBytes bytes{};
  std::array<png_bytep, kTileSide> rows = RowsOf(&bytes);
  Failure failure;
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &failure, OnError, OnWarning);
  png_infop info = png == nullptr ? nullptr : png_create_info_struct(png);
  bool read = false;
  if (info != nullptr) {
    png_set_read_fn(png, &data, Take);
    read = Read(png, info, rows.data());
  }
  png_destroy_read_struct(&png, &info, nullptr);
  if (!read) return absl::DataLossError(absl::StrCat("PNG: ", failure.message));
  for (size_t i = 0; i < image->size(); ++i) {
    (*image)[i] = static_cast<uint16_t>(bytes[2 * i] << 8 | bytes[2 * i + 1]);
  }
  return absl::OkStatus();
}

}  // namespace hypermap::storage
