// Stored messages of version 0.1, brought forward.
//
// A map's file keeps observations, and a robot's outbox its requests, as the bytes that were sent.
// Version 0.1 had a message for each vertex of a ring (Ring.points, field 1) and polygons only
// (Object.polygon, field 5). Parsed with today's contract these fields are unknown ones; each
// function here moves them to where they belong and leaves a message of today as it is.
#ifndef HYPERMAP_WIRE_VERSION_01_H_
#define HYPERMAP_WIRE_VERSION_01_H_

#include "hypermap/v1/edit_service.pb.h"
#include "hypermap/v1/object.pb.h"
#include "hypermap/v1/observation.pb.h"

namespace hypermap::wire {

void UpgradeFrom01(v1::ApplyEditsRequest* message);
void UpgradeFrom01(v1::Object* message);
void UpgradeFrom01(v1::Observation* message);

// The opposite: serialized, the message has the bytes that version 0.1 made of the same
// observation.
void DowngradeTo01(v1::Observation* message);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_VERSION_01_H_
