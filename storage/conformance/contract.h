// Base classes of the conformance suites.
#ifndef HYPERMAP_STORAGE_CONFORMANCE_CONTRACT_H_
#define HYPERMAP_STORAGE_CONFORMANCE_CONTRACT_H_

#include <cstdint>
#include <memory>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "storage/conformance/store_world.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/map_store.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {

// A test on a store without maps.
class StoreContract : public ::testing::TestWithParam<StoreKind> {
 protected:
  StoreContract() : world_(GetParam().make_world()), store_(world_->Open()) {}

  // Closes the store and opens it, as a restarted process does. REQUIRES: its maps are closed.
  void Restart();

  // For all that is random in the test. A failure shows it.
  const uint64_t seed_ = hypermap::testing::TestSeed();
  const ::testing::ScopedTrace trace_{__FILE__, __LINE__,
                                      absl::StrCat("HYPERMAP_TEST_SEED=", seed_)};
  const std::unique_ptr<StoreWorld> world_;
  std::unique_ptr<MapStore> store_;
};

// A test on the map "site".
class MapContract : public StoreContract {
 protected:
  MapContract() : map_(CreateMap(*store_, "site")) {}

  // Closes the map and the store, and opens both.
  void Reopen();
  // Expects that the map has the same content after Reopen, and takes another commit.
  void ExpectReopensTheSame();

  EditedMap map_;
};

// Runs all tests of a suite on all stores.
#define HYPERMAP_CONFORMANCE_SUITE(suite)                              \
  INSTANTIATE_TEST_SUITE_P(, suite, ::testing::ValuesIn(StoreKinds()), \
                           [](const auto& info) { return info.param.name; })

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_CONFORMANCE_CONTRACT_H_
