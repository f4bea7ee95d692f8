#include "storage/interchange/semantic_objects.h"

#include <algorithm>
#include <set>

#include "absl/hash/hash.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "storage/interchange/names.h"
#include "storage/interchange/number_text.h"
#include "storage/interchange/shape_repair.h"
#include "storage/interchange/status_context.h"
#include "storage/interchange/wkt.h"

namespace hypermap::storage {
namespace {

constexpr char kUnnamed[] = "unnamed";

bool AllDistinct(const std::vector<std::string>& words) {
  return std::set<std::string>(words.begin(), words.end()).size() == words.size();
}

// REQUIRES: the shape is a polygon.
size_t HashOf(const SemanticObject& object) {
  size_t hash = absl::HashOf(object.label, object.tags);
  for (const Ring& ring : object.shape.polygon().rings()) {
    for (const Point& p : ring) hash = absl::HashOf(hash, p.x, p.y);
  }
  return hash;
}

}  // namespace

SemanticObjectReader::SemanticObjectReader(std::string layer, int max_vertices,
                                           int64_t& crossings_left, RepairLog& repairs)
    : layer_(std::move(layer)),
      max_vertices_(max_vertices),
      crossings_left_(crossings_left),
      repairs_(repairs) {}

void SemanticObjectReader::Report(absl::string_view what) {
  repairs_.Add(absl::StrCat(layer_, " object ", num_entries_, " (", label_, "): ", what));
}

absl::Status SemanticObjectReader::Named(const absl::Status& status) const {
  return At(absl::StrCat(layer_, " object ", num_entries_, " (", label_, ")"), status);
}

absl::Status SemanticObjectReader::Take(const SemanticEntry& entry) {
  ++num_entries_;
  SemanticObject description = Describe(entry);
  if (auto status = Validate(description); !status.ok()) return Named(status);
  absl::StatusOr<std::vector<Polygon>> polygons = ReadPolygons(entry);
  if (!polygons.ok()) return Named(polygons.status());
  for (Polygon& polygon : *polygons) {
    description.shape = std::move(polygon);
    if (auto status = TakeMemory(ByteSize(description)); !status.ok()) return Named(status);
    Keep(description);
  }
  return absl::OkStatus();
}

SemanticObject SemanticObjectReader::Describe(const SemanticEntry& entry) {
  SemanticObject object;
  const std::string name = entry.name.value_or("");
  label_ = CleanWord(name);
  if (label_.empty()) {
    label_ = kUnnamed;
    Report("no name");
  } else if (label_ != name) {
    Report("blanks in the name made one, none at its ends");
  }
  object.label = label_;
  if (entry.tags) object.tags = CleanTags(*entry.tags);
  SetClasses(entry, object);
  return object;
}

std::vector<std::string> SemanticObjectReader::CleanTags(const std::vector<std::string>& tags) {
  std::vector<std::string> clean;
  clean.reserve(tags.size());
  for (const std::string& tag : tags) {
    std::string word = CleanWord(tag);
    if (word.empty()) {
      Report("a tag without a name made \"unnamed\"");
      word = kUnnamed;
    } else if (word != tag) {
      Report(absl::StrCat("blanks in the tag \"", word, "\" made one, none at its ends"));
    }
    clean.push_back(std::move(word));
  }
  return clean;
}

void SemanticObjectReader::SetClasses(const SemanticEntry& entry, SemanticObject& object) {
  const std::vector<double> confidences = entry.confidence.value_or(std::vector<double>());
  const size_t num_pairs = std::min(object.tags.size(), confidences.size());
  if (entry.confidence && object.tags.size() != confidences.size()) {
    Report(absl::StrCat(object.tags.size(), " tags but ", confidences.size(),
                        " confidences: the first ", num_pairs, " of both are taken as pairs"));
  }
  const std::vector<std::string> tags(object.tags.begin(), object.tags.begin() + num_pairs);
  if (!AllDistinct(tags)) {
    Report("a tag comes twice: confidences left out");
  } else {
    for (size_t i = 0; i < num_pairs; ++i) {
      const double confidence = std::clamp(confidences[i], 0.0, 1.0);
      if (confidence != confidences[i]) {
        Report(absl::StrCat("confidence ", FormatNumber(confidences[i]), " of \"", tags[i],
                            "\" taken as ", FormatNumber(confidence)));
      }
      object.classes[tags[i]] = confidence;
    }
  }
  if (object.classes.empty()) object.classes[object.label] = 1.0;
}

absl::StatusOr<std::vector<Polygon>> SemanticObjectReader::ReadPolygons(
    const SemanticEntry& entry) {
  if (!entry.shape) return absl::InvalidArgumentError("no shape");
  HYPERMAP_ASSIGN_OR_RETURN(WktShape wkt, ParseWkt(*entry.shape, max_vertices_));
  if (wkt.kind != ShapeKind::kPolygon) {
    return absl::InvalidArgumentError(
        absl::StrCat(wkt.kind == ShapeKind::kPoint ? "POINT" : "LINESTRING",
                     " where POLYGON or MULTIPOLYGON is needed"));
  }
  for (const std::string& line : wkt.repairs) Report(line);
  if (wkt.polygons.empty()) Report("empty polygon: left out");
  std::vector<Polygon> polygons;
  for (size_t i = 0; i < wkt.polygons.size(); ++i) {
    HYPERMAP_ASSIGN_OR_RETURN(RepairedShape shape,
                              RepairShape(std::move(wkt.polygons[i]), crossings_left_));
    const std::string part = wkt.polygons.size() > 1 ? absl::StrCat("part ", i + 1, ": ") : "";
    for (const std::string& line : shape.repairs) Report(absl::StrCat(part, line));
    std::move(shape.polygons.begin(), shape.polygons.end(), std::back_inserter(polygons));
  }
  if (wkt.polygons.size() > 1) {
    Report(absl::StrCat("MULTIPOLYGON of ", polygons.size(), " polygons"));
  }
  return polygons;
}

void SemanticObjectReader::Keep(SemanticObject object) {
  std::vector<size_t>& alike = objects_by_hash_[HashOf(object)];
  for (const size_t index : alike) {
    const SemanticObject& first = objects_[index];
    if (first.label == object.label && first.tags == object.tags && first.shape == object.shape) {
      origins_[index].repeated_by.push_back(num_entries_);
      return;
    }
  }
  alike.push_back(objects_.size());
  objects_.push_back(std::move(object));
  origins_.push_back({num_entries_, {}});
}

std::vector<SemanticObject> SemanticObjectReader::Finish() && {
  for (size_t i = 0; i < objects_.size(); ++i) {
    const Origin& origin = origins_[i];
    if (origin.repeated_by.empty()) continue;
    const bool one = origin.repeated_by.size() == 1;
    repairs_.Add(absl::StrCat(layer_, one ? " object " : " objects ",
                              absl::StrJoin(origin.repeated_by, ", "), one ? " repeats" : " repeat",
                              " object ", origin.number, " (", objects_[i].label, "): left out"));
  }
  return std::move(objects_);
}

SemanticEntry ToSemanticEntry(const SemanticObject& object) {
  SemanticEntry entry;
  entry.name = object.label;
  entry.shape = FormatWkt(object.shape);
  if (object.tags.empty()) return entry;
  entry.tags = object.tags;
  std::vector<double> confidences;
  for (const std::string& tag : object.tags) {
    const auto it = object.classes.find(tag);
    if (it == object.classes.end()) return entry;
    confidences.push_back(it->second);
  }
  if (AllDistinct(object.tags)) entry.confidence = std::move(confidences);
  return entry;
}

LostInEntry LostBy(const SemanticObject& object) {
  LostInEntry lost;
  const bool tags_tell_classes =
      object.classes.size() == object.tags.size() && AllDistinct(object.tags) &&
      std::all_of(object.tags.begin(), object.tags.end(),
                  [&](const std::string& tag) { return object.classes.count(tag) > 0; });
  const bool label_tells_classes = object.classes.size() == 1 &&
                                   object.classes.begin()->first == object.label &&
                                   object.classes.begin()->second == 1.0;
  lost.classes = !tags_tell_classes && !label_tells_classes;
  lost.existence = object.existence != 1.0;
  lost.height = object.height.has_value();
  lost.attributes = !object.attributes.empty();
  return lost;
}

}  // namespace hypermap::storage
