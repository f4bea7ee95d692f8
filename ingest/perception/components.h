// Connected components of an image's pixels.
#ifndef HYPERMAP_INGEST_PERCEPTION_COMPONENTS_H_
#define HYPERMAP_INGEST_PERCEPTION_COMPONENTS_H_

#include <cstddef>
#include <vector>

namespace hypermap::ingest {

// `of` gives the component of each pixel, or -1 for pixels that are no members. Components are
// numbered from 0 in the order of their first pixels.
struct Components {
  int count = 0;
  std::vector<int> of;
};

// Returns the components of the pixels for which `member(i)` is true. Pixel i is joined with the
// pixel to its right if `right(i)`, and with the pixel below if `down(i)`; both are called only
// between two members. Two passes over the image with a union of labels (Rosenfeld and Pfaltz
// 1966), so that the cost is almost linear in the number of pixels.
template <typename Member, typename Right, typename Down>
Components ConnectedComponents(int width, int height, const Member& member, const Right& right,
                               const Down& down) {
  constexpr int kNone = -1;
  Components components;
  std::vector<int>& of = components.of;
  of.assign(static_cast<size_t>(width) * height, kNone);
  std::vector<int> parent;  // A label's parent is never greater than the label.
  const auto root = [&](int label) {
    while (parent[label] != label) label = parent[label] = parent[parent[label]];
    return label;
  };
  for (int v = 0; v < height; ++v) {
    int left = kNone;
    for (int u = 0; u < width; ++u) {
      const int i = v * width + u;
      if (!member(i)) {
        left = kNone;
        continue;
      }
      int label = left != kNone && right(i - 1) ? left : kNone;
      const int above = v > 0 ? of[i - width] : kNone;
      if (above != kNone && above != label && down(i - width)) {
        if (label == kNone) {
          label = above;
        } else {
          const int a = root(label);
          const int b = root(above);
          label = a < b ? a : b;
          parent[a] = parent[b] = label;
        }
      }
      if (label == kNone) {
        label = static_cast<int>(parent.size());
        parent.push_back(label);
      }
      of[i] = left = label;
    }
  }
  std::vector<int> number(parent.size());
  for (int label = 0; label < static_cast<int>(parent.size()); ++label) {
    const int first = root(label);
    number[label] = first == label ? components.count++ : number[first];
  }
  for (int& label : of) {
    if (label != kNone) label = number[label];
  }
  return components;
}

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_COMPONENTS_H_
