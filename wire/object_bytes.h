// Semantic objects as bytes of the wire. Making a message of an object, of its shape and of each
// ring, takes longer than finding the objects of a small area.
#ifndef HYPERMAP_WIRE_OBJECT_BYTES_H_
#define HYPERMAP_WIRE_OBJECT_BYTES_H_

#include <cstddef>
#include <cstdint>
#include <string>

#include "google/protobuf/unknown_field_set.h"
#include "map/frames/planar_transform.h"
#include "map/objects/semantic_object.h"

namespace hypermap::wire {

// About the number of these bytes, found without encoding the object.
int64_t EstimateObjectBytes(const SemanticObject& object);

// Returns bytes that parse as the v1::Object that EncodeObject makes.
std::string ObjectBytes(const SemanticObject& object, const PlanarTransform& caller_from_object);

// Adds an object to the unknown fields of a message whose field `number` is of type v1::Object. The
// object becomes visible in that field when the message has been serialized and parsed again.
// Returns the number of bytes.
size_t AddObjectBytes(const SemanticObject& object, const PlanarTransform& caller_from_object,
                      int number, google::protobuf::UnknownFieldSet* fields);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_OBJECT_BYTES_H_
