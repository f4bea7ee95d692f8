// Formats the summary of a replay, as text or JSON.
#ifndef HYPERMAP_INGEST_WORKER_SUMMARY_OUTPUT_H_
#define HYPERMAP_INGEST_WORKER_SUMMARY_OUTPUT_H_

#include <string>

#include "ingest/worker/replay.h"

namespace hypermap::ingest {

// Returns one JSON document: map, layer, revision, counts of frames by outcome, and counts of
// skipped items by reason.
std::string SummaryJson(const ReplaySummary& summary, const TargetLayer& target);

// Returns a few lines of text.
std::string SummaryText(const ReplaySummary& summary, const TargetLayer& target);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_SUMMARY_OUTPUT_H_
