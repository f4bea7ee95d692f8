// Maps that are copied from files to a database and back.
#include <memory>
#include <string>
#include <utility>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/testing/model_map.h"
#include "storage/geopackage/geopackage_store.h"
#include "storage/libpq/testing/cluster.h"
#include "storage/postgres/testing/database.h"
#include "storage/transfer/map_copy.h"
#include "storage/transfer/map_digest.h"
#include "tests/support/random_map.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::storage::postgres {
namespace {

using ::hypermap::testing::Rng;
using ::hypermap::testing::TestSeed;
using ::hypermap::testing::UniformInt;

class CopyBetweenStoresTest : public ::testing::Test {
 protected:
  void SetUp() override {
    HYPERMAP_SKIP_WITHOUT_POSTGRES();
    database_ = OpenStore(NewDatabase());
    first_ = Need(OpenGeoPackageStore(first_folder_.path()));
    second_ = Need(OpenGeoPackageStore(second_folder_.path()));
  }

  template <typename T>
  static T Need(absl::StatusOr<T> result) {
    EXPECT_TRUE(result.ok()) << result.status();
    return *std::move(result);
  }

  // Returns the digest of the map, which is that of the copy, too.
  static MapDigest Copy(MapStore& from, MapStore& to) {
    const std::unique_ptr<StoredMap> map = Need(from.Open("site"));
    const std::unique_ptr<StoredMap> copy = Need(BeginCopy(*map, map->header(), to));
    const absl::Status status = CopyMap(*map, *copy);
    EXPECT_TRUE(status.ok()) << status;
    const MapDigest digest = Need(DigestOf(*map));
    EXPECT_THAT(DifferingParts(digest, Need(DigestOf(*copy))), ::testing::IsEmpty());
    EXPECT_TRUE(copy->FinishCopy().ok());
    EXPECT_EQ(copy->header().incarnation, map->header().incarnation);
    return digest;
  }

  const uint64_t seed_ = TestSeed();
  Rng rng_{seed_};
  const testing::TemporaryFolder first_folder_;
  const testing::TemporaryFolder second_folder_;
  std::unique_ptr<MapStore> database_;
  std::unique_ptr<MapStore> first_;
  std::unique_ptr<MapStore> second_;
};

void Step(Rng& rng, ModelMap& map) {
  switch (UniformInt(rng, 0, 9)) {
    case 0:
      return map.AddMark(rng);
    case 1:
      return map.CompactOnce(rng);
    case 2:
      return map.MoveBase(rng);
    case 3:
    case 4:
      return map.KeepCheckpoint(rng);
    default:
      return map.WriteGroup(rng);
  }
}

TEST_F(CopyBetweenStoresTest, FileThatHasBeenInADatabaseIsTheSame) {
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed_);
  MapHeader header;
  header.name = "site";
  header.frame_id = "map";
  header.created_at = absl::FromUnixNanos(1'600'000'000'000'000'001);
  ModelMap map(*first_, header);
  for (int step = 0; step < 100 && !HasFailure(); ++step) Step(rng_, map);
  map.Close();
  const MapDigest there = Copy(*first_, *database_);
  map.Open(*database_);
  map.ExpectSame(rng_);
  map.Close();
  const MapDigest back = Copy(*database_, *second_);
  EXPECT_THAT(DifferingParts(there, back), ::testing::IsEmpty());
  map.Open(*second_);
  map.ExpectSame(rng_);
  for (int step = 0; step < 20 && !HasFailure(); ++step) Step(rng_, map);
  map.ExpectSame(rng_);
}

}  // namespace
}  // namespace hypermap::storage::postgres
