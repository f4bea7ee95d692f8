#include "storage/interchange/semantic_objects.h"

#include <algorithm>
#include <set>

#include "absl/hash/hash.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/cancellation/cancellation.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "storage/interchange/names.h"
#include "storage/interchange/number_text.h"
#include "storage/interchange/status_context.h"
#include "storage/interchange/wkt.h"

namespace hypermap::storage {
namespace {

constexpr char kUnnamed[] = "unnamed";
// Bytes of a label that a message shows.
constexpr size_t kMaxShownBytes = 100;
// Bytes of a name or tag, with its blanks, that is looked at. Validate refuses words much shorter.
constexpr size_t kMaxWordBytes = 4096;

absl::StatusOr<std::string> ReadWord(absl::string_view field, absl::string_view text) {
  if (text.size() <= kMaxWordBytes) return CleanWord(text);
  return absl::InvalidArgumentError(
      absl::StrCat(field, " is longer than ", kMaxWordBytes, " bytes"));
}

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

SemanticObjectReader::SemanticObjectReader(std::string layer, const Limits& limits,
                                           ImportTotals& totals, RepairLog& repairs)
    : layer_(std::move(layer)), limits_(limits), totals_(totals), repairs_(repairs) {}

template <typename... Pieces>
void SemanticObjectReader::Report(const Pieces&... pieces) {
  repairs_.Add([&] { return absl::StrCat(Place(), ": ", pieces...); });
}

std::string SemanticObjectReader::Place() const {
  return absl::StrCat(layer_, " object ", num_entries_, " (", label_, ")");
}

absl::Status SemanticObjectReader::Take(const SemanticEntry& entry) {
  ++num_entries_;
  HYPERMAP_RETURN_IF_ERROR(CountObject());
  const absl::Status status = TakeEntry(entry);
  return status.ok() ? status : At(Place(), status);
}

absl::Status SemanticObjectReader::TakeEntry(const SemanticEntry& entry) {
  HYPERMAP_ASSIGN_OR_RETURN(SemanticObject object, Describe(entry));
  HYPERMAP_RETURN_IF_ERROR(Validate(object));
  SetClasses(entry, object);
  return KeepParts(entry, std::move(object));
}

absl::StatusOr<SemanticObject> SemanticObjectReader::Describe(const SemanticEntry& entry) {
  const absl::string_view name = entry.name ? absl::string_view(*entry.name) : "";
  label_ = CleanWord(CutText(name, kMaxShownBytes));
  SemanticObject object;
  HYPERMAP_ASSIGN_OR_RETURN(object.label, ReadWord("name", name));
  if (object.label.empty()) {
    object.label = label_ = kUnnamed;
    Report("no name");
  } else if (object.label != name) {
    Report("blanks in the name made one, none at its ends");
  }
  if (entry.tags) {
    HYPERMAP_ASSIGN_OR_RETURN(object.tags, CleanTags(*entry.tags));
  }
  return object;
}

absl::StatusOr<std::vector<std::string>> SemanticObjectReader::CleanTags(
    const std::vector<std::string>& tags) {
  std::vector<std::string> clean;
  clean.reserve(tags.size());
  for (const std::string& tag : tags) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    HYPERMAP_ASSIGN_OR_RETURN(std::string word, ReadWord("a tag", tag));
    if (word.empty()) {
      Report("a tag without a name made \"unnamed\"");
      word = kUnnamed;
    } else if (word != tag) {
      Report("blanks in the tag \"", word, "\" made one, none at its ends");
    }
    clean.push_back(std::move(word));
  }
  return clean;
}

void SemanticObjectReader::SetClasses(const SemanticEntry& entry, SemanticObject& object) {
  const std::vector<double> confidences = entry.confidence.value_or(std::vector<double>());
  const size_t num_pairs = std::min(object.tags.size(), confidences.size());
  if (entry.confidence && object.tags.size() != confidences.size()) {
    Report(object.tags.size(), " tags but ", confidences.size(), " confidences: the first ",
           num_pairs, " of both are taken as pairs");
  }
  const std::vector<std::string> tags(object.tags.begin(), object.tags.begin() + num_pairs);
  if (!AllDistinct(tags)) {
    Report("a tag comes twice: confidences left out");
  } else {
    for (size_t i = 0; i < num_pairs; ++i) {
      const double confidence = std::clamp(confidences[i], 0.0, 1.0);
      if (confidence != confidences[i]) {
        Report("confidence ", FormatNumber(confidences[i]), " of \"", tags[i], "\" taken as ",
               FormatNumber(confidence));
      }
      object.classes[tags[i]] = confidence;
    }
  }
  if (object.classes.empty()) object.classes[object.label] = 1.0;
}

absl::Status SemanticObjectReader::KeepParts(const SemanticEntry& entry, SemanticObject object) {
  if (!entry.shape) return absl::InvalidArgumentError("no shape");
  HYPERMAP_ASSIGN_OR_RETURN(WktShape wkt, ParseWkt(*entry.shape, limits_.max_vertices));
  if (wkt.kind != ShapeKind::kPolygon) {
    return absl::InvalidArgumentError(
        absl::StrCat(wkt.kind == ShapeKind::kPoint ? "POINT" : "LINESTRING",
                     " where POLYGON or MULTIPOLYGON is needed"));
  }
  for (const std::string& line : wkt.repairs) Report(line);
  if (wkt.polygons.empty()) Report("empty polygon: left out");
  const bool is_multi = wkt.polygons.size() > 1;
  int64_t num_polygons = 0;
  for (size_t i = 0; i < wkt.polygons.size(); ++i) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    HYPERMAP_ASSIGN_OR_RETURN(RepairedShape shape,
                              RepairShape(std::move(wkt.polygons[i]), totals_.crossings_left));
    const std::string part = is_multi ? absl::StrCat("part ", i + 1, ": ") : "";
    for (const std::string& line : shape.repairs) Report(part, line);
    for (Polygon& polygon : shape.polygons) {
      if (++num_polygons > 1) HYPERMAP_RETURN_IF_ERROR(CountObject());
      object.shape = std::move(polygon);
      HYPERMAP_RETURN_IF_ERROR(TakeMemory(ByteSize(object)));
      Keep(object);
    }
  }
  if (is_multi) Report("MULTIPOLYGON of ", num_polygons, " polygons");
  return absl::OkStatus();
}

absl::Status SemanticObjectReader::CountObject() {
  if (++totals_.num_objects <= limits_.max_import_objects) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat("the file has more than --max_import_objects (",
                                                   limits_.max_import_objects, ") objects"));
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
    repairs_.Add([&] {
      return absl::StrCat(layer_, one ? " object " : " objects ",
                          absl::StrJoin(origin.repeated_by, ", "), one ? " repeats" : " repeat",
                          " object ", origin.number, " (",
                          CutText(objects_[i].label, kMaxShownBytes), "): left out");
    });
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
