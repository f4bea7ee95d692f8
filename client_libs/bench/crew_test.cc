#include "client_libs/bench/crew.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>

namespace hypermap::bench {
namespace {

// Connects at the third attempt, and runs until it is stopped.
class FollowingWorker : public Worker {
 public:
  explicit FollowingWorker(int failures) : Worker(OperationKind::kPoints), failures_(failures) {}

  absl::Status Open() override {
    if (failures_-- > 0) return absl::ResourceExhaustedError("too many connections");
    return absl::OkStatus();
  }
  void Run(const RunTimes& times) override {
    has_run_ = true;
    begun_at_ = times.start;
    const MutexLock lock(&mutex_);
    while (!stopped_) changed_.Wait(&mutex_);
  }
  void Stop() override {
    const MutexLock lock(&mutex_);
    stopped_ = true;
    changed_.NotifyAll();
  }

  bool has_run() const { return has_run_; }
  SteadyTime begun_at() const { return begun_at_; }

 private:
  int failures_;
  std::atomic<bool> has_run_ = false;
  SteadyTime begun_at_ = SteadyTime::InfinitePast();
  Mutex mutex_;
  CondVar changed_;
  bool stopped_ ABSL_GUARDED_BY(mutex_) = false;
};

TEST(CrewTest, WorkersBeginWhenAllHaveConnected) {
  Crew crew;
  std::vector<FollowingWorker*> workers(8);
  for (size_t i = 0; i < workers.size(); ++i) {
    workers[i] = crew.Add(std::make_unique<FollowingWorker>(i % 3));
  }
  ASSERT_TRUE(crew.Connect(absl::Minutes(1)).ok());
  for (const FollowingWorker* worker : workers) EXPECT_FALSE(worker->has_run());
  RunTimes times;
  times.start = SteadyTime::Now();
  crew.Begin(times);
  for (FollowingWorker* worker : workers) worker->Stop();
  crew.Finish();
  for (const FollowingWorker* worker : workers) {
    EXPECT_TRUE(worker->has_run());
    EXPECT_EQ(worker->begun_at(), times.start);
  }
}

TEST(CrewTest, WorkerThatCannotConnectIsAnError) {
  Crew crew;
  crew.Add(std::make_unique<FollowingWorker>(0));
  crew.Add(std::make_unique<FollowingWorker>(1'000'000));
  const absl::Status status = crew.Connect(absl::Milliseconds(200));
  EXPECT_TRUE(absl::IsResourceExhausted(status)) << status;
  EXPECT_THAT(std::string(status.message()), testing::HasSubstr("only 1 of 2 streams"));
  EXPECT_THAT(std::string(status.message()), testing::HasSubstr("too many connections"));
}

TEST(CrewTest, EndsItsThreadsWhenItIsDestroyed) {
  Crew crew;
  crew.Add(std::make_unique<FollowingWorker>(0));
  ASSERT_TRUE(crew.Connect(absl::Minutes(1)).ok());
  crew.Begin({});
}

}  // namespace
}  // namespace hypermap::bench
