#include "client_libs/bench/paced_worker.h"

#include <gtest/gtest.h>

#include <functional>
#include <utility>

#include "client_libs/testing/scripted_server.h"

namespace hypermap::bench {
namespace {

// Carries out operations by a function, which gets the number of the attempt from 0.
class FunctionWorker : public PacedWorker {
 public:
  using Function = std::function<absl::Status(int attempt, const RunTimes& times)>;

  FunctionWorker(const Load& load, client::Client client, double hz, Function function)
      : PacedWorker(OperationKind::kEdit, load, std::move(client), hz, RandomRole::kEdit, 0),
        function_(std::move(function)) {}

  absl::Status Open() override { return absl::OkStatus(); }
  int num_prepared() const { return num_prepared_; }
  int num_given_up() const { return num_given_up_; }

 private:
  void Prepare() override { ++num_prepared_; }
  absl::StatusOr<SteadyTime> Attempt(const RunTimes& times) override {
    const absl::Status status = function_(num_attempts_++, times);
    if (!status.ok()) return status;
    return SteadyTime::Now();
  }
  void GiveUp() override { ++num_given_up_; }

  const Function function_;
  int num_prepared_ = 0;
  int num_attempts_ = 0;
  int num_given_up_ = 0;
};

class PacedWorkerTest : public testing::Test {
 protected:
  // Runs the worker for 100 ms.
  OperationTotals Run(FunctionWorker& worker) {
    const SteadyTime start = SteadyTime::Now();
    const RunTimes times{start, start, start + absl::Milliseconds(100), start + absl::Seconds(30)};
    worker.recorder().Start(times);
    worker.Run(times);
    return worker.recorder().totals();
  }

  Load load() { return {options_, site_, outages_}; }
  client::Client client() { return client::Client(server_.address()); }

  client::ScriptedServer server_{client::Script()};
  const FleetOptions options_{.map = "site"};
  const ImaginedSite site_{1, 10};
  OutageLog outages_;
};

TEST_F(PacedWorkerTest, OperationIsTriedAgainUntilItIsAnswered) {
  FunctionWorker worker(load(), client(), 10.0, [](int attempt, const RunTimes&) {
    return attempt < 2 ? absl::UnavailableError("down") : absl::OkStatus();
  });
  const OperationTotals totals = Run(worker);
  EXPECT_EQ(totals.due, 1);
  EXPECT_EQ(totals.latencies.count(), 1);
  EXPECT_EQ(totals.errors, 2);
  EXPECT_EQ(totals.retries, 2);
  EXPECT_EQ(worker.num_prepared(), 1);
  EXPECT_EQ(worker.num_given_up(), 0);
  ASSERT_EQ(outages_.outages().size(), 1U);
  EXPECT_TRUE(outages_.outages()[0].all_back.has_value());
}

TEST_F(PacedWorkerTest, ErrorThatBlamesTheRequestIsFinal) {
  FunctionWorker worker(load(), client(), 10.0, [](int, const RunTimes&) {
    return absl::PermissionDeniedError("not yours");
  });
  const OperationTotals totals = Run(worker);
  EXPECT_EQ(totals.errors, 1);
  EXPECT_EQ(totals.retries, 0);
  EXPECT_EQ(totals.unanswered(), 1);
  EXPECT_EQ(worker.num_given_up(), 1);
  EXPECT_TRUE(outages_.outages().empty());
}

TEST_F(PacedWorkerTest, OperationsThatWaitForASlowOneAreMeasuredFromTheirOwnTimes) {
  FunctionWorker worker(load(), client(), 100.0, [](int, const RunTimes& times) {
    SleepUntil(times.end);
    return absl::OkStatus();
  });
  const OperationTotals totals = Run(worker);
  // Ten operations are due every 10 ms, and all are answered after 100 ms.
  EXPECT_EQ(totals.latencies.count(), 10);
  EXPECT_GE(totals.latencies.max(), absl::Milliseconds(90));
  EXPECT_GE(totals.latencies.Percentile(50.0), absl::Milliseconds(40));
  EXPECT_GE(totals.late, 8);
}

}  // namespace
}  // namespace hypermap::bench
