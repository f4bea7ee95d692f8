#include "storage/interchange/repair_log.h"

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace hypermap::storage {
namespace {

using ::testing::ElementsAre;
using ::testing::SizeIs;

TEST(RepairLogTest, KeepsTheBeginningOfALongLine) {
  RepairLog log;
  log.Add(std::string(100'000, 'x'));
  log.Add(std::string(RepairLog::kMaxLineBytes, 'y'));
  EXPECT_THAT(std::move(log).Take(),
              ElementsAre(std::string(RepairLog::kMaxLineBytes - 3, 'x') + "...",
                          std::string(RepairLog::kMaxLineBytes, 'y')));
}

TEST(RepairLogTest, MakesOnlyTheLinesThatItKeeps) {
  RepairLog log;
  size_t num_made = 0;
  for (size_t i = 0; i < RepairLog::kMaxLines + 500; ++i) {
    log.Add([&num_made] {
      ++num_made;
      return std::string("a line");
    });
  }
  EXPECT_EQ(num_made, RepairLog::kMaxLines);
  const std::vector<std::string> lines = std::move(log).Take();
  EXPECT_THAT(lines, SizeIs(RepairLog::kMaxLines + 1));
  EXPECT_EQ(lines.back(), "and 500 repairs more");
}

}  // namespace
}  // namespace hypermap::storage
