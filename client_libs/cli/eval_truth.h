// Reads the ground truth that a map is evaluated against.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_EVAL_TRUTH_H_
#define HYPERMAP_CLIENT_LIBS_CLI_EVAL_TRUTH_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "map/evaluation/evaluate.h"
#include "map/objects/semantic_object.h"
#include "map/values/value_aliases.h"

namespace hypermap::cli {

// Objects and the frame of their shapes; empty: the map's own.
struct PlacedObjects {
  std::string frame_id;
  std::vector<SemanticObject> objects;
};

// Returns the objects in a GeoJSON file, or in the semantic layer `layer` of an .hmap file (empty:
// its only one). INVALID_ARGUMENT if the file is neither; NOT_FOUND if there is no such file or
// layer.
absl::StatusOr<PlacedObjects> ReadTruth(const std::string& path, const std::string& layer);

// Returns whether a true object is evaluated. It is not if its attribute "detectable" is false, or
// if its attribute "visible_frames" is smaller than `min_visible_frames`. An object without these
// attributes is.
bool Counts(const SemanticObject& object, int min_visible_frames);

// Converts an object for the evaluation. A label that is an alias of exactly one label is replaced
// by that label. REQUIRES: the shape is a polygon, because objects are compared by the areas that
// they cover.
evaluation::Object ToEvaluate(const SemanticObject& object, const ValueAliases& aliases);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_EVAL_TRUTH_H_
