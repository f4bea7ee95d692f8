// Formats the report of an exploration by simulated robots, as text or JSON.
#ifndef HYPERMAP_INGEST_WORKER_EXPEDITION_OUTPUT_H_
#define HYPERMAP_INGEST_WORKER_EXPEDITION_OUTPUT_H_

#include <string>

#include "simulation/robots/expedition.h"

namespace hypermap::ingest {

// Returns one JSON document on one line.
std::string ReportJson(const robots::ExpeditionReport& report,
                       const robots::ExpeditionOptions& options);

// Returns a few lines of text.
std::string ReportText(const robots::ExpeditionReport& report,
                       const robots::ExpeditionOptions& options);

// Returns GeoJSON with the path of each robot as a LineString, in the map's own frame. The path of
// a robot that never moved is its position twice, because a LineString has at least two points.
std::string WaysGeoJson(const robots::ExpeditionReport& report);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_EXPEDITION_OUTPUT_H_
