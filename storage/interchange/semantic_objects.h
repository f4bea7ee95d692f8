// Objects of the domain from the original's semantic entries, and back.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_SEMANTIC_OBJECTS_H_
#define HYPERMAP_STORAGE_INTERCHANGE_SEMANTIC_OBJECTS_H_

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "map/layers/semantic_object.h"
#include "storage/interchange/repair_log.h"
#include "storage/interchange/semantic_yaml.h"

namespace hypermap::storage {

// Takes the entries of one layer in order and tells of each oddity in `repairs`, naming the layer
// and the object (counted from 1, which is its id in the original). One thread.
class SemanticObjectReader {
 public:
  // `crossings_left` (see RepairShape) and `repairs` are the import's and must outlive the reader.
  SemanticObjectReader(std::string layer, int max_vertices_per_polygon, int64_t& crossings_left,
                       RepairLog& repairs);

  // INVALID_ARGUMENT naming the object when its shape can't be understood; RESOURCE_EXHAUSTED.
  absl::Status Take(const SemanticEntry& entry);

  // The objects of all entries, without ids. An entry gives one object, or one for each part of its
  // shape, or none when the shape has no area; what repeats an earlier entry gives none.
  std::vector<SemanticObject> Finish() &&;

 private:
  // Where an object came from, and which entries repeat it.
  struct Origin {
    int64_t number = 0;
    std::vector<int64_t> repeated_by;
  };

  void Report(absl::string_view what);
  absl::Status Named(const absl::Status& status) const;
  SemanticObject Describe(const SemanticEntry& entry);
  std::vector<std::string> CleanTags(const std::vector<std::string>& tags);
  void SetClasses(const SemanticEntry& entry, SemanticObject& object);
  absl::StatusOr<std::vector<Polygon>> ReadShape(const SemanticEntry& entry);
  // Keeps the object, or notes that an earlier one is the same in label, tags and shape.
  void Keep(SemanticObject object);

  const std::string layer_;
  const int max_vertices_per_polygon_;
  int64_t& crossings_left_;
  RepairLog& repairs_;
  int64_t num_entries_ = 0;
  std::string label_;  // of the entry being read
  std::vector<SemanticObject> objects_;
  std::vector<Origin> origins_;  // of `objects_`, one each
  absl::flat_hash_map<size_t, std::vector<size_t>> objects_by_hash_;
};

// The entry that an object becomes: its tags, with confidences when each tag is one of its classes.
SemanticEntry ToSemanticEntry(const SemanticObject& object);

// What of an object the entry does not say.
struct LostInEntry {
  bool classes = false;
  bool existence = false;
  bool height = false;
  bool attributes = false;
};
LostInEntry LostBy(const SemanticObject& object);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_SEMANTIC_OBJECTS_H_
