// Semantic objects on the wire.
#ifndef HYPERMAP_WIRE_OBJECT_H_
#define HYPERMAP_WIRE_OBJECT_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "base/limits/limits.h"
#include "hypermap/v1/object.pb.h"
#include "map/frames/planar_transform.h"
#include "map/objects/semantic_object.h"

namespace hypermap::wire {

// Encodes the object with its shape and centroid in the caller's frame.
void EncodeObject(const SemanticObject& object, const PlanarTransform& caller_from_object,
                  v1::Object* message);

// Encodes what few objects have: classes, height, tags, attributes and expiry time.
void EncodeRareFields(const SemanticObject& object, v1::Object* message);

// Decodes an object of a request, which must have a shape. Ignores version and expire_time, since
// the map sets them. Does not check what Validate(SemanticObject) checks.
absl::StatusOr<SemanticObject> DecodeObject(absl::string_view field, const v1::Object& message,
                                            const Limits& limits);

// Decodes an object of an answer.
absl::StatusOr<SemanticObject> DecodeObject(absl::string_view field, const v1::Object& message);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_OBJECT_H_
