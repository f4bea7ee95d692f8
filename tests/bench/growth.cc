// Runs one operation on an input of the given size, for an instruction counter: growth OPERATION
// SIZE. The function hot_path contains exactly the code that is counted. A row of Operations()
// makes the input; what it returns does the work and says whether the outcome is the expected one.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "map/edits/apply.h"
#include "map/frames/frame_bounds.h"
#include "map/geometry/polygon.h"
#include "map/query/query.h"

namespace hypermap::bench {
namespace {

using Operation = std::function<bool()>;

// Returns a ring of `vertices` around the square from the origin to (side, side).
Ring RingAround(double side, int vertices) {
  Ring ring;
  for (int i = 0; i < vertices; ++i) {
    const double angle = 2 * std::numbers::pi * i / vertices;
    const double radius = side * (i % 2 == 0 ? 1.0 : 0.99);
    ring.push_back({side / 2 + radius * std::cos(angle), side / 2 + radius * std::sin(angle)});
  }
  return ring;
}

Ring Square(double x, double y, double side) {
  return {{x, y}, {x + side, y}, {x + side, y + side}, {x, y + side}};
}

// Validates an outer ring of `size` vertices with size / 3 holes side by side. The last two overlap
// if `overlap`.
Operation HolesSideBySide(int size, bool overlap) {
  const int num_holes = size / 3;
  const int side = static_cast<int>(std::ceil(std::sqrt(num_holes)));
  std::vector<Ring> holes;
  for (int i = 0; i < num_holes; ++i) {
    const double shift = overlap && i + 1 == num_holes ? 0.75 : 0.0;
    const int row = i / side;
    holes.push_back(Square(i % side - shift, row, 0.5));
  }
  return [outer = RingAround(side, size), holes = std::move(holes), overlap] {
    return Polygon::Make(outer, holes).ok() != overlap;
  };
}

// Refuses `size` holes, each of which lies inside the one before.
Operation NestedHoles(int size) {
  std::vector<Ring> holes;
  holes.reserve(size);
  for (int i = 0; i < size; ++i) holes.push_back(Square(i, i, 3.0 * size - 2 * i));
  return [outer = Square(-1, -1, 4.0 * size), holes = std::move(holes)] {
    return !Polygon::Make(outer, holes).ok();
  };
}

// Validates a comb whose teeth are slanted, so that the bounding boxes of nearly all pairs of edges
// intersect.
Operation SlantedTeeth(int size) {
  Ring ring;
  for (int i = 0; i < size / 2; ++i) {
    const double shift = 10.0 * i / size;
    ring.push_back({shift, -shift});
    ring.push_back({20 + shift, 20 - shift});
  }
  ring.push_back({40, -20});
  ring.push_back({0, -20});
  return [ring = std::move(ring)] { return Polygon::Make(ring).ok(); };
}

// Applies a batch of transforms with chains of frames as deep as allowed.
Operation ChainsOfFrames(int size) {
  EditBatch batch;
  for (int i = 0; i < size; ++i) {
    const std::string parent = i % kMaxFrameDepth == 0 ? "map" : absl::StrCat("frame", i - 1);
    batch.edits.push_back(SetTransform{{parent, absl::StrCat("frame", i), {}}});
  }
  return [batch = std::move(batch)] { return Apply(Snapshot(), batch).ok(); };
}

// Applies a batch of transforms that move a frame with `size` frames below it, `size` times.
Operation MovingFrame(int size) {
  Snapshot before;
  for (int i = 0; i < size; ++i) {
    before.frames.Set({"robot", absl::StrCat("sensor", i), {}}).IgnoreError();
  }
  EditBatch batch;
  for (int i = 0; i < size; ++i) {
    batch.edits.push_back(SetTransform{{i % 2 == 0 ? "map" : "odom", "robot", {}}});
  }
  return
      [before = std::move(before), batch = std::move(batch)] { return Apply(before, batch).ok(); };
}

constexpr char kThings[] = "things";

std::string Numbered(const char* word, int i) { return absl::StrCat(word, i); }

CreateLayer NewLayer(std::string name) {
  LayerSpec spec;
  spec.name = std::move(name);
  return {std::move(spec)};
}

PutObject Put(std::string layer, const Point& at, ObjectId id = 0) {
  SemanticObject object;
  object.id = id;
  object.label = "cup";
  object.shape = Shape::MakePointUnchecked(at);
  return {std::move(layer), std::move(object), ""};
}

SnapshotPtr MapOf(EditBatch batch) { return Apply(Snapshot(), batch)->snapshot; }

// Returns a map of `size` layers with an object each, and a scope that names all of them.
std::pair<SnapshotPtr, Scope> ManyLayers(int size) {
  EditBatch batch;
  Scope scope;
  for (int i = 0; i < size; ++i) {
    scope.layers.push_back(Numbered("layer", i));
    batch.edits.push_back(NewLayer(scope.layers.back()));
    batch.edits.push_back(Put(scope.layers.back(), {1, 1}));
  }
  return {MapOf(std::move(batch)), std::move(scope)};
}

// Asks what is at a point, of `size` layers by their names.
Operation LayersAtAPoint(int size) {
  auto [snapshot, scope] = ManyLayers(size);
  return [snapshot = std::move(snapshot), scope = std::move(scope), size] {
    int found = 0;
    const auto count = [&found](const LayerPtr&, const PlanarTransform&, PointContent content) {
      found += static_cast<int>(content.objects.size());
    };
    return VisitContentAt(*snapshot, scope, {1, 1}, 0.0, count).ok() && found == size;
  };
}

// Asks what is in an area, of `size` layers by their names.
Operation LayersInAnArea(int size) {
  auto [snapshot, scope] = ManyLayers(size);
  return [snapshot = std::move(snapshot), scope = std::move(scope), size] {
    const auto reader = ContentIn(snapshot, scope, *Polygon::Make(Square(0, 0, 2)));
    int found = 0;
    while (reader.ok() && !(*reader)->done()) {
      found += static_cast<int>((*reader)->Next(/*max_items=*/100).part.objects.size());
    }
    return found == size;
  };
}

// Applies a batch that adds `size` objects, or replaces each of them.
Operation PutObjects(int size, bool replaces) {
  EditBatch first{{NewLayer(kThings)}};
  EditBatch puts;
  for (int i = 0; i < size; ++i) {
    const Point at{1.0 * (i % 100), 1.0 * i / 100};
    if (replaces) first.edits.push_back(Put(kThings, at));
    puts.edits.push_back(Put(kThings, {at.x, at.y + 1}, replaces ? i + 1 : 0));
  }
  return [before = MapOf(std::move(first)), puts = std::move(puts)] {
    return Apply(*before, puts).ok();
  };
}

// Sets `size` aliases of a layer in one edit, or in an edit each when it has as many already.
Operation Aliases(int size, bool one_by_one) {
  EditBatch first{{NewLayer(kThings)}};
  ValueAliases aliases;
  EditBatch batch;
  for (int i = 0; i < size; ++i) {
    const std::string alias = Numbered("alias", i);
    aliases.insert_or_assign(alias, {Numbered("label", i)});
    if (one_by_one) {
      batch.edits.push_back(SetAliases{kThings, {{alias, {Numbered("other", i)}}}});
    }
  }
  (one_by_one ? first : batch).edits.push_back(SetAliases{kThings, aliases});
  return [before = MapOf(std::move(first)), batch = std::move(batch)] {
    return Apply(*before, batch).ok();
  };
}

std::map<std::string, std::function<Operation(int size)>> Operations() {
  return {
      {"polygon_with_holes", [](int size) { return HolesSideBySide(size, /*overlap=*/false); }},
      {"polygon_with_overlapping_holes",
       [](int size) { return HolesSideBySide(size, /*overlap=*/true); }},
      {"polygon_of_slanted_teeth", SlantedTeeth},
      {"polygon_of_nested_holes", NestedHoles},
      {"chains_of_frames", ChainsOfFrames},
      {"moving_frame", MovingFrame},
      {"layers_at_a_point", LayersAtAPoint},
      {"layers_in_an_area", LayersInAnArea},
      {"new_objects", [](int size) { return PutObjects(size, /*replaces=*/false); }},
      {"replaced_objects", [](int size) { return PutObjects(size, /*replaces=*/true); }},
      {"aliases_in_one_edit", [](int size) { return Aliases(size, /*one_by_one=*/false); }},
      {"aliases_one_by_one", [](int size) { return Aliases(size, /*one_by_one=*/true); }},
  };
}

}  // namespace
}  // namespace hypermap::bench

extern "C" __attribute__((noinline)) bool hot_path(const hypermap::bench::Operation& operation) {
  return operation();
}

int main(int argc, char** argv) {
  const auto operations = hypermap::bench::Operations();
  const auto operation = argc == 3 ? operations.find(argv[1]) : operations.end();
  const int size = argc == 3 ? std::atoi(argv[2]) : 0;
  if (operation == operations.end() || size <= 0) {
    std::fprintf(stderr, "usage: growth OPERATION SIZE, where OPERATION is one of:");
    for (const auto& [name, make] : operations) std::fprintf(stderr, " %s", name.c_str());
    std::fprintf(stderr, "\n");
    return EXIT_FAILURE;
  }
  if (!hot_path(operation->second(size))) {
    std::fprintf(stderr, "%s %d has another outcome\n", argv[1], size);
    return EXIT_FAILURE;
  }
  // The number of rounds.
  std::printf("1\n");
  return EXIT_SUCCESS;
}
