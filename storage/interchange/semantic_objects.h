// Converts the semantic entries of the original's files to objects, and back.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_SEMANTIC_OBJECTS_H_
#define HYPERMAP_STORAGE_INTERCHANGE_SEMANTIC_OBJECTS_H_

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "base/limits/limits.h"
#include "map/objects/semantic_object.h"
#include "storage/interchange/repair_log.h"
#include "storage/interchange/semantic_yaml.h"
#include "storage/interchange/shape_repair.h"

namespace hypermap::storage {

// Counts that all layers of an import share.
struct ImportTotals {
  int64_t crossings_left = kMaxCrossingsPerImport;  // see RepairShape
  // Entries, and parts of their shapes after the first one of each.
  int64_t num_objects = 0;
};

// Reads the entries of one layer, in their order. Each repair is reported by a line that names the
// layer and the object by its id in the original, which counts from 1. Not thread safe.
class SemanticObjectReader {
 public:
  // `totals` and `repairs` are shared by the whole import. They and `limits` must outlive the
  // reader.
  SemanticObjectReader(std::string layer, const Limits& limits, ImportTotals& totals,
                       RepairLog& repairs);

  // INVALID_ARGUMENT naming the object when its words are not valid, or its shape is not a polygon
  // or can't be repaired; RESOURCE_EXHAUSTED; errors of CheckCancelled.
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

  // Adds a line of these pieces about the entry being read.
  template <typename... Pieces>
  void Report(const Pieces&... pieces);
  std::string Place() const;
  absl::Status TakeEntry(const SemanticEntry& entry);
  // Returns an object with the entry's label and tags.
  absl::StatusOr<SemanticObject> Describe(const SemanticEntry& entry);
  absl::StatusOr<std::vector<std::string>> CleanTags(const std::vector<std::string>& tags);
  void SetClasses(const SemanticEntry& entry, SemanticObject& object);
  // Keeps `object` with the shape of each part of the entry's shape.
  absl::Status KeepParts(const SemanticEntry& entry, SemanticObject object);
  absl::Status CountObject();
  // Keeps the object unless an earlier one has the same label, tags and shape.
  void Keep(SemanticObject object);

  const std::string layer_;
  const Limits& limits_;
  ImportTotals& totals_;
  RepairLog& repairs_;
  int64_t num_entries_ = 0;
  std::string label_;  // of the entry being read, cut so that it fits into messages
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
