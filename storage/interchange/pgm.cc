#include "storage/interchange/pgm.h"

#include <optional>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"

namespace hypermap::storage {
namespace {

constexpr int kMaxMaxval = 65535;
// Number of pixels after which loops look whether they are cancelled.
constexpr int64_t kPixelsPerLook = 1 << 16;

// Reads the decimals of a PGM, with blanks and comments between them.
class PgmScanner {
 public:
  explicit PgmScanner(absl::string_view rest) : rest_(rest) {}

  // The next number; nullopt when there is none or it is above `max`.
  std::optional<int64_t> Number(int64_t max) {
    SkipBlanksAndComments();
    if (rest_.empty() || !absl::ascii_isdigit(rest_.front())) return std::nullopt;
    int64_t value = 0;
    while (!rest_.empty() && absl::ascii_isdigit(rest_.front())) {
      value = value * 10 + (rest_.front() - '0');
      if (value > max) return std::nullopt;
      rest_.remove_prefix(1);
    }
    return value;
  }

  // Takes the one blank that ends the header.
  bool EndHeader() {
    if (rest_.empty() || !absl::ascii_isspace(rest_.front())) return false;
    rest_.remove_prefix(1);
    return true;
  }

  absl::string_view rest() const { return rest_; }

 private:
  void SkipBlanksAndComments() {
    while (!rest_.empty()) {
      if (rest_.front() == '#') {
        const size_t end = rest_.find('\n');
        rest_.remove_prefix(end == absl::string_view::npos ? rest_.size() : end);
      } else if (absl::ascii_isspace(rest_.front())) {
        rest_.remove_prefix(1);
      } else {
        return;
      }
    }
  }

  absl::string_view rest_;
};

GreyAlpha Scaled(int64_t sample, int64_t maxval) {
  const int64_t clipped = sample > maxval ? maxval : sample;
  return {static_cast<uint8_t>((clipped * 255 + maxval / 2) / maxval), 255};
}

absl::Status ReadBinary(absl::string_view samples, int64_t maxval, int64_t num_pixels,
                        GreyAlphaImage& image) {
  const int64_t bytes_per_sample = maxval > 255 ? 2 : 1;
  if (static_cast<int64_t>(samples.size()) < num_pixels * bytes_per_sample) {
    return absl::InvalidArgumentError("PGM is shorter than its header says");
  }
  image.pixels.reserve(num_pixels);
  const auto byte = [&](int64_t i) { return int64_t{static_cast<uint8_t>(samples[i])}; };
  for (int64_t i = 0; i < num_pixels; ++i) {
    if (i % kPixelsPerLook == 0) HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    const int64_t sample = bytes_per_sample == 1 ? byte(i) : byte(2 * i) << 8 | byte(2 * i + 1);
    image.pixels.push_back(Scaled(sample, maxval));
  }
  return absl::OkStatus();
}

absl::Status ReadPlain(PgmScanner& scanner, int64_t maxval, int64_t num_pixels,
                       GreyAlphaImage& image) {
  // A sample takes two characters at least; a header that claims more gets no memory for it.
  if (static_cast<int64_t>(scanner.rest().size()) < 2 * num_pixels - 1) {
    return absl::InvalidArgumentError("PGM is shorter than its header says");
  }
  image.pixels.reserve(num_pixels);
  for (int64_t i = 0; i < num_pixels; ++i) {
    if (i % kPixelsPerLook == 0) HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    const std::optional<int64_t> sample = scanner.Number(maxval);
    if (!sample) return absl::InvalidArgumentError(absl::StrCat("PGM sample ", i, " is no number"));
    image.pixels.push_back(Scaled(*sample, maxval));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<GreyAlphaImage> DecodePgm(absl::string_view data, int64_t max_pixels) {
  if (data.size() < 2 || data[0] != 'P' || (data[1] != '5' && data[1] != '2')) {
    return absl::InvalidArgumentError("no PGM");
  }
  PgmScanner scanner(data.substr(2));
  const std::optional<int64_t> width = scanner.Number(INT32_MAX);
  const std::optional<int64_t> height = scanner.Number(INT32_MAX);
  const std::optional<int64_t> maxval = scanner.Number(kMaxMaxval);
  if (!width || !height || !maxval || *maxval == 0 || !scanner.EndHeader()) {
    return absl::InvalidArgumentError("PGM header is broken");
  }
  HYPERMAP_RETURN_IF_ERROR(CheckImageSize(*width, *height, max_pixels));
  HYPERMAP_RETURN_IF_ERROR(TakeMemory(static_cast<int64_t>(sizeof(GreyAlpha)) * *width * *height));
  GreyAlphaImage image{static_cast<int32_t>(*width), static_cast<int32_t>(*height), {}};
  const int64_t num_pixels = *width * *height;
  HYPERMAP_RETURN_IF_ERROR(data[1] == '5' ? ReadBinary(scanner.rest(), *maxval, num_pixels, image)
                                          : ReadPlain(scanner, *maxval, num_pixels, image));
  return image;
}

std::string EncodePgm(const GreyAlphaImage& image) {
  std::string data = absl::StrCat("P5\n", image.width, " ", image.height, "\n255\n");
  data.reserve(data.size() + image.pixels.size());
  for (const GreyAlpha& pixel : image.pixels) data.push_back(static_cast<char>(pixel.grey));
  return data;
}

}  // namespace hypermap::storage
