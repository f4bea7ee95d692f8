#include "client_libs/bench/revisions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <set>

namespace hypermap::bench {
namespace {

RevisionSet SetOf(Revision after, const std::set<Revision>& revisions) {
  RevisionSet set(after);
  for (const Revision revision : revisions) set.Add(revision);
  return set;
}

TEST(RevisionSetTest, EqualsASetOfNumbers) {
  std::mt19937 random(5);
  std::uniform_int_distribution<Revision> any(1, 300);
  for (int round = 0; round < 50; ++round) {
    const Revision after = any(random) / 3;
    std::set<Revision> expected;
    std::set<Revision> other;
    RevisionSet set(after);
    for (int i = 0; i < 100; ++i) {
      const Revision revision = after + any(random);
      EXPECT_EQ(set.Add(revision), expected.insert(revision).second);
      other.insert(after + any(random));
    }
    EXPECT_EQ(set.size(), static_cast<int64_t>(expected.size()));
    EXPECT_EQ(set.last(), *expected.rbegin());
    for (Revision r = 0; r <= after + 301; ++r) EXPECT_EQ(set.Has(r), expected.count(r) == 1) << r;
    int64_t missing = 0;
    for (const Revision r : other) missing += !expected.count(r);
    EXPECT_EQ(set.CountMissing(SetOf(after, other)), missing);
  }
}

TEST(RevisionSetTest, RevisionsBeforeItsFirstAreNotKept) {
  RevisionSet set(10);
  EXPECT_TRUE(set.Add(10));
  EXPECT_TRUE(set.Add(10));
  EXPECT_EQ(set.size(), 0);
  EXPECT_EQ(set.last(), 10);
}

TEST(WatchTrackTest, RevisionsInOrderHaveNoFaults) {
  WatchTrack track(3);
  track.Note(3, false);
  for (const Revision revision : {4, 5, 7}) track.Note(revision, true);
  track.Note(7, false);
  track.Note(9, false);
  EXPECT_EQ(track.last(), 9);
  EXPECT_EQ(track.num_seen(), 3);
  EXPECT_EQ(track.faults().repeated, 0);
  EXPECT_EQ(track.faults().reordered, 0);
  EXPECT_EQ(track.CountMissing(SetOf(3, {4, 5, 7})), 0);
}

TEST(WatchTrackTest, GapsAreFoundByTheRevisionsOfTheServer) {
  WatchTrack track(3);
  for (const Revision revision : {4, 7}) track.Note(revision, true);
  track.Note(9, false);
  EXPECT_EQ(track.CountMissing(SetOf(3, {4, 5, 7, 8, 9})), 3);
}

TEST(WatchTrackTest, RepeatedRevisionIsAFault) {
  WatchTrack track(0);
  for (const Revision revision : {1, 2, 2}) track.Note(revision, true);
  EXPECT_EQ(track.faults().repeated, 1);
  EXPECT_EQ(track.faults().reordered, 0);
}

TEST(WatchTrackTest, OlderRevisionIsAFault) {
  WatchTrack track(0);
  for (const Revision revision : {1, 3, 2}) track.Note(revision, true);
  EXPECT_EQ(track.faults().repeated, 0);
  EXPECT_EQ(track.faults().reordered, 1);
  EXPECT_EQ(track.last(), 3);
  track.Note(2, false);
  EXPECT_EQ(track.faults().reordered, 2);
}

TEST(RevisionTimesTest, TimesAreKnownOnceAWatcherHasThem) {
  const absl::Time time = absl::FromUnixSeconds(1000);
  RevisionTimes times(5);
  EXPECT_TRUE(times.IsSettled(5));
  EXPECT_FALSE(times.IsSettled(6));
  times.Note(6, time);
  times.Note(8, time + absl::Seconds(2));
  EXPECT_TRUE(times.IsSettled(8));
  EXPECT_FALSE(times.IsSettled(9));
  EXPECT_EQ(times.TimeOf(6), time);
  EXPECT_EQ(times.TimeOf(7), std::nullopt);
  EXPECT_EQ(times.TimeOf(8), time + absl::Seconds(2));
  // Another watcher is told that the revision has nothing for it.
  times.Note(8, std::nullopt);
  EXPECT_EQ(times.TimeOf(8), time + absl::Seconds(2));
  EXPECT_EQ(times.TimeOf(5), std::nullopt);
}

}  // namespace
}  // namespace hypermap::bench
