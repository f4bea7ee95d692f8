#include "base/images/png.h"

#include <png.h>

#include <csetjmp>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"

// libpng reports errors by longjmp. Each function that arms the jump does so anew and has no object
// with a destructor on its stack, so that nothing is jumped over.

namespace hypermap {
namespace {

constexpr png_alloc_size_t kMaxChunkBytes = 1 << 20;
constexpr int kMaxCachedChunks = 16;
constexpr int kFastLevel = 3;

[[noreturn]] void OnError(png_structp png, png_const_charp message) {
  static_cast<std::string*>(png_get_error_ptr(png))->assign(message);
  png_longjmp(png, 1);
}

void OnWarning(png_structp /*png*/, png_const_charp /*message*/) {}

void Append(png_structp png, png_bytep bytes, png_size_t n) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<char*>(bytes), n);
}

void Flush(png_structp /*png*/) {}

}  // namespace

struct PngReader::State {
  explicit State(absl::string_view data) : rest(data) {
    png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &error, OnError, OnWarning);
    if (png != nullptr) info = png_create_info_struct(png);
  }
  ~State() { png_destroy_read_struct(&png, &info, nullptr); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  static void Take(png_structp png, png_bytep out, png_size_t n) {
    auto* rest = static_cast<absl::string_view*>(png_get_io_ptr(png));
    if (rest->size() < n) png_error(png, "it ends early");
    std::memcpy(out, rest->data(), n);
    rest->remove_prefix(n);
  }

  // Each returns false on an error.
  bool ReadHeader(int64_t max_width, int64_t max_height) {
    if (info == nullptr) return false;
    if (setjmp(png_jmpbuf(png)) != 0) return false;
    png_set_read_fn(png, &rest, Take);
    png_set_user_limits(png, static_cast<png_uint_32>(max_width),
                        static_cast<png_uint_32>(max_height));
    png_set_chunk_cache_max(png, kMaxCachedChunks);
    png_set_chunk_malloc_max(png, kMaxChunkBytes);
    png_read_info(png, info);
    header.width = png_get_image_width(png, info);
    header.height = png_get_image_height(png, info);
    header.bit_depth = png_get_bit_depth(png, info);
    header.is_grey = png_get_color_type(png, info) == PNG_COLOR_TYPE_GRAY;
    return true;
  }
  bool Prepare(bool expand) {
    if (setjmp(png_jmpbuf(png)) != 0) return false;
    num_passes = png_set_interlace_handling(png);
    if (expand) {
      png_set_expand(png);
      png_set_strip_16(png);
    }
    png_read_update_info(png, info);
    is_prepared = true;
    return true;
  }
  bool ReadRow(png_bytep row) {
    if (setjmp(png_jmpbuf(png)) != 0) return false;
    png_read_row(png, row, nullptr);
    return true;
  }

  absl::Status Error() const {
    return absl::InvalidArgumentError(
        absl::StrCat("broken PNG: ", error.empty() ? "out of memory" : error));
  }

  absl::string_view rest;
  std::string error;
  png_structp png = nullptr;
  png_infop info = nullptr;
  PngHeader header;
  bool is_prepared = false;
  int num_passes = 1;
};

PngReader::PngReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
PngReader::PngReader(PngReader&&) noexcept = default;
PngReader& PngReader::operator=(PngReader&&) noexcept = default;
PngReader::~PngReader() = default;

absl::StatusOr<PngReader> PngReader::Open(absl::string_view data, int64_t max_width,
                                          int64_t max_height) {
  auto state = std::make_unique<State>(data);
  if (!state->ReadHeader(max_width, max_height)) return state->Error();
  return PngReader(std::move(state));
}

const PngHeader& PngReader::header() const { return state_->header; }
int PngReader::channels() const { return png_get_channels(state_->png, state_->info); }
int PngReader::num_passes() const { return state_->num_passes; }

int64_t PngReader::row_bytes() const {
  return static_cast<int64_t>(png_get_rowbytes(state_->png, state_->info));
}

absl::Status PngReader::ExpandTo8Bits() {
  return state_->Prepare(/*expand=*/true) ? absl::OkStatus() : state_->Error();
}

absl::Status PngReader::ReadRow(uint8_t* row) {
  if (!state_->is_prepared && !state_->Prepare(/*expand=*/false)) return state_->Error();
  return state_->ReadRow(row) ? absl::OkStatus() : state_->Error();
}

absl::Status PngReader::ReadRows(uint8_t* rows) {
  if (!state_->is_prepared && !state_->Prepare(/*expand=*/false)) return state_->Error();
  for (int pass = 0; pass < num_passes(); ++pass) {
    for (int64_t y = 0; y < header().height; ++y) {
      HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
      if (!state_->ReadRow(rows + row_bytes() * y)) return state_->Error();
    }
  }
  return absl::OkStatus();
}

struct PngWriter::State {
  State() {
    png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &error, OnError, OnWarning);
    if (png != nullptr) info = png_create_info_struct(png);
  }
  ~State() { png_destroy_write_struct(&png, &info); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  // Each returns false on an error.
  bool Begin(const PngFormat& format) {
    if (info == nullptr) return false;
    if (setjmp(png_jmpbuf(png)) != 0) return false;
    png_set_write_fn(png, &data, Append, Flush);
    png_set_IHDR(png, info, format.width, format.height, format.bit_depth,
                 format.has_alpha ? PNG_COLOR_TYPE_GRAY_ALPHA : PNG_COLOR_TYPE_GRAY,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    if (format.is_fast) {
      png_set_compression_level(png, kFastLevel);
      png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_UP);
    }
    png_write_info(png, info);
    return true;
  }
  bool WriteRow(png_const_bytep row) {
    if (setjmp(png_jmpbuf(png)) != 0) return false;
    png_write_row(png, row);
    return true;
  }
  bool Finish() {
    if (setjmp(png_jmpbuf(png)) != 0) return false;
    png_write_end(png, info);
    return true;
  }

  absl::Status Error() const {
    return absl::InternalError(
        absl::StrCat("writing a PNG: ", error.empty() ? "out of memory" : error));
  }

  std::string error;
  std::string data;
  png_structp png = nullptr;
  png_infop info = nullptr;
};

PngWriter::PngWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
PngWriter::PngWriter(PngWriter&&) noexcept = default;
PngWriter& PngWriter::operator=(PngWriter&&) noexcept = default;
PngWriter::~PngWriter() = default;

absl::StatusOr<PngWriter> PngWriter::Begin(const PngFormat& format) {
  auto state = std::make_unique<State>();
  if (!state->Begin(format)) return state->Error();
  return PngWriter(std::move(state));
}

absl::Status PngWriter::WriteRow(const uint8_t* row) {
  return state_->WriteRow(row) ? absl::OkStatus() : state_->Error();
}

absl::StatusOr<std::string> PngWriter::Finish() && {
  if (!state_->Finish()) return state_->Error();
  return std::move(state_->data);
}

}  // namespace hypermap
