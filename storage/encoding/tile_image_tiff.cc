#include <tiffio.h>

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <memory>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "storage/encoding/tile_image.h"

namespace hypermap::storage {
namespace {

constexpr tmsize_t kMaxAllocation = 1 << 20;

// A file in memory as libtiff sees it. Reads `input` or writes `output`.
struct MemoryFile {
  absl::string_view input;
  std::string output;
  bool writing = false;
  uint64_t position = 0;
  std::string error;  // the first

  uint64_t size() const { return writing ? output.size() : input.size(); }
};

tmsize_t ReadFile(thandle_t handle, void* buffer, tmsize_t size) {
  auto* file = static_cast<MemoryFile*>(handle);
  const absl::string_view data = file->writing ? absl::string_view(file->output) : file->input;
  if (size < 0 || file->position >= data.size()) return 0;
  const size_t count = std::min<uint64_t>(size, data.size() - file->position);
  std::memcpy(buffer, data.data() + file->position, count);
  file->position += count;
  return static_cast<tmsize_t>(count);
}

tmsize_t WriteFile(thandle_t handle, void* buffer, tmsize_t size) {
  auto* file = static_cast<MemoryFile*>(handle);
  if (!file->writing || size < 0) return -1;
  const uint64_t end = file->position + size;
  if (end > file->output.size()) file->output.resize(end);
  std::memcpy(file->output.data() + file->position, buffer, size);
  file->position = end;
  return size;
}

toff_t SeekFile(thandle_t handle, toff_t offset, int whence) {
  auto* file = static_cast<MemoryFile*>(handle);
  if (whence == SEEK_CUR) offset += file->position;
  if (whence == SEEK_END) offset += file->size();
  file->position = offset;
  return offset;
}

int CloseFile(thandle_t) { return 0; }
toff_t FileSize(thandle_t handle) { return static_cast<MemoryFile*>(handle)->size(); }

int KeepError(TIFF*, void* user_data, const char*, const char* format, va_list arguments) {
  auto* file = static_cast<MemoryFile*>(user_data);
  char message[128];
  std::vsnprintf(message, sizeof(message), format, arguments);
  if (file->error.empty()) file->error = message;
  return 1;
}

int IgnoreWarning(TIFF*, void*, const char*, const char*, va_list) { return 1; }

struct CloseTiff {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};
struct FreeOptions {
  void operator()(TIFFOpenOptions* options) const { TIFFOpenOptionsFree(options); }
};
using TiffPtr = std::unique_ptr<TIFF, CloseTiff>;

// The handlers are per file: libtiff's global ones would print to stderr.
TiffPtr OpenTiff(MemoryFile* file) {
  const std::unique_ptr<TIFFOpenOptions, FreeOptions> options(TIFFOpenOptionsAlloc());
  if (options == nullptr) return nullptr;
  TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), kMaxAllocation);
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), KeepError, file);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), IgnoreWarning, nullptr);
  // Little-endian classic TIFF; read without memory mapping.
  return TiffPtr(TIFFClientOpenExt("tile", file->writing ? "wl" : "rm", file, ReadFile, WriteFile,
                                   SeekFile, CloseFile, FileSize, nullptr, nullptr, options.get()));
}

bool IsTileImage(TIFF* tiff) {
  uint32_t width = 0;
  uint32_t height = 0;
  uint16_t bits = 0;
  uint16_t samples = 0;
  uint16_t format = 0;
  uint16_t compression = 0;
  TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &width);
  TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &height);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &bits);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &samples);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLEFORMAT, &format);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_COMPRESSION, &compression);
  return width == kTileSide && height == kTileSide && bits == 32 && samples == 1 &&
         format == SAMPLEFORMAT_IEEEFP &&
         (compression == COMPRESSION_NONE || compression == COMPRESSION_LZW) &&
         TIFFIsTiled(tiff) == 0 && TIFFScanlineSize(tiff) == kTileSide * tmsize_t{sizeof(float)};
}

}  // namespace

absl::StatusOr<std::string> EncodeTiff(const TileImage<float>& image) {
  MemoryFile file;
  file.writing = true;
  TiffPtr tiff = OpenTiff(&file);
  if (tiff == nullptr) return absl::InternalError(absl::StrCat("cannot write TIFF: ", file.error));
  TIFFSetField(tiff.get(), TIFFTAG_IMAGEWIDTH, kTileSide);
  TIFFSetField(tiff.get(), TIFFTAG_IMAGELENGTH, kTileSide);
  TIFFSetField(tiff.get(), TIFFTAG_ROWSPERSTRIP, kTileSide);
  TIFFSetField(tiff.get(), TIFFTAG_BITSPERSAMPLE, 32);
  TIFFSetField(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, 1);
  TIFFSetField(tiff.get(), TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
  TIFFSetField(tiff.get(), TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  TIFFSetField(tiff.get(), TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  TIFFSetField(tiff.get(), TIFFTAG_COMPRESSION, COMPRESSION_LZW);
  // libtiff may swap bytes in the buffer it is given.
  TileImage<float> pixels = image;
  const bool written = TIFFWriteEncodedStrip(tiff.get(), 0, pixels.data(), sizeof(pixels)) >= 0 &&
                       TIFFFlush(tiff.get()) == 1;
  tiff.reset();
  if (!written) return absl::InternalError(absl::StrCat("cannot write TIFF: ", file.error));
  return std::move(file.output);
}

absl::Status DecodeTiff(absl::string_view data, TileImage<float>* image) {
  MemoryFile file;
  file.input = data;
  const TiffPtr tiff = OpenTiff(&file);
  if (tiff == nullptr) return absl::DataLossError(absl::StrCat("TIFF: ", file.error));
  if (!IsTileImage(tiff.get())) {
    return absl::DataLossError("TIFF: not a 32-bit float image of a tile's size");
  }
  for (uint32_t row = 0; row < kTileSide; ++row) {
    if (TIFFReadScanline(tiff.get(), image->data() + row * kTileSide, row, 0) != 1) {
      return absl::DataLossError(absl::StrCat("TIFF: ", file.error));
    }
  }
  return absl::OkStatus();
}

}  // namespace hypermap::storage
