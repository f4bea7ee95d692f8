// The columns of an object that are JSON text: classes {"label": confidence}, tags ["word"] and
// attributes {"name": bool, integer, number or string}.
//
// A number with a fraction or an exponent is a double, any other number an integer. Doubles are
// read back exactly.
#ifndef HYPERMAP_STORAGE_ENCODING_OBJECT_JSON_H_
#define HYPERMAP_STORAGE_ENCODING_OBJECT_JSON_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/objects/semantic_object.h"

namespace hypermap::storage {

using Classes = ClassScores;
using Tags = std::vector<std::string>;

// INVALID_ARGUMENT for text that is not UTF-8 and for numbers that are not finite.
absl::StatusOr<std::string> EncodeClasses(const Classes& classes);
absl::StatusOr<std::string> EncodeTags(const Tags& tags);
absl::StatusOr<std::string> EncodeAttributes(const Attributes& attributes);

// DATA_LOSS for text that Encode would not have made.
absl::StatusOr<Classes> DecodeClasses(absl::string_view json);
absl::StatusOr<Tags> DecodeTags(absl::string_view json);
absl::StatusOr<Attributes> DecodeAttributes(absl::string_view json);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_ENCODING_OBJECT_JSON_H_
