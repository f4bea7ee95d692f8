#include "ingest/worker/ordered_pipeline.h"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>

#include "absl/synchronization/notification.h"

namespace hypermap::ingest {
namespace {

TEST(OrderedPipelineTest, ResultsComeInOrderWhateverTheOrderOfWork) {
  constexpr size_t kItems = 500;
  // Even items wait for the odd item after them, so that pairs finish in reverse order.
  std::vector<std::unique_ptr<absl::Notification>> done(kItems + 1);
  for (auto& notification : done) notification = std::make_unique<absl::Notification>();
  done[kItems]->Notify();
  OrderedPipeline<size_t> pipeline(kItems, 2, 4, [&](size_t i) {
    if (i % 2 == 0 && i + 1 < kItems) done[i + 1]->WaitForNotification();
    done[i]->Notify();
    return i * i;
  });
  for (size_t i = 0; i < kItems; ++i) EXPECT_EQ(pipeline.Next(), i * i);
  EXPECT_EQ(pipeline.Next(), std::nullopt);
  EXPECT_EQ(pipeline.Next(), std::nullopt);
}

TEST(OrderedPipelineTest, ASlowTakerBoundsTheWork) {
  constexpr size_t kWindow = 3;
  std::atomic<size_t> begun = 0;
  size_t most_ahead = 0;
  OrderedPipeline<size_t> pipeline(100, 4, kWindow, [&](size_t i) {
    ++begun;
    return i;
  });
  for (size_t taken = 0; pipeline.Next(); ++taken) {
    // Item `taken` has been taken, so that items below taken + 1 + kWindow may have begun.
    most_ahead = std::max<size_t>(most_ahead, begun - taken);
  }
  EXPECT_LE(most_ahead, kWindow + 1);
  EXPECT_EQ(begun, 100u);
}

TEST(OrderedPipelineTest, AnEarlyEndMakesNoMoreCalls) {
  std::atomic<int> calls = 0;
  {
    OrderedPipeline<int> pipeline(1000, 2, 4, [&](size_t) { return ++calls; });
    EXPECT_TRUE(pipeline.Next().has_value());
  }
  EXPECT_LE(calls, 5);
  OrderedPipeline<int> unused(1000, 2, 4, [&](size_t) { return 0; });
}

TEST(OrderedPipelineTest, WithoutItemsThereIsNothing) {
  OrderedPipeline<int> pipeline(0, 2, 4, [](size_t) { return 0; });
  EXPECT_EQ(pipeline.Next(), std::nullopt);
}

}  // namespace
}  // namespace hypermap::ingest
