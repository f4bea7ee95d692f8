#include "server/session/history_pool.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/admission/refusals.h"
#include "server/session/testing/memory_map_store.h"

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;

class HistoryPoolTest : public ::testing::Test {
 protected:
  ~HistoryPoolTest() override { HistoryPool::LimitExtraReaders(std::numeric_limits<int>::max()); }

  // The pool of a new map.
  HistoryPool* Add(const std::string& map) {
    auto stored = MemoryMapStore(&disk_).Create({map, "map", absl::UnixEpoch(), ""});
    EXPECT_TRUE(stored.ok()) << stored.status();
    maps_.push_back(*std::move(stored));
    pools_.push_back(std::make_unique<HistoryPool>(maps_.back().get()));
    return pools_.back().get();
  }

  // Takes `count` readers, which must be there.
  static std::vector<HistoryPool::Lease> Take(HistoryPool* pool, int count) {
    std::vector<HistoryPool::Lease> leases;
    for (int i = 0; i < count; ++i) {
      auto lease = pool->Take();
      EXPECT_TRUE(lease.ok()) << lease.status();
      if (lease.ok()) leases.push_back(*std::move(lease));
    }
    return leases;
  }

  static void ExpectNoMore(HistoryPool* pool) {
    const absl::Status status = pool->Take().status();
    EXPECT_TRUE(admission::IsTryLater(status)) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("(ulimit -n)"));
  }

  MemoryDisk disk_;
  std::vector<std::unique_ptr<storage::StoredMap>> maps_;
  std::vector<std::unique_ptr<HistoryPool>> pools_;
};

TEST_F(HistoryPoolTest, EachPoolHasOneReaderAndAllShareFurtherOnes) {
  HistoryPool::LimitExtraReaders(3);
  HistoryPool* const office = Add("office");
  HistoryPool* const lab = Add("lab");
  const auto of_office = Take(office, 3);
  const auto of_lab = Take(lab, 2);
  ExpectNoMore(office);
  ExpectNoMore(lab);
  const auto of_attic = Take(Add("attic"), 1);
}

TEST_F(HistoryPoolTest, ReturnedReadersAreLentAgain) {
  HistoryPool::LimitExtraReaders(19);
  HistoryPool* const office = Add("office");
  // More than are kept idle.
  for (int round = 0; round < 3; ++round) {
    const auto leases = Take(office, 20);
    ExpectNoMore(office);
  }
}

TEST_F(HistoryPoolTest, MapReadsItsHistoryWhenClientsHoldAllReaders) {
  HistoryPool::LimitExtraReaders(1);
  HistoryPool* const office = Add("office");
  std::optional<std::vector<HistoryPool::Lease>> of_clients = Take(office, 2);
  for (int round = 0; round < 3; ++round) {
    const auto reserved = office->TakeReserved();
    ASSERT_TRUE(reserved.ok()) << reserved.status();
    EXPECT_TRUE((*reserved)->Kept().ok());
    ExpectNoMore(office);
  }
  // Clients do not get that reader when it is returned, nor lose one of theirs.
  ExpectNoMore(office);
  of_clients.reset();
  of_clients = Take(office, 2);
  ExpectNoMore(office);
}

TEST_F(HistoryPoolTest, ReservedReaderIsOneOfTheMapsWhileItHasOneLeft) {
  HistoryPool::LimitExtraReaders(0);
  HistoryPool* const office = Add("office");
  EXPECT_TRUE(office->TakeReserved().ok());
  const auto of_clients = Take(office, 1);
  ExpectNoMore(office);
  office->Close();
  EXPECT_TRUE(absl::IsUnavailable(office->TakeReserved().status()));
}

// A closed reader may leave its file open until then.
TEST_F(HistoryPoolTest, OtherPoolsGetTheReadersOfOneThatIsClosed) {
  HistoryPool::LimitExtraReaders(19);
  Take(Add("office"), 20);
  HistoryPool* const lab = Add("lab");
  std::optional<std::vector<HistoryPool::Lease>> of_lab = Take(lab, 1);
  ExpectNoMore(lab);
  pools_.front()->Close();
  pools_.front().reset();
  const auto more = Take(lab, 19);
  ExpectNoMore(lab);
}

TEST_F(HistoryPoolTest, ClosedPoolGivesItsReadersBackWhenTheLastIsReturned) {
  HistoryPool::LimitExtraReaders(1);
  std::optional<std::vector<HistoryPool::Lease>> of_office = Take(Add("office"), 2);
  HistoryPool* const lab = Add("lab");
  const auto of_lab = Take(lab, 1);
  pools_.front()->Close();
  EXPECT_TRUE(absl::IsUnavailable(pools_.front()->Take().status()));
  pools_.front().reset();
  ExpectNoMore(lab);
  of_office.reset();
  EXPECT_TRUE(lab->Take().ok());
}

}  // namespace
}  // namespace hypermap::server
