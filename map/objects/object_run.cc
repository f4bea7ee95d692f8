#include "map/objects/object_run.h"

#include <algorithm>
#include <functional>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "base/cancellation/cancellation.h"
#include "map/values/value_query.h"

namespace hypermap {
namespace {

// About n / kShareFarthest of n objects, but at least kMinFarthest, are listed by their reach to a
// side. Removals at the border use the list up; only then must runs be packed again to know the
// bounds.
constexpr size_t kShareFarthest = 64;
constexpr size_t kMinFarthest = 16;

// Numbers words by their folded form, in the order of their first appearance. Folds each spelling
// once.
class FoldedWords {
 public:
  uint32_t NumberOf(const std::string& word) {
    const auto [raw, is_new] = by_raw_.try_emplace(word, 0);
    if (is_new) {
      const auto number = static_cast<uint32_t>(by_folded_.size());
      raw->second = by_folded_.try_emplace(FoldLabel(word), number).first->second;
    }
    return raw->second;
  }
  const absl::flat_hash_map<std::string, uint32_t>& by_folded() const { return by_folded_; }

 private:
  absl::flat_hash_map<std::string, uint32_t> by_raw_;
  absl::flat_hash_map<std::string, uint32_t> by_folded_;
};

// An object with a certain word.
struct Use {
  uint32_t word;
  uint32_t place;
  int32_t item;
};

absl::flat_hash_map<std::string, PackedRTree> PackByWord(absl::Span<const Box> boxes,
                                                         const FoldedWords& words,
                                                         const std::vector<Use>& uses) {
  // Counting sort by word: (place, item) of each use, one word after the other.
  std::vector<size_t> ends(words.by_folded().size(), 0);
  for (const Use& use : uses) ++ends[use.word];
  std::partial_sum(ends.begin(), ends.end(), ends.begin());
  std::vector<uint64_t> sorted(uses.size());
  for (const Use& use : uses) {
    sorted[--ends[use.word]] = uint64_t{use.place} << 32 | static_cast<uint32_t>(use.item);
  }
  absl::flat_hash_map<std::string, PackedRTree> by_word;
  by_word.reserve(ends.size());
  for (const auto& [word, number] : words.by_folded()) {
    const auto begin = sorted.begin() + static_cast<std::ptrdiff_t>(ends[number]);
    const auto end = number + 1 == ends.size()
                         ? sorted.end()
                         : sorted.begin() + static_cast<std::ptrdiff_t>(ends[number + 1]);
    std::sort(begin, end);
    std::vector<int32_t> items;
    items.reserve(end - begin);
    for (auto it = begin; it != end; ++it) items.push_back(static_cast<int32_t>(*it & 0xFFFFFFFFu));
    by_word.emplace(word, PackedRTree(boxes, std::move(items)));
  }
  return by_word;
}

}  // namespace

std::vector<ObjectEntry> Merge(std::vector<ObjectEntry> newer, std::vector<ObjectEntry> older) {
  std::vector<ObjectEntry> merged;
  merged.reserve(newer.size() + older.size());
  // std::merge is stable, so that std::unique keeps the newer of two entries with the same id.
  std::merge(std::make_move_iterator(newer.begin()), std::make_move_iterator(newer.end()),
             std::make_move_iterator(older.begin()), std::make_move_iterator(older.end()),
             std::back_inserter(merged),
             [](const ObjectEntry& a, const ObjectEntry& b) { return a.id < b.id; });
  merged.erase(std::unique(merged.begin(), merged.end(),
                           [](const ObjectEntry& a, const ObjectEntry& b) { return a.id == b.id; }),
               merged.end());
  return merged;
}

double Reach(const Box& box, int side) {
  switch (side) {
    case 0:
      return -box.min.x;
    case 1:
      return -box.min.y;
    case 2:
      return box.max.x;
    default:
      return box.max.y;
  }
}

ObjectRun::ObjectRun(std::vector<ObjectEntry> entries)
    : digests_((entries.size() + kDigestBlock - 1) / kDigestBlock) {
  if (entries.empty()) return;
  first_id_ = entries.front().id;
  const bool has_gaps = entries.back().id - first_id_ != static_cast<ObjectId>(entries.size()) - 1;
  if (has_gaps) ids_.reserve(entries.size());
  objects_.reserve(entries.size());
  std::vector<Box> boxes;
  boxes.reserve(entries.size());
  for (ObjectEntry& entry : entries) {
    if (has_gaps) ids_.push_back(entry.id);
    boxes.push_back(entry.object ? entry.object->shape.bounds() : Box());
    bounds_.Extend(boxes.back());
    num_placed_ += !boxes.back().empty();
    objects_.push_back(std::move(entry.object));
  }
  // Free this memory before the indexes take theirs.
  entries = {};
  by_place_ = BoxGrid(boxes);
  IndexWords(boxes);
  for (int side = 0; side < kNumSides; ++side) FindFarthest(boxes, side);
}

std::vector<ObjectEntry> ObjectRun::Entries() const {
  std::vector<ObjectEntry> entries;
  entries.reserve(size());
  for (size_t i = 0; i < size(); ++i) entries.push_back({id(i), objects_[i]});
  return entries;
}

// Interpolation search: ids are assigned in sequence, so an id's value says roughly where it is.
// After four guesses it changes to binary search, which bounds the cost if ids are uneven.
int ObjectRun::IndexOf(ObjectId wanted) const {
  if (objects_.empty()) return -1;
  size_t low = 0, high = size() - 1;
  for (int guesses = 0; id(low) <= wanted && wanted <= id(high); ++guesses) {
    if (high - low < 2 || id(low) == wanted || id(high) == wanted) {
      if (id(low) == wanted) return static_cast<int>(low);
      return id(high) == wanted ? static_cast<int>(high) : -1;
    }
    size_t middle = low + (high - low) / 2;
    if (guesses < 4) {
      const double share = (static_cast<double>(wanted) - static_cast<double>(id(low))) /
                           (static_cast<double>(id(high)) - static_cast<double>(id(low)));
      middle = std::clamp(low + static_cast<size_t>(share * static_cast<double>(high - low)),
                          low + 1, high - 1);
    }
    if (id(middle) == wanted) return static_cast<int>(middle);
    (id(middle) < wanted ? low : high) = middle;
  }
  return -1;
}

const PackedRTree* ObjectRun::WithWord(WordKind kind, const std::string& folded) const {
  const WordIndex& index = kind == WordKind::kLabel ? by_label_ : by_tag_;
  const auto it = index.find(folded);
  return it == index.end() ? nullptr : &it->second;
}

void ObjectRun::IndexWords(absl::Span<const Box> boxes) {
  const std::vector<uint32_t> places = HilbertKeys(boxes);
  FoldedWords labels, tags;
  std::vector<Use> label_uses, tag_uses;
  label_uses.reserve(size());
  absl::flat_hash_set<uint32_t> tags_of_object;
  for (size_t i = 0; i < size(); ++i) {
    if (!objects_[i]) continue;
    const auto item = static_cast<int32_t>(i);
    label_uses.push_back({labels.NumberOf(objects_[i]->label), places[i], item});
    tags_of_object.clear();
    for (const std::string& tag : objects_[i]->tags) {
      const uint32_t number = tags.NumberOf(tag);
      if (tags_of_object.insert(number).second) tag_uses.push_back({number, places[i], item});
    }
  }
  by_label_ = PackByWord(boxes, labels, label_uses);
  by_tag_ = PackByWord(boxes, tags, tag_uses);
}

void ObjectRun::FindFarthest(absl::Span<const Box> boxes, int side) {
  // A sample estimates the reach that a kShareFarthest-th of the boxes exceeds, so that only few
  // boxes need sorting.
  constexpr size_t kSamples = 1024;
  double threshold = -std::numeric_limits<double>::infinity();
  if (boxes.size() > 4 * kSamples) {
    std::vector<double> sample;
    const size_t stride = boxes.size() / kSamples;
    for (size_t i = 0; i < boxes.size(); i += stride) {
      if (!boxes[i].empty()) sample.push_back(Reach(boxes[i], side));
    }
    const size_t rank = sample.size() / kShareFarthest;
    if (rank < sample.size()) {
      std::nth_element(sample.begin(), sample.begin() + static_cast<std::ptrdiff_t>(rank),
                       sample.end(), std::greater<>());
      threshold = sample[rank];
    }
  }
  std::vector<std::pair<double, int32_t>> found;
  for (size_t i = 0; i < boxes.size(); ++i) {
    const double reach = Reach(boxes[i], side);
    if (reach >= threshold && !boxes[i].empty()) found.emplace_back(reach, i);
  }
  const size_t keep =
      std::min(found.size(), std::max(kMinFarthest, 2 * boxes.size() / kShareFarthest));
  std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(keep), found.end(),
                    std::greater<>());
  farthest_[side].reserve(keep);
  for (size_t i = 0; i < keep; ++i) farthest_[side].push_back(found[i].second);
}

SetDigest ObjectRun::Digest(ObjectDigest digest_of) const {
  SetDigest digest;
  for (size_t block = 0; block < digests_.size() && !IsCancelled(); ++block) {
    digest.Add(digests_[block].Get([&] {
      SetDigest of_block;
      const size_t end = std::min(size(), (block + 1) * kDigestBlock);
      for (size_t i = block * kDigestBlock; i < end; ++i) {
        if (objects_[i]) of_block.Add(digest_of(*objects_[i]));
      }
      return of_block;
    }));
  }
  return digest;
}

}  // namespace hypermap
