// Counts of input that was left out, by reason.
#ifndef HYPERMAP_INGEST_SOURCES_SKIP_COUNTS_H_
#define HYPERMAP_INGEST_SOURCES_SKIP_COUNTS_H_

#include <cstdint>
#include <map>
#include <string>

namespace hypermap::ingest {

// Number of skipped items for each reason.
using SkipCounts = std::map<std::string, int64_t>;

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_SOURCES_SKIP_COUNTS_H_
