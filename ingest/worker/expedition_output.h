// What robots that explored have done, for people or as JSON.
#ifndef HYPERMAP_INGEST_WORKER_EXPEDITION_OUTPUT_H_
#define HYPERMAP_INGEST_WORKER_EXPEDITION_OUTPUT_H_

#include <string>

#include "simulation/robots/expedition.h"

namespace hypermap::ingest {

// One document on one line.
std::string ReportJson(const robots::ExpeditionReport& report,
                       const robots::ExpeditionOptions& options);

// A few lines.
std::string ReportText(const robots::ExpeditionReport& report,
                       const robots::ExpeditionOptions& options);

// GeoJSON: a LineString for each robot, in the map's own frame. Of a robot that stayed where it
// was, its place twice.
std::string WaysGeoJson(const robots::ExpeditionReport& report);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_EXPEDITION_OUTPUT_H_
