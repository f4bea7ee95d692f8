#include "storage/interchange/png_codec.h"

#include <png.h>

#include <algorithm>
#include <csetjmp>
#include <cstring>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::storage {
namespace {

// Deflate can't pack tighter than 1032:1 (zlib's technical notes); what claims to is not there.
constexpr int64_t kMaxDeflateRatio = 1032;
constexpr png_alloc_size_t kMaxChunkBytes = 1 << 20;

// libpng reports errors by longjmp. Each method of the two classes below arms the jump anew and has
// no object with a destructor on its stack, so that nothing is jumped over.

[[noreturn]] void OnError(png_structp png, png_const_charp message) {
  auto* error = static_cast<std::string*>(png_get_error_ptr(png));
  error->assign(message);
  png_longjmp(png, 1);
}

void OnWarning(png_structp /*png*/, png_const_charp /*message*/) {}

class PngReader {
 public:
  explicit PngReader(absl::string_view data) : rest_(data) {
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, &error_, OnError, OnWarning);
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
  }
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  // Reads up to the first pixel. false: see error().
  bool ReadHeader() {
    if (info_ == nullptr) return false;
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_set_read_fn(png_, this, Read);
    png_set_user_limits(png_, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    png_set_chunk_malloc_max(png_, kMaxChunkBytes);
    png_read_info(png_, info_);
    return true;
  }

  // Has rows delivered with 1 to 4 channels of 8 bits.
  bool Normalize() {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    num_passes_ = png_set_interlace_handling(png_);
    png_set_expand(png_);
    png_set_strip_16(png_);
    png_read_update_info(png_, info_);
    return true;
  }

  bool ReadRow(png_bytep row) {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_read_row(png_, row, nullptr);
    return true;
  }

  int64_t width() const { return png_get_image_width(png_, info_); }
  int64_t height() const { return png_get_image_height(png_, info_); }
  int channels() const { return png_get_channels(png_, info_); }
  int64_t row_bytes() const { return static_cast<int64_t>(png_get_rowbytes(png_, info_)); }
  int num_passes() const { return num_passes_; }

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
  int num_passes_ = 1;
};

GreyAlpha ToGreyAlpha(const png_byte* p, int channels) {
  const bool coloured = channels >= 3;
  const bool has_alpha = channels == 2 || channels == 4;
  const int grey = coloured ? (77 * p[0] + 150 * p[1] + 29 * p[2]) >> 8 : p[0];
  return {static_cast<uint8_t>(grey), has_alpha ? p[channels - 1] : uint8_t{255}};
}

void AppendRow(const png_byte* row, int channels, GreyAlphaImage& image) {
  for (int32_t x = 0; x < image.width; ++x) {
    image.pixels.push_back(ToGreyAlpha(row + int64_t{x} * channels, channels));
  }
}

// Rows come one after another, once.
bool ReadSequential(PngReader& reader, GreyAlphaImage& image) {
  std::vector<png_byte> row(reader.row_bytes());
  for (int32_t y = 0; y < image.height; ++y) {
    if (!reader.ReadRow(row.data())) return false;
    AppendRow(row.data(), reader.channels(), image);
  }
  return true;
}

// Each pass refines all rows.
bool ReadInterlaced(PngReader& reader, GreyAlphaImage& image) {
  std::vector<png_byte> rows(reader.row_bytes() * image.height);
  for (int pass = 0; pass < reader.num_passes(); ++pass) {
    for (int32_t y = 0; y < image.height; ++y) {
      if (!reader.ReadRow(rows.data() + reader.row_bytes() * y)) return false;
    }
  }
  for (int32_t y = 0; y < image.height; ++y) {
    AppendRow(rows.data() + reader.row_bytes() * y, reader.channels(), image);
  }
  return true;
}

}  // namespace

absl::StatusOr<GreyAlphaImage> DecodePng(absl::string_view data, int64_t max_pixels) {
  PngReader reader(data);
  if (!reader.ReadHeader()) return reader.error();
  HYPERMAP_RETURN_IF_ERROR(CheckImageSize(reader.width(), reader.height(), max_pixels));
  // Rows as they are packed in the file, before they are widened to 8 bits a sample.
  if (reader.row_bytes() * reader.height() / kMaxDeflateRatio > static_cast<int64_t>(data.size())) {
    return absl::InvalidArgumentError("broken PNG: it is too short for its dimensions");
  }
  if (!reader.Normalize()) return reader.error();
  GreyAlphaImage image{
      static_cast<int32_t>(reader.width()), static_cast<int32_t>(reader.height()), {}};
  image.pixels.reserve(reader.width() * reader.height());
  const bool complete =
      reader.num_passes() == 1 ? ReadSequential(reader, image) : ReadInterlaced(reader, image);
  if (!complete) return reader.error();
  return image;
}

namespace {

class PngWriter {
 public:
  PngWriter() {
    png_ = png_create_write_struct(PNG_LIBPNG_VER_STRING, &error_, OnError, OnWarning);
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
  }
  ~PngWriter() { png_destroy_write_struct(&png_, &info_); }
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;

  bool WriteHeader(int32_t width, int32_t height, int color_type) {
    if (info_ == nullptr) return false;
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_set_write_fn(png_, &data_, Append, Flush);
    png_set_IHDR(png_, info_, width, height, 8, color_type, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png_, info_);
    return true;
  }

  bool WriteRow(png_const_bytep row) {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_write_row(png_, row);
    return true;
  }

  bool Finish() {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_write_end(png_, info_);
    return true;
  }

  std::string& data() { return data_; }
  absl::Status error() const {
    return absl::InternalError(
        absl::StrCat("writing a PNG: ", error_.empty() ? "out of memory" : error_));
  }

 private:
  static void Append(png_structp png, png_bytep bytes, png_size_t n) {
    static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<char*>(bytes), n);
  }
  static void Flush(png_structp /*png*/) {}

  std::string error_;
  std::string data_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
};

}  // namespace

absl::StatusOr<std::string> EncodePng(const GreyAlphaImage& image, PngChannels channels) {
  const bool with_alpha = channels == PngChannels::kGreyAlpha;
  PngWriter writer;
  if (!writer.WriteHeader(image.width, image.height,
                          with_alpha ? PNG_COLOR_TYPE_GRAY_ALPHA : PNG_COLOR_TYPE_GRAY)) {
    return writer.error();
  }
  std::vector<png_byte> row;
  for (int32_t y = 0; y < image.height; ++y) {
    row.clear();
    for (int32_t x = 0; x < image.width; ++x) {
      const GreyAlpha& pixel = image.row(y)[x];
      row.push_back(pixel.grey);
      if (with_alpha) row.push_back(pixel.alpha);
    }
    if (!writer.WriteRow(row.data())) return writer.error();
  }
  if (!writer.Finish()) return writer.error();
  return std::move(writer.data());
}

}  // namespace hypermap::storage
