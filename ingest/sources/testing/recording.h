// Small recorded drives that tests write.
#ifndef HYPERMAP_INGEST_SOURCES_TESTING_RECORDING_H_
#define HYPERMAP_INGEST_SOURCES_TESTING_RECORDING_H_

#include <cstdint>
#include <string>
#include <vector>

namespace hypermap::ingest {

// A grey PNG of 16 or 8 bits.
std::string GreyPng(int width, int height, const std::vector<uint16_t>& samples, int bits = 16);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_SOURCES_TESTING_RECORDING_H_
