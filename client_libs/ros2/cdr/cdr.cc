#include "client_libs/ros2/cdr/cdr.h"

namespace hypermap::ros2 {
namespace {

constexpr size_t kHeaderBytes = 4;

// The second byte of the encapsulation header (DDS-XTypes 1.3, table 60).
constexpr char kPlainBigEndian = 0;
constexpr char kPlainLittleEndian = 1;
constexpr char kPlain2BigEndian = 6;
constexpr char kPlain2LittleEndian = 7;

}  // namespace

CdrReader::CdrReader(absl::string_view payload) : left_(payload), status_(ReadHeader()) {
  if (!status_.ok()) left_ = {};
}

absl::Status CdrReader::ReadHeader() {
  if (left_.size() < kHeaderBytes) return absl::InvalidArgumentError("the message has no header");
  const char encoding = left_[1];
  const bool is_second = encoding == kPlain2BigEndian || encoding == kPlain2LittleEndian;
  const bool is_known = is_second || encoding == kPlainBigEndian || encoding == kPlainLittleEndian;
  if (left_[0] != 0 || !is_known) {
    return absl::InvalidArgumentError("the message is not in plain CDR");
  }
  if (is_second) max_alignment_ = 4;
  is_big_endian_ = encoding == kPlainBigEndian || encoding == kPlain2BigEndian;
  left_.remove_prefix(kHeaderBytes);
  return absl::OkStatus();
}

absl::string_view CdrReader::GetRaw(size_t size) {
  if (size > left_.size()) {
    Fail("the message is cut short");
    return {};
  }
  const absl::string_view bytes = left_.substr(0, size);
  left_.remove_prefix(size);
  position_ += size;
  return bytes;
}

void CdrReader::Get(std::string& text) {
  uint32_t size = 0;
  Get(size);
  const absl::string_view bytes = GetRaw(size);
  // The terminating NUL; a length of 0 is read as an empty string, as the middlewares do.
  text.assign(bytes.data(), bytes.empty() ? 0 : bytes.size() - 1);
}

void CdrReader::GetNumber(void* value, size_t size) {
  const size_t alignment = std::min(size, max_alignment_);
  GetRaw((alignment - position_ % alignment) % alignment);
  const absl::string_view bytes = GetRaw(size);
  if (bytes.empty()) {
    std::memset(value, 0, size);
    return;
  }
  auto* const raw = static_cast<char*>(value);
  std::memcpy(raw, bytes.data(), size);
  if (is_big_endian_) std::reverse(raw, raw + size);
}

void CdrReader::Fail(absl::string_view problem) {
  if (status_.ok()) status_ = absl::InvalidArgumentError(problem);
  left_ = {};
}

}  // namespace hypermap::ros2
