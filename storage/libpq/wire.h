// Types and numbers of PostgreSQL's binary format. Only for the sources of this room.
#ifndef HYPERMAP_STORAGE_LIBPQ_WIRE_H_
#define HYPERMAP_STORAGE_LIBPQ_WIRE_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>

namespace hypermap::storage::postgres {

// The object ids of the types that values are sent or read as. They are the same in every database
// (src/include/catalog/pg_type.dat of PostgreSQL).
enum TypeId : uint32_t {
  kBool = 16,
  kBytea = 17,
  kName = 19,
  kInt8 = 20,
  kInt2 = 21,
  kInt4 = 23,
  kText = 25,
  kJson = 114,
  kFloat4 = 700,
  kFloat8 = 701,
  kByteaArray = 1001,
  kTextArray = 1009,
  kInt8Array = 1016,
  kFloat8Array = 1022,
  kBpchar = 1042,
  kVarchar = 1043,
};

// Numbers are sent with their most significant byte first.
template <typename T>
void AppendBigEndian(T value, std::string* out) {
  const auto bits = static_cast<std::make_unsigned_t<T>>(value);
  for (int shift = 8 * (static_cast<int>(sizeof(T)) - 1); shift >= 0; shift -= 8) {
    out->push_back(static_cast<char>(bits >> shift));
  }
}

template <typename T>
T LoadBigEndian(const char* bytes) {
  std::make_unsigned_t<T> bits = 0;
  for (size_t i = 0; i < sizeof(T); ++i) {
    bits = static_cast<std::make_unsigned_t<T>>(bits << 8 | static_cast<unsigned char>(bytes[i]));
  }
  return static_cast<T>(bits);
}

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_LIBPQ_WIRE_H_
