#include "ingest/sources/depth_png.h"

#include <png.h>

#include <csetjmp>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace hypermap::ingest {
namespace {

[[noreturn]] void OnError(png_structp png, png_const_charp message) {
  static_cast<std::string*>(png_get_error_ptr(png))->assign(message);
  png_longjmp(png, 1);
}

void OnWarning(png_structp /*png*/, png_const_charp /*message*/) {}

// libpng reports errors by longjmp. Each method arms the jump anew and has no object with a
// destructor on its stack, so that nothing is jumped over.
class PngReader {
 public:
  explicit PngReader(absl::string_view data) : rest_(data) {
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, &error_, OnError, OnWarning);
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
  }
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  bool ReadHeader() {
    if (info_ == nullptr) return false;
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_set_read_fn(png_, this, Read);
    png_read_info(png_, info_);
    return true;
  }

  bool ReadImage(png_bytepp rows) {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_read_image(png_, rows);
    return true;
  }

  bool is_grey_16() const {
    return png_get_color_type(png_, info_) == PNG_COLOR_TYPE_GRAY &&
           png_get_bit_depth(png_, info_) == 16;
  }
  int64_t width() const { return png_get_image_width(png_, info_); }
  int64_t height() const { return png_get_image_height(png_, info_); }
  absl::Status error() const {
    return absl::InvalidArgumentError(
        absl::StrCat("broken PNG: ", error_.empty() ? "out of memory" : error_));
  }

 private:
  static void Read(png_structp png, png_bytep out, png_size_t n) {
    auto* self = static_cast<PngReader*>(png_get_io_ptr(png));
    if (self->rest_.size() < n) png_error(png, "it ends early");
    std::memcpy(out, self->rest_.data(), n);
    self->rest_.remove_prefix(n);
  }

  absl::string_view rest_;
  std::string error_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
};

}  // namespace

absl::StatusOr<DepthImage> DecodeDepthPng(absl::string_view data, int width, int height,
                                          double units_per_metre) {
  PngReader reader(data);
  if (!reader.ReadHeader()) return reader.error();
  if (!reader.is_grey_16()) {
    return absl::InvalidArgumentError("the depth image is no grey PNG of 16 bits");
  }
  if (reader.width() != width || reader.height() != height) {
    return absl::InvalidArgumentError(absl::StrCat("depth image of ", reader.width(), "x",
                                                   reader.height(), " for a camera of ", width, "x",
                                                   height));
  }
  const size_t row_bytes = static_cast<size_t>(width) * 2;
  std::vector<png_byte> bytes(row_bytes * height);
  std::vector<png_bytep> rows(height);
  for (int v = 0; v < height; ++v) rows[v] = bytes.data() + row_bytes * v;
  if (!reader.ReadImage(rows.data())) return reader.error();
  DepthImage image{width, height, {}};
  image.metres.resize(static_cast<size_t>(width) * height);
  const float metres_per_unit = static_cast<float>(1.0 / units_per_metre);
  for (size_t i = 0; i < image.metres.size(); ++i) {
    image.metres[i] = static_cast<float>(bytes[2 * i] << 8 | bytes[2 * i + 1]) * metres_per_unit;
  }
  return image;
}

}  // namespace hypermap::ingest
