// Converts the semantic entries of the original's files to objects, and back.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_SEMANTIC_OBJECTS_H_
#define HYPERMAP_STORAGE_INTERCHANGE_SEMANTIC_OBJECTS_H_

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "map/objects/semantic_object.h"
#include "storage/interchange/repair_log.h"
#include "storage/interchange/semantic_yaml.h"

namespace hypermap::storage {

// Reads the entries of one layer, in their order. Each repair is reported by a line that names the
// layer and the object by its id in the original, which counts from 1. Not thread safe.
class SemanticObjectReader {
 public:
  // `crossings_left` (see RepairShape) and `repairs` are shared by the whole import and must
  // outlive the reader.
  SemanticObjectReader(std::string layer, int max_vertices, int64_t& crossings_left,
                       RepairLog& repairs);

  // INVALID_ARGUMENT naming the object when its shape is not a polygon or can't be repaired;
  // RESOURCE_EXHAUSTED.
  absl::Status Take(const SemanticEntry& entry);

  // Returns the objects of all entries, without ids. An entry gives one object, or one for each
  // part of its shape. It gives none when the shape has no area or when it repeats an earlier
  // entry.
  std::vector<SemanticObject> Finish() &&;

 private:
  // The entry that an object comes from, and the entries that repeat it.
  struct Origin {
    int64_t number = 0;
    std::vector<int64_t> repeated_by;
  };

  void Report(absl::string_view what);
  absl::Status Named(const absl::Status& status) const;
  SemanticObject Describe(const SemanticEntry& entry);
  std::vector<std::string> CleanTags(const std::vector<std::string>& tags);
  void SetClasses(const SemanticEntry& entry, SemanticObject& object);
  absl::StatusOr<std::vector<Polygon>> ReadPolygons(const SemanticEntry& entry);
  // Keeps the object unless an earlier one has the same label, tags and shape.
  void Keep(SemanticObject object);

  const std::string layer_;
  const int max_vertices_;
  int64_t& crossings_left_;
  RepairLog& repairs_;
  int64_t num_entries_ = 0;
  std::string label_;  // of the entry being read
  std::vector<SemanticObject> objects_;
  std::vector<Origin> origins_;  // of `objects_`, one each
  absl::flat_hash_map<size_t, std::vector<size_t>> objects_by_hash_;
};

// Converts an object to an entry with its label, shape and tags, and with confidences when each tag
// is one of its classes. REQUIRES: the shape is a polygon.
SemanticEntry ToSemanticEntry(const SemanticObject& object);

// The parts of an object that its entry does not carry.
struct LostInEntry {
  bool classes = false;
  bool existence = false;
  bool height = false;
  bool attributes = false;
};
LostInEntry LostBy(const SemanticObject& object);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_SEMANTIC_OBJECTS_H_
