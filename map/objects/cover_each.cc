// Coverage of many points at once. A point waits for memory about six times: for the directory of
// cells, for the entries of its cell, and for the pointer, the object and the ring of each
// candidate. Each stage here prefetches for the next one, for all points of a chunk, so that the
// waits overlap.
#include <algorithm>
#include <cstdint>

#include "absl/container/inlined_vector.h"
#include "base/cancellation/cancellable_sort.h"
#include "base/cancellation/cancellation.h"
#include "base/cancellation/give_way.h"
#include "map/geometry/predicates.h"
#include "map/objects/object_index.h"
#include "map/objects/prefetch.h"

namespace hypermap {
namespace {

// Number of cell lookups in flight: enough to keep the memory busy, and few enough that what they
// fetch stays in the first-level cache.
constexpr size_t kMaxLooks = 128;
// Candidates of a chunk of several points. Where objects lie on top of each other, chunks are
// smaller.
constexpr size_t kMaxCandidates = 2048;
// Candidates between two looks for a cancellation, and whose memory is fetched together.
constexpr size_t kBlock = 1024;

struct CellLook {
  const CellLevel* level;
  uint32_t run;
  uint32_t point;
  CellLevel::Look look;
};

}  // namespace

// An object that may cover a point.
struct ObjectIndex::Cover {
  uint32_t point;
  uint32_t run;
  const ObjectPtr* place;
  const SemanticObject* object;
  ObjectId id;
};

void ObjectIndex::CoverEach(absl::Span<const Point> points,
                            absl::FunctionRef<bool(uint32_t, const ObjectPtr&)> visit) const {
  size_t num_levels = 0;
  for (const Run& run : runs_) num_levels += run.run->by_place().levels().size();
  const size_t largest_chunk = std::max<size_t>(1, kMaxLooks / std::max<size_t>(1, num_levels));
  size_t chunk = largest_chunk;
  std::vector<Cover> covers;
  for (size_t begin = 0; begin < points.size();) {
    if (begin > 0 && IsCancelled()) return;
    covers.clear();
    while (!CoverChunk(points, begin, std::min(points.size(), begin + chunk), &covers)) {
      chunk = (chunk + 1) / 2;
    }
    CancellableSort(covers.begin(), covers.end(), [](const Cover& a, const Cover& b) {
      return a.point != b.point ? a.point < b.point : a.id < b.id;
    });
    for (const Cover& cover : covers) {
      if (!visit(cover.point, *cover.place)) return;
    }
    begin += chunk;
    // Objects may be less dense at the next points.
    chunk = std::min(largest_chunk, 2 * chunk);
  }
}

bool ObjectIndex::CoverChunk(absl::Span<const Point> points, size_t begin, size_t end,
                             std::vector<Cover>* covers) const {
  absl::InlinedVector<CellLook, kMaxLooks> looks;
  for (size_t r = 0; r < runs_.size(); ++r) {
    for (const CellLevel& level : runs_[r].run->by_place().levels()) {
      for (size_t i = begin; i < end; ++i) {
        CellLook look{&level, static_cast<uint32_t>(r), static_cast<uint32_t>(i), {}};
        if (level.Aim(points[i], &look.look)) looks.push_back(look);
      }
    }
  }
  size_t num_candidates = 0;
  for (CellLook& look : looks) {
    look.level->Open(&look.look);
    num_candidates += look.look.end - look.look.begin;
  }
  if (num_candidates > kMaxCandidates && end - begin > 1) return false;
  size_t num_kept = 0;
  bool is_cancelled = false;
  // Removes the candidates after the first num_kept that cover no point or are hidden.
  const auto keep_covers = [&] {
    const auto block = covers->begin() + static_cast<ptrdiff_t>(num_kept);
    for (auto cover = block; cover != covers->end(); ++cover) {
      cover->object = cover->place->get();
      PrefetchShape(*cover->object);
    }
    const auto last_near = std::remove_if(block, covers->end(), [&](const Cover& cover) {
      const Shape& shape = cover.object->shape;
      if (!shape.bounds().Covers(points[cover.point])) return true;
      PrefetchVertices(shape);
      return false;
    });
    const auto last = std::remove_if(block, last_near, [&](const Cover& cover) {
      return !Covers(cover.object->shape, points[cover.point]) ||
             IsHidden(cover.run, cover.object->id);
    });
    for (auto cover = block; cover != last; ++cover) cover->id = cover->object->id;
    covers->erase(last, covers->end());
    num_kept = covers->size();
  };
  for (const CellLook& look : looks) {
    const ObjectRun& run = *runs_[look.run].run;
    look.level->Read(look.look, [&](int32_t item) {
      if (is_cancelled) return;
      const ObjectPtr* const place = &run.object(item);
      __builtin_prefetch(place);
      covers->push_back({look.point, look.run, place, nullptr, 0});
      if (covers->size() - num_kept < kBlock) return;
      keep_covers();
      GiveWay();
      is_cancelled = IsCancelled();
    });
  }
  keep_covers();
  for (const Change& change : recent_) {
    const Box& box = change.box;
    for (size_t i = begin; i < end; ++i) {
      const Point& p = points[i];
      // Compares all four sides without branches, which would be mispredicted more often than not.
      if ((p.x < box.min.x) | (p.x > box.max.x) | (p.y < box.min.y) | (p.y > box.max.y)) continue;
      if (!Covers(change.object->shape, p)) continue;
      covers->push_back(
          {static_cast<uint32_t>(i), 0, &change.object, change.object.get(), change.object->id});
    }
  }
  return true;
}

}  // namespace hypermap
