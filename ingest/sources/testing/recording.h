// Files of small recorded drives, for tests.
#ifndef HYPERMAP_INGEST_SOURCES_TESTING_RECORDING_H_
#define HYPERMAP_INGEST_SOURCES_TESTING_RECORDING_H_

#include <cstdint>
#include <string>
#include <vector>

namespace hypermap::ingest {

// Returns a grey PNG with `bits` (8 or 16) per sample. `samples` is row-major.
std::string GreyPng(int width, int height, const std::vector<uint16_t>& samples, int bits = 16);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_SOURCES_TESTING_RECORDING_H_
