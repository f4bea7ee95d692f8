#include "simulation/worlds/class_heights.h"

#include <string>
#include <utility>

#include "absl/strings/ascii.h"

namespace hypermap::simulation {
namespace {

// Heights of usual pieces; they are not averages of measurements.
constexpr std::pair<absl::string_view, ClassHeight> kHeights[] = {
    // Furniture.
    {"bed", {0.55}},
    {"bench", {0.85}},
    {"bin", {0.40}},
    {"bookshelf", {1.80}},
    {"cabinet", {1.20, 0.0, true}},
    {"chair", {0.90}},
    {"couch", {0.85}},
    {"cupboard", {1.80}},
    {"desk", {0.74, 0.0, true}},
    {"diningtable", {0.74, 0.0, true}},
    {"oven", {0.90, 0.0, true}},
    {"refrigerator", {1.80}},
    {"shelf", {1.80}},
    {"sink", {0.20, 0.75}},
    {"sofa", {0.85}},
    {"table", {0.74, 0.0, true}},
    {"toilet", {0.75}},
    // Other objects on the floor.
    {"backpack", {0.45}},
    {"bicycle", {1.10}},
    {"fan", {1.20}},
    {"person", {1.70}},
    {"pottedplant", {1.00}},
    {"suitcase", {0.65}},
    {"train", {2.40}},
    {"truck", {2.40}},
    // Objects on tables.
    {"book", {0.04}},
    {"bottle", {0.26}},
    {"bowl", {0.10}},
    {"cup", {0.10}},
    {"keyboard", {0.03}},
    {"laptop", {0.24}},
    {"microwave", {0.30}},
    {"mouse", {0.04}},
    {"newspaper", {0.02}},
    {"remote", {0.02}},
    {"tv", {0.50}},
    {"tvmonitor", {0.50}},
    {"vase", {0.35}},
    // Objects on walls.
    {"clock", {0.30, 1.90}},
    {"noteboard", {1.00, 0.90}},
};

std::string Bare(absl::string_view label) {
  std::string bare;
  for (const char c : label) {
    if (c != ' ' && c != '_' && c != '-') bare.push_back(absl::ascii_tolower(c));
  }
  return std::string(absl::StripAsciiWhitespace(bare));
}

}  // namespace

ClassHeight HeightOfClass(absl::string_view label) {
  const std::string bare = Bare(label);
  for (const auto& [name, height] : kHeights) {
    if (name == bare) return height;
  }
  return {};
}

}  // namespace hypermap::simulation
