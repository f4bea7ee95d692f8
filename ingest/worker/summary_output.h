// What a replay did, for people or as JSON.
#ifndef HYPERMAP_INGEST_WORKER_SUMMARY_OUTPUT_H_
#define HYPERMAP_INGEST_WORKER_SUMMARY_OUTPUT_H_

#include <string>

#include "ingest/worker/replay.h"

namespace hypermap::ingest {

// One document: map, layer, revision, counts of frames by outcome, and what was skipped by reason.
std::string SummaryJson(const ReplaySummary& summary, const TargetLayer& target);

// A few lines.
std::string SummaryText(const ReplaySummary& summary, const TargetLayer& target);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_SUMMARY_OUTPUT_H_
