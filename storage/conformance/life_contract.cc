// Random lives of maps, compared with a plain model of all that a store tells.
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/contract.h"
#include "storage/conformance/testing/model_map.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::Rng;
using ::hypermap::testing::UniformInt;

class LifeContract : public StoreContract {
 protected:
  void Create(const std::string& name);
  void Delete(const std::string& name);
  // Opens the store and all maps again, after a kill or an orderly end.
  void Reopen(bool killed);
  void Step();
  void ExpectAllSame();

  Rng rng_{seed_};
  std::map<std::string, std::unique_ptr<ModelMap>> maps_;
  std::map<std::string, std::string> deletions_;  // names of maps by request
  int num_requests_ = 0;
};

HYPERMAP_CONFORMANCE_SUITE(LifeContract);

void LifeContract::Create(const std::string& name) {
  MapHeader header = HeaderOf(name);
  header.created_at = absl::FromUnixNanos(1'600'000'000'000'000'001);
  header.request_id = absl::StrCat("create ", ++num_requests_);
  maps_[name] = std::make_unique<ModelMap>(*store_, header);
}

void LifeContract::Delete(const std::string& name) {
  const std::string request = absl::StrCat("delete ", ++num_requests_);
  EXPECT_TRUE(absl::IsFailedPrecondition(store_->Delete(name, request)));
  maps_.erase(name);
  EXPECT_TRUE(store_->Delete(name, request).ok());
  EXPECT_TRUE(store_->Delete(name, request).ok()) << "the retry";
  deletions_[request] = name;
}

void LifeContract::Reopen(bool killed) {
  std::unique_ptr<MapStore> found = killed ? world_->OpenAfterKill() : nullptr;
  for (const auto& [name, map] : maps_) map->Close();
  if (found == nullptr) {
    Restart();
  } else {
    store_ = std::move(found);
  }
  for (const auto& [name, map] : maps_) map->Open(*store_);
}

void LifeContract::Step() {
  const std::string name = absl::StrCat("map-", UniformInt(rng_, 0, 1));
  if (!maps_.contains(name)) return Create(name);
  ModelMap& map = *maps_.at(name);
  switch (UniformInt(rng_, 0, 19)) {
    case 0:
      return Delete(name);
    case 1:
      return Reopen(/*killed=*/false);
    case 2:
      return Reopen(/*killed=*/true);
    case 3:
      return map.WriteAsReplica(rng_);
    case 4:
      return map.AddMark(rng_);
    case 5:
      return map.CompactOnce(rng_);
    case 6:
      return map.CompactAll(rng_);
    case 7:
    case 8:
    case 9:
      return map.KeepCheckpoint(rng_);
    case 10:
    case 11:
      return map.MoveBase(rng_);
    default:
      return map.WriteGroup(rng_);
  }
}

void LifeContract::ExpectAllSame() {
  std::vector<std::string> names;
  for (const auto& [name, map] : maps_) {
    names.push_back(name);
    map->ExpectSame(rng_);
  }
  EXPECT_THAT(*store_->List(), ::testing::ElementsAreArray(names));
  for (const auto& [request, name] : deletions_) EXPECT_EQ(*store_->FindDeletion(request), name);
  EXPECT_EQ(*store_->FindDeletion("create 1"), std::nullopt);
}

TEST_P(LifeContract, RandomLivesOfMapsAreAsTheModelTells) {
  constexpr int kSteps = 120;
  for (int step = 1; step <= kSteps && !HasFailure(); ++step) {
    SCOPED_TRACE(::testing::Message() << "step " << step);
    Step();
    if (step % 12 == 0 && !HasFailure()) ExpectAllSame();
  }
}

}  // namespace
}  // namespace hypermap::storage
