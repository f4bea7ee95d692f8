// Why things were left out.
#ifndef HYPERMAP_INGEST_SOURCES_SKIP_COUNTS_H_
#define HYPERMAP_INGEST_SOURCES_SKIP_COUNTS_H_

#include <cstdint>
#include <map>
#include <string>

namespace hypermap::ingest {

// Reason -> how many.
using SkipCounts = std::map<std::string, int64_t>;

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_SOURCES_SKIP_COUNTS_H_
