// The maps that the trials use.
#ifndef HYPERMAP_TESTS_REGISTRATION_TEST_MAPS_H_
#define HYPERMAP_TESTS_REGISTRATION_TEST_MAPS_H_

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "map/layers/grid_layer.h"

namespace hypermap::registration {

struct TestMap {
  std::string name;
  std::shared_ptr<const GridLayer> grid;  // An occupancy layer.
};

// Returns the first occupancy layer of a .hmap or nav2's .yaml file. Errors of the decoders;
// NOT_FOUND if the file can't be read or has no occupancy layer.
absl::StatusOr<TestMap> LoadMap(const std::filesystem::path& file);

// Returns the floor of the tour's office, which is part of the sources (demo/office).
absl::StatusOr<TestMap> TourOffice();

// Returns the occupancy maps of the .hmap files in `data`/maps, and of the office of which there is
// a drive (`data`/rgbd/office_small), as far as they are there.
absl::StatusOr<std::vector<TestMap>> RealMaps(const std::filesystem::path& data);

}  // namespace hypermap::registration

#endif  // HYPERMAP_TESTS_REGISTRATION_TEST_MAPS_H_
