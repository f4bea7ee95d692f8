#include "client_libs/bench/server_numbers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace hypermap::bench {
namespace {

constexpr char kText[] =
    "# HELP process_cpu_seconds_total Time of processors that was used, in seconds.\n"
    "# TYPE process_cpu_seconds_total counter\n"
    "process_cpu_seconds_total 12.5\n"
    "process_open_fds 40\n"
    "process_resident_memory_bytes 1.5e+08\n"
    "process_start_time_seconds 1700000000.5\n"
    "process_threads 21\n"
    "hypermap_map_up{map=\"site\"} 1\n";

TEST(ServerNumbersTest, SampleIsReadFromTheMetrics) {
  const absl::StatusOr<ServerSample> sample = ParseServerSample(kText);
  ASSERT_TRUE(sample.ok()) << sample.status();
  EXPECT_EQ(sample->started_s, 1'700'000'000.5);
  EXPECT_EQ(sample->cpu_s, 12.5);
  EXPECT_EQ(sample->resident_bytes, 150'000'000);
  EXPECT_EQ(sample->threads, 21);
  EXPECT_EQ(sample->open_files, 40);
}

TEST(ServerNumbersTest, MissingMetricIsNamed) {
  const absl::Status status =
      ParseServerSample("process_start_time_seconds 1\nprocess_cpu_seconds_total 1\n").status();
  EXPECT_TRUE(absl::IsNotFound(status));
  EXPECT_THAT(std::string(status.message()), testing::HasSubstr("process_resident_memory_bytes"));
}

TEST(ServerNumbersTest, AddressMustHaveAPort) {
  for (const char* address : {"", "host", "http://host/metrics", ":80", "host:"}) {
    EXPECT_TRUE(absl::IsInvalidArgument(GetMetrics(address, absl::Seconds(1)).status())) << address;
  }
}

TEST(ServerNumbersTest, ServerThatIsNotThereIsUnavailable) {
  EXPECT_TRUE(
      absl::IsUnavailable(GetMetrics("http://127.0.0.1:1/metrics", absl::Seconds(1)).status()));
}

TEST(ServerNumbersTest, CpuTimeCountsOverARestart) {
  const SteadyTime start = SteadyTime::Now();
  ServerNumbers numbers;
  numbers.Add({1000, 0.5, 100, 5, 7}, start);
  numbers.Add({1001, 3.5, 300, 6, 7}, start + absl::Seconds(5));
  // The new process may have used more time than the old one.
  numbers.Add({1008, 4.0, 50, 4, 7}, start + absl::Seconds(10));
  numbers.Add({1008, 4.5, 80, 4, 7}, start + absl::Seconds(15));
  EXPECT_EQ(numbers.num_samples, 4);
  EXPECT_EQ(numbers.num_restarts, 1);
  EXPECT_EQ(numbers.cpu_s, 7.5);
  EXPECT_EQ(numbers.elapsed_s, 15.0);
  EXPECT_EQ(numbers.first.resident_bytes, 100);
  EXPECT_EQ(numbers.last.resident_bytes, 80);
  EXPECT_EQ(numbers.max_resident_bytes, 300);
}

}  // namespace
}  // namespace hypermap::bench
