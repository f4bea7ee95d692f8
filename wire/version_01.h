// Upgrades messages that version 0.1 stored.
//
// A map's file stores observations, and a robot's outbox stores requests, as the bytes that were
// sent. Version 0.1 had a message for each vertex of a ring (Ring.points, field 1), and all shapes
// were polygons (Object.polygon, field 5). The present contract does not know these fields: each
// function here moves unknown fields of that kind to their present place, and leaves present
// messages unchanged.
#ifndef HYPERMAP_WIRE_VERSION_01_H_
#define HYPERMAP_WIRE_VERSION_01_H_

#include "hypermap/v1/edit_service.pb.h"
#include "hypermap/v1/object.pb.h"
#include "hypermap/v1/observation.pb.h"

namespace hypermap::wire {

void UpgradeFrom01(v1::ApplyEditsRequest* message);
void UpgradeFrom01(v1::Object* message);
void UpgradeFrom01(v1::Observation* message);

// Does the opposite: serialized, the message has the bytes that version 0.1 made of the same
// observation.
void DowngradeTo01(v1::Observation* message);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_VERSION_01_H_
