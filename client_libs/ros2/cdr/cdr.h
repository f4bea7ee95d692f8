// Common Data Representation, the encoding of messages in ROS 2.
//
// Plain CDR of version 1 (XCDR1, OMG DDS-XTypes 1.3, clause 7.4.1), little-endian, after the four
// bytes of its encapsulation header, which is what every ROS 2 middleware writes by default:
// numbers are aligned to their size, counted from the end of the header; a string has its length
// with the terminating NUL, a sequence the number of its elements. The reader also takes big-endian
// payloads, and plain CDR of version 2, in which no number is aligned to more than four bytes.
//
// A message is a struct whose static function Tie returns its fields in order:
//
//   struct Time {
//     int32_t sec = 0;
//     uint32_t nanosec = 0;
//     template <typename M>
//     static auto Tie(M& m) { return std::tie(m.sec, m.nanosec); }
//   };
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_CDR_CDR_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_CDR_CDR_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace hypermap::ros2 {

template <typename T>
inline constexpr bool kIsCdrNumber = std::is_arithmetic_v<T>;

class CdrWriter {
 public:
  CdrWriter() : bytes_("\x00\x01\x00\x00", kHeaderBytes) {}

  // Appends the bytes as they are, which must be a multiple of eight: a header before a message.
  void PutRaw(absl::string_view bytes) { bytes_.append(bytes.data(), bytes.size()); }

  template <typename T>
  void Put(const T& value) {
    if constexpr (kIsCdrNumber<T>) {
      PutNumber(value);
    } else {
      std::apply([this](const auto&... fields) { (this->Put(fields), ...); }, T::Tie(value));
    }
  }
  void Put(const std::string& text) {
    Put(static_cast<uint32_t>(text.size() + 1));
    bytes_.append(text.c_str(), text.size() + 1);
  }
  template <typename T>
  void Put(const std::vector<T>& sequence) {
    Put(static_cast<uint32_t>(sequence.size()));
    PutElements(sequence);
  }
  template <typename T, size_t n>
  void Put(const std::array<T, n>& array) {
    PutElements(array);
  }

  std::string Finish() && { return std::move(bytes_); }

 private:
  static constexpr size_t kHeaderBytes = 4;

  template <typename T>
  void PutNumber(T value) {
    bytes_.resize(kHeaderBytes +
                  (bytes_.size() - kHeaderBytes + sizeof(T) - 1) / sizeof(T) * sizeof(T));
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));  // All machines of the project are little-endian.
    bytes_.append(raw, sizeof(T));
  }
  template <typename Elements>
  void PutElements(const Elements& elements) {
    using T = typename Elements::value_type;
    if constexpr (kIsCdrNumber<T> && sizeof(T) == 1) {
      bytes_.append(reinterpret_cast<const char*>(elements.data()), elements.size());
    } else {
      for (const T& element : elements) Put(element);
    }
  }

  std::string bytes_;
};

// Reads what a CdrWriter has written, or a stranger. After an error all values are zero or empty.
class CdrReader {
 public:
  // `payload` must outlive this.
  explicit CdrReader(absl::string_view payload);

  // Returns the next bytes as they are.
  absl::string_view GetRaw(size_t size);

  template <typename T>
  void Get(T& value) {
    if constexpr (kIsCdrNumber<T>) {
      GetNumber(&value, sizeof(T));
    } else {
      std::apply([this](auto&... fields) { (this->Get(fields), ...); }, T::Tie(value));
    }
  }
  void Get(std::string& text);
  template <typename T>
  void Get(std::vector<T>& sequence) {
    uint32_t size = 0;
    Get(size);
    sequence.clear();
    // Every element takes at least a byte: a false size allocates nothing.
    if (size > left_.size()) return Fail("a sequence is longer than the message");
    if constexpr (kIsCdrNumber<T> && sizeof(T) == 1 && !std::is_same_v<T, bool>) {
      const absl::string_view bytes = GetRaw(size);
      sequence.assign(bytes.begin(), bytes.end());
    } else {
      // One by one: an element may take far more memory than bytes.
      for (uint32_t i = 0; i < size && status_.ok(); ++i) Get(sequence.emplace_back());
    }
  }
  template <typename T, size_t n>
  void Get(std::array<T, n>& array) {
    for (T& element : array) Get(element);
  }

  // INVALID_ARGUMENT if the message ended too early, or is not CDR.
  const absl::Status& status() const { return status_; }
  // The bytes that were not read.
  size_t num_left() const { return left_.size(); }

 private:
  absl::Status ReadHeader();
  void GetNumber(void* value, size_t size);
  void Fail(absl::string_view problem);

  absl::string_view left_;
  size_t position_ = 0;  // Since the end of the header.
  size_t max_alignment_ = 8;
  bool is_big_endian_ = false;
  absl::Status status_;
};

// Returns the payload of a message, with its encapsulation header.
template <typename Message>
std::string EncodeCdr(const Message& message) {
  CdrWriter writer;
  writer.Put(message);
  return std::move(writer).Finish();
}

// INVALID_ARGUMENT for bytes that are no such message. Up to three bytes may follow it, with which
// some programs fill the last word.
template <typename Message>
absl::StatusOr<Message> DecodeCdr(absl::string_view payload) {
  CdrReader reader(payload);
  Message message;
  reader.Get(message);
  if (!reader.status().ok()) return reader.status();
  if (reader.num_left() > 3) return absl::InvalidArgumentError("the message is too long");
  return message;
}

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_CDR_CDR_H_
