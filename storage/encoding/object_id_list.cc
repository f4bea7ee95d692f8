#include "storage/encoding/object_id_list.h"

#include <cstdint>

#include "absl/status/status.h"

namespace hypermap::storage {
namespace {

// Small differences of either sign become small numbers: 0, -1, 1, -2, ... -> 0, 1, 2, 3, ...
uint64_t ZigZag(uint64_t difference) { return difference << 1 ^ -(difference >> 63); }
uint64_t UnZigZag(uint64_t value) { return value >> 1 ^ -(value & 1); }

}  // namespace

std::string EncodeObjectIds(const std::vector<ObjectId>& ids) {
  std::string bytes;
  uint64_t previous = 0;
  for (const ObjectId id : ids) {
    // Unsigned, so that no difference overflows.
    const auto current = static_cast<uint64_t>(id);
    uint64_t rest = ZigZag(current - previous);
    for (; rest >= 0x80; rest >>= 7) bytes.push_back(static_cast<char>(rest | 0x80));
    bytes.push_back(static_cast<char>(rest));
    previous = current;
  }
  return bytes;
}

absl::StatusOr<std::vector<ObjectId>> DecodeObjectIds(absl::string_view bytes) {
  std::vector<ObjectId> ids;
  uint64_t previous = 0;
  uint64_t value = 0;
  int shift = 0;
  for (const char c : bytes) {
    const auto byte = static_cast<uint8_t>(c);
    if (shift > 63) return absl::DataLossError("object_ids: a number of more than 64 bits");
    value |= static_cast<uint64_t>(byte & 0x7f) << shift;
    shift += 7;
    if ((byte & 0x80) != 0) continue;
    previous += UnZigZag(value);
    ids.push_back(static_cast<ObjectId>(previous));
    value = 0;
    shift = 0;
  }
  if (shift != 0) return absl::DataLossError("object_ids: the list is cut short");
  return ids;
}

}  // namespace hypermap::storage
