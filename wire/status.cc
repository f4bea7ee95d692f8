#include "wire/status.h"

#include <string>

#include "absl/strings/str_cat.h"

namespace hypermap::wire {
namespace {

// Messages travel in a header, and clients refuse headers of more than 8 KiB with an error of their
// own. Bytes that are not ASCII take three times their size there.
constexpr size_t kMaxMessageBytes = 2000;

std::string Shortened(absl::string_view message) {
  if (message.size() <= kMaxMessageBytes) return std::string(message);
  size_t size = kMaxMessageBytes;
  const auto continues_a_character = [](char byte) { return (byte & 0xC0) == 0x80; };
  while (size > 0 && continues_a_character(message[size])) --size;
  return absl::StrCat(message.substr(0, size), "... (", message.size(), " bytes)");
}

}  // namespace

// Both enumerations have the canonical codes 0 to 16 with the same numbers.
grpc::Status EncodeStatus(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  return {static_cast<grpc::StatusCode>(status.raw_code()), Shortened(status.message())};
}

absl::Status DecodeStatus(const grpc::Status& status) {
  if (status.ok()) return absl::OkStatus();
  return {static_cast<absl::StatusCode>(status.error_code()), status.error_message()};
}

}  // namespace hypermap::wire
