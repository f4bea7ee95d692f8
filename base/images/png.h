// Reads and writes PNG images, row by row. The one place that knows libpng.
#ifndef HYPERMAP_BASE_IMAGES_PNG_H_
#define HYPERMAP_BASE_IMAGES_PNG_H_

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace hypermap {

// The header of an image as it is in the file.
struct PngHeader {
  int64_t width = 0;
  int64_t height = 0;
  int bit_depth = 0;     // of a sample: 1, 2, 4, 8 or 16
  bool is_grey = false;  // one channel without alpha
};

// Decodes one image. Images are not trusted: errors are INVALID_ARGUMENT ("broken PNG: ..."), after
// which the reader is of no more use. Takes memory for a row, whatever the header claims. One
// thread.
class PngReader {
 public:
  // `data` must outlive the reader. Reads the header. Larger images than the maximum are refused.
  static absl::StatusOr<PngReader> Open(absl::string_view data, int64_t max_width = kMaxSide,
                                        int64_t max_height = kMaxSide);
  PngReader(PngReader&&) noexcept;
  PngReader& operator=(PngReader&&) noexcept;
  ~PngReader();

  const PngHeader& header() const;

  // Has rows delivered as 1 (grey), 2 (grey, alpha), 3 (red, green, blue) or 4 channels of 8 bits.
  // Without it rows are as in the file, samples of 16 bits with the high byte first. Before the
  // first row only.
  absl::Status ExpandTo8Bits();

  int channels() const;
  int64_t row_bytes() const;

  // An interlaced image is delivered in passes over all rows, each of which refines `row`, which
  // must have the content that the pass before gave it.
  int num_passes() const;
  // Reads the next row, from the top; `row` has row_bytes().
  absl::Status ReadRow(uint8_t* row);
  // Reads all passes of all rows; `rows` has row_bytes() * height bytes.
  absl::Status ReadRows(uint8_t* rows);

 private:
  static constexpr int64_t kMaxSide = 0x7fffffff;
  struct State;

  explicit PngReader(std::unique_ptr<State> state);

  std::unique_ptr<State> state_;
};

struct PngFormat {
  int32_t width = 0;
  int32_t height = 0;
  int bit_depth = 8;  // of a sample: 8 or 16, the high byte first
  bool has_alpha = false;
  // Packs faster and little worse where neighbouring rows are alike, as in maps.
  bool is_fast = false;
};

// Encodes a grey image. INTERNAL for what libpng refuses, after which the writer is of no more use.
// One thread. Used as: Begin, WriteRow for each row from the top, Finish.
class PngWriter {
 public:
  static absl::StatusOr<PngWriter> Begin(const PngFormat& format);
  PngWriter(PngWriter&&) noexcept;
  PngWriter& operator=(PngWriter&&) noexcept;
  ~PngWriter();

  absl::Status WriteRow(const uint8_t* row);
  absl::StatusOr<std::string> Finish() &&;

 private:
  struct State;

  explicit PngWriter(std::unique_ptr<State> state);

  std::unique_ptr<State> state_;
};

}  // namespace hypermap

#endif  // HYPERMAP_BASE_IMAGES_PNG_H_
