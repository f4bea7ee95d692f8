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

// Returns "12 of 670 observations moved by 0.04 m (rms), with the walls of occupancy".
std::string SmoothingText(const client::SmoothingAnswer& smoothed);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_SUMMARY_OUTPUT_H_
