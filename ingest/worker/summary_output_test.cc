#include "ingest/worker/summary_output.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "ingest/worker/progress_line.h"

namespace hypermap::ingest {
namespace {

using testing::HasSubstr;
using testing::Not;

ReplaySummary Half() {
  ReplaySummary summary;
  summary.frames = 10;
  summary.known = 1;
  summary.accepted = 3;
  summary.skipped_frames = {{"bad pose", 1}};
  summary.skipped_instances = {{"broken mask", 7}};
  summary.instances = 20;
  summary.detections = 13;
  summary.revision = 42;
  summary.time = absl::Seconds(2);
  return summary;
}
TargetLayer Target() {
  TargetLayer target;
  target.map = "office";
  return target;
}

TEST(SummaryOutputTest, JsonHasEveryCount) {
  const auto json = nlohmann::json::parse(SummaryJson(Half(), Target()));
  EXPECT_EQ(json["map"], "office");
  EXPECT_EQ(json["layer"], "semantic");
  EXPECT_EQ(json["frames"], 10);
  EXPECT_EQ(json["known"], 1);
  EXPECT_EQ(json["accepted"], 3);
  EXPECT_EQ(json["skipped"], 1);
  EXPECT_EQ(json["skipped_frames"]["bad pose"], 1);
  EXPECT_EQ(json["skipped_instances"]["broken mask"], 7);
  EXPECT_EQ(json["revision"], 42);
  EXPECT_EQ(json["interrupted"], false);
}

TEST(SummaryOutputTest, TextTellsWhatIsNotZero) {
  const std::string text = SummaryText(Half(), Target());
  EXPECT_THAT(text,
              HasSubstr("office/semantic: 10 frames: 3 accepted, 1 already stored, 1 skipped, "
                        "5 not processed\n"));
  EXPECT_THAT(text, HasSubstr("skipped frames: 1 bad pose\n"));
  EXPECT_THAT(text, HasSubstr("skipped instances: 7 broken mask\n"));
  EXPECT_THAT(text, Not(HasSubstr("conflict")));
}

TEST(ProgressBarTest, IsAsFullAsTheShareSays) {
  EXPECT_EQ(ProgressBar(0.0), "[------------------------]   0 %");
  EXPECT_EQ(ProgressBar(0.5), "[############------------]  50 %");
  EXPECT_EQ(ProgressBar(1.0), "[########################] 100 %");
}

TEST(ProgressTextTest, TellsShareRateAndTimeLeft) {
  // The server already had one of the five finished frames; the other four took 2 s. Five are left.
  EXPECT_EQ(ProgressText(Half()),
            "[############------------]  50 %  5/10 frames  2.0/s  0:02 left  1 skipped");
  EXPECT_THAT(ProgressText(ReplaySummary()), HasSubstr("100 %  0/0 frames"));
}

}  // namespace
}  // namespace hypermap::ingest
