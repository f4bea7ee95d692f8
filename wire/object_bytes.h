// Objects of answers, written straight to bytes.
#ifndef HYPERMAP_WIRE_OBJECT_BYTES_H_
#define HYPERMAP_WIRE_OBJECT_BYTES_H_

#include <google/protobuf/message.h>

#include <string>

#include "absl/strings/string_view.h"
#include "map/frames/planar_transform.h"
#include "map/layers/semantic_object.h"

namespace hypermap::wire {

// Appends what the message of EncodeObject is serialised to, but for the order of its fields. An
// answer is mostly vertices. As messages of their own they are made, measured and written one by
// one, which takes longer than to find the objects; here a vertex is two doubles that are copied.
void AppendObject(const SemanticObject& object, const PlanarTransform& caller_from_object,
                  std::string* bytes);

// Appends the fields of a v1::NearestMatch with an object of a semantic layer.
void AppendMatch(absl::string_view layer, double distance_m, const SemanticObject& object,
                 const PlanarTransform& caller_from_object, std::string* bytes);

// The content of one more field of a message, to be filled with the bytes of its value. It is
// written with the message, so whoever receives it finds a field like others; who holds the message
// before does not.
std::string* AddField(int field, google::protobuf::Message* message);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_OBJECT_BYTES_H_
