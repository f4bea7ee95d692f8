#include "storage/sqlite/revision_witness.h"

#include <zlib.h>

#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace hypermap::storage {
namespace {

// The record, little-endian: magic (8 bytes), version (4), flags (4), incarnation (8), revision
// (8), commit time in ns (8), CRC-32 of all that is before it (4).
constexpr absl::string_view kWitnessMagic = "HMWITNES";
constexpr uint32_t kVersion = 1;
constexpr uint32_t kSettled = 1;
constexpr size_t kSizeToCheck = 40;
constexpr size_t kSize = kSizeToCheck + 4;

template <typename T>
void Append(std::string* bytes, T value) {
  for (size_t i = 0; i < sizeof(T); ++i) {
    bytes->push_back(static_cast<char>((static_cast<uint64_t>(value) >> (8 * i)) & 0xff));
  }
}

template <typename T>
T Take(absl::string_view* bytes) {
  uint64_t value = 0;
  for (size_t i = 0; i < sizeof(T); ++i) {
    value |= uint64_t{static_cast<unsigned char>((*bytes)[i])} << (8 * i);
  }
  bytes->remove_prefix(sizeof(T));
  return static_cast<T>(value);
}

uint32_t ChecksumOf(absl::string_view bytes) {
  return static_cast<uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

}  // namespace

std::string EncodeWitness(const RevisionWitness& witness) {
  std::string bytes(kWitnessMagic);
  Append<uint32_t>(&bytes, kVersion);
  Append<uint32_t>(&bytes, witness.settled ? kSettled : 0);
  Append<uint64_t>(&bytes, witness.incarnation);
  Append<int64_t>(&bytes, witness.revision);
  Append<int64_t>(&bytes, witness.time_ns);
  Append<uint32_t>(&bytes, ChecksumOf(bytes));
  return bytes;
}

std::optional<RevisionWitness> DecodeWitness(absl::string_view bytes) {
  if (bytes.size() < kSize || !absl::StartsWith(bytes, kWitnessMagic)) return std::nullopt;
  const uint32_t checksum = ChecksumOf(bytes.substr(0, kSizeToCheck));
  bytes.remove_prefix(kWitnessMagic.size());
  if (Take<uint32_t>(&bytes) != kVersion) return std::nullopt;
  const auto flags = Take<uint32_t>(&bytes);
  RevisionWitness witness;
  witness.settled = (flags & kSettled) != 0;
  witness.incarnation = Take<uint64_t>(&bytes);
  witness.revision = Take<int64_t>(&bytes);
  witness.time_ns = Take<int64_t>(&bytes);
  if (Take<uint32_t>(&bytes) != checksum || witness.incarnation == 0) return std::nullopt;
  return witness;
}

absl::StatusOr<std::optional<RevisionWitness>> ReadWitness(const FileLock& lock) {
  const absl::StatusOr<std::string> bytes = lock.Read(kSize);
  if (bytes.ok()) return DecodeWitness(*bytes);
  return absl::UnavailableError(
      absl::StrCat("the record of the newest revision: ", bytes.status().message()));
}

}  // namespace hypermap::storage
