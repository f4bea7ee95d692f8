#include "server/session/map_time.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "base/time/testing/manual_clock.h"
#include "tests/support/random_map.h"

namespace hypermap::server {
namespace {

constexpr absl::Duration kYear = absl::Hours(24 * 365);

// The time of a map, as its writer uses it, with the marks that are stored.
class MapTimeTest : public ::testing::Test {
 protected:
  MapTimeTest() { Start(); }

  // Starts the server, or starts it again without having closed the map.
  void Start() {
    clock_ = std::make_shared<ServerClock>(&machine_);
    time_ = std::make_unique<MapTime>(clock_, stored_, newest_commit_);
  }
  void Close() { Store(time_->MarkForRestart(newest_, /*closing=*/true)); }
  void Store(const std::optional<storage::TimeMark>& mark) {
    if (mark) stored_.push_back(*mark);
  }
  // Does the maintenance that the writer does at least once a minute.
  void Maintain() {
    time_->ReadClocks();
    Store(time_->MarkForRestart(newest_, /*closing=*/false));
  }
  void Pass(absl::Duration time, absl::Duration step = absl::Minutes(1)) {
    for (; time > absl::ZeroDuration(); time -= step) {
      machine_.Advance(std::min(step, time));
      Maintain();
    }
  }
  absl::Time Commit() {
    Store(time_->MarkBeforeCommit(newest_));
    ++newest_;
    newest_commit_ = time_->NextCommit();
    return newest_commit_;
  }
  // Commits an object that is to live for so long.
  SemanticObject Put(absl::Duration time_to_live) {
    SemanticObject object;
    object.expires_at = Commit() + time_to_live;
    object.version = newest_;
    return object;
  }
  absl::Duration Left(const SemanticObject& object) {
    return time_->EndOf(object) - time_->Lived();
  }
  bool IsOlder(absl::Time commit, absl::Duration age) {
    return commit <= time_->CommitTimeBefore(age);
  }

  ManualClock machine_;
  std::vector<storage::TimeMark> stored_;
  Revision newest_ = 0;
  absl::Time newest_commit_ = machine_.Wall();
  std::shared_ptr<ServerClock> clock_;
  std::unique_ptr<MapTime> time_;
};

TEST_F(MapTimeTest, C1WithoutJumpsEverythingIsByTheWallClock) {
  const absl::Time begin = machine_.Wall();
  EXPECT_EQ(Commit(), begin);
  const SemanticObject cup = Put(absl::Hours(2));
  Pass(absl::Hours(1));
  EXPECT_EQ(time_->Now(), begin + absl::Hours(1));
  EXPECT_TRUE(IsOlder(begin, absl::Hours(1)));
  EXPECT_FALSE(IsOlder(begin, absl::Hours(1) + absl::Seconds(1)));
  EXPECT_EQ(Left(cup), absl::Hours(1));
  EXPECT_FALSE(time_->IsOver(cup));
  Pass(absl::Hours(1));
  EXPECT_TRUE(time_->IsOver(cup));
  EXPECT_EQ(time_->EndOf(SemanticObject()), absl::InfiniteDuration());
  // One before the first commit, and one an hour.
  EXPECT_EQ(stored_.size(), 3u);
}

TEST_F(MapTimeTest, C1YearAheadForTwoMinutesChangesNothing) {
  const absl::Time before = Commit();
  const SemanticObject old = Put(absl::Minutes(5));
  machine_.Jump(kYear);
  const absl::Time during = Commit();
  EXPECT_EQ(during, before);
  const SemanticObject young = Put(absl::Minutes(5));
  Pass(absl::Minutes(2), absl::Seconds(1));
  EXPECT_FALSE(IsOlder(before, absl::Minutes(3)));
  EXPECT_EQ(Left(young), absl::Minutes(3));
  machine_.Jump(-kYear);
  Pass(absl::Minutes(2), absl::Seconds(1));
  EXPECT_EQ(Commit(), before + absl::Minutes(4));
  EXPECT_EQ(Left(old), absl::Minutes(1));
  EXPECT_EQ(Left(young), absl::Minutes(1));
  EXPECT_FALSE(IsOlder(before, absl::Minutes(5)));
  EXPECT_TRUE(IsOlder(during, absl::Minutes(4)));
  EXPECT_EQ(stored_.size(), 1u);
}

TEST_F(MapTimeTest, C1JumpThatIsFollowedAgesNothing) {
  for (const absl::Duration jump : {kYear, -kYear}) {
    const absl::Time before = Commit();
    const SemanticObject old = Put(absl::Hours(2));
    machine_.Jump(jump);
    Pass(absl::Hours(1));
    const absl::Time after = Commit();
    const SemanticObject young = Put(absl::Hours(2));
    EXPECT_GT(after, before);
    Pass(absl::Minutes(30));
    for (const bool restarted : {false, true}) {
      SCOPED_TRACE(restarted);
      if (restarted) Start();
      EXPECT_LE(absl::AbsDuration(Left(old) - absl::Minutes(30)), absl::Seconds(1));
      EXPECT_LE(absl::AbsDuration(Left(young) - absl::Minutes(90)), absl::Seconds(1));
      EXPECT_FALSE(IsOlder(before, absl::Minutes(91)));
      EXPECT_TRUE(IsOlder(before, absl::Minutes(89)));
      EXPECT_FALSE(IsOlder(after, absl::Minutes(31)));
      EXPECT_TRUE(IsOlder(after, absl::Minutes(29)));
    }
  }
}

TEST_F(MapTimeTest, C1CommitTimesComeBackAfterAJumpThatWasFollowed) {
  machine_.Jump(absl::Hours(5));
  Pass(absl::Minutes(30));
  const absl::Time ahead = Commit();
  machine_.Jump(-absl::Hours(5));
  Pass(absl::Minutes(30));
  const absl::Time first = Commit();
  const absl::Time second = Commit();
  EXPECT_EQ(first, ahead + absl::Microseconds(1));
  EXPECT_EQ(second, ahead + absl::Microseconds(2));
  // Each commit of the time in which commit times stand still has its own age.
  Pass(absl::Minutes(30));
  EXPECT_FALSE(IsOlder(first, absl::Minutes(31)));
  EXPECT_TRUE(IsOlder(ahead, absl::Minutes(59)));
  const absl::Time third = Commit();
  EXPECT_EQ(third, ahead + absl::Microseconds(3));
  Pass(absl::Minutes(10));
  EXPECT_TRUE(IsOlder(second, absl::Minutes(39)));
  EXPECT_FALSE(IsOlder(third, absl::Minutes(11)));
  Pass(absl::Hours(4));
  EXPECT_EQ(Commit(), machine_.Wall());
}

TEST_F(MapTimeTest, C1FrozenWallClockStopsNothing) {
  const absl::Time before = Commit();
  const SemanticObject cup = Put(absl::Hours(2));
  machine_.Freeze(true);
  Pass(absl::Hours(2) + absl::Seconds(1));
  EXPECT_TRUE(time_->IsOver(cup));
  EXPECT_TRUE(IsOlder(before, absl::Hours(2)));
  EXPECT_LE(absl::AbsDuration(Commit() - before - absl::Hours(2)), absl::Seconds(2));
}

TEST_F(MapTimeTest, C1RestartWhileTheClockIsAYearAhead) {
  const absl::Time before = Commit();
  const SemanticObject cup = Put(absl::Hours(1));
  machine_.Jump(kYear);
  for (const bool closes : {true, false}) {
    if (closes) Close();
    machine_.Advance(absl::Minutes(1));
    Start();
    EXPECT_LE(Commit() - before, absl::Minutes(2));
  }
  EXPECT_EQ(Left(cup), absl::Minutes(58));
  EXPECT_FALSE(IsOlder(before, absl::Minutes(3)));
  machine_.Jump(-kYear);
  Pass(absl::Minutes(57));
  EXPECT_FALSE(time_->IsOver(cup));
  Pass(absl::Minutes(1));
  EXPECT_TRUE(time_->IsOver(cup));
  EXPECT_EQ(Commit() - before, absl::Minutes(60));
}

TEST_F(MapTimeTest, C1TimeWhileTheServerWasDownCounts) {
  const absl::Time before = Commit();
  const SemanticObject cup = Put(absl::Hours(100));
  Close();
  machine_.Advance(absl::Hours(99));
  Start();
  EXPECT_EQ(Left(cup), absl::Hours(1));
  EXPECT_TRUE(IsOlder(before, absl::Hours(99)));
}

TEST_F(MapTimeTest, C1TimeWhileTheMachineWasOffEndsObjectsButLetsNothingGo) {
  const absl::Time before = Commit();
  SemanticObject cup = Put(absl::Hours(10));
  machine_.Advance(absl::Minutes(30));
  machine_.Reboot(absl::Minutes(20));
  Start();
  // Half an hour is known from the wall clock only, because the server was killed.
  EXPECT_EQ(Left(cup), absl::Hours(10) - absl::Minutes(50));
  EXPECT_FALSE(IsOlder(before, absl::Minutes(1)));
  Pass(absl::Minutes(10));
  Close();
  // A long time off is believed when the wall clock has been in step for a while.
  machine_.Reboot(absl::Hours(8));
  Start();
  EXPECT_EQ(Left(cup), absl::Hours(9));
  Pass(ServerClock::kSettle);
  EXPECT_EQ(Left(cup), absl::Hours(1) - ServerClock::kSettle);
  EXPECT_FALSE(IsOlder(before, absl::Minutes(21)));
  EXPECT_TRUE(IsOlder(before, absl::Minutes(19)));
  // It is also counted after one more restart.
  Commit();
  Start();
  EXPECT_EQ(Left(cup), absl::Hours(1) - ServerClock::kSettle);
}

TEST_F(MapTimeTest, C1WallClockThatIsWrongAfterABootIsNotBelieved) {
  const absl::Time before = Commit();
  const SemanticObject cup = Put(absl::Hours(2));
  Close();
  for (const absl::Duration wrong : {kYear, -kYear}) {
    machine_.Reboot(absl::Minutes(1) + wrong);
    Start();
    Pass(absl::Minutes(2));
    machine_.Jump(-wrong);
    Pass(absl::Minutes(2));
    EXPECT_FALSE(time_->IsOver(cup));
    EXPECT_FALSE(IsOlder(before, absl::Minutes(9)));
    Close();
  }
  Pass(ServerClock::kSettle);
  const absl::Duration real = absl::Minutes(20);
  EXPECT_LE(absl::AbsDuration(Left(cup) - (absl::Hours(2) - real)), absl::Minutes(3));
}

TEST_F(MapTimeTest, C1MapThatWasSpoiledByAJumpExpiresItsObjects) {
  // Version 0.1 made a commit while the clock was a year ahead, and stored no marks.
  newest_ = 7;
  newest_commit_ = machine_.Wall() + kYear;
  SemanticObject cup;
  cup.version = 7;
  cup.expires_at = newest_commit_ + absl::Hours(1);
  Start();
  EXPECT_EQ(Left(cup), absl::Hours(1));
  const SemanticObject young = Put(absl::Hours(1));
  EXPECT_EQ(newest_commit_, machine_.Wall() + kYear + absl::Microseconds(1));
  Pass(absl::Minutes(59));
  EXPECT_FALSE(time_->IsOver(young));
  Start();
  Pass(absl::Minutes(1) + absl::Seconds(1));
  EXPECT_TRUE(time_->IsOver(cup));
  EXPECT_TRUE(time_->IsOver(young));
}

TEST_F(MapTimeTest, C1MarkThatCouldNotBeStoredIsMadeAgain) {
  ASSERT_TRUE(time_->MarkBeforeCommit(0).has_value());
  EXPECT_FALSE(time_->MarkBeforeCommit(0).has_value());
  time_->MarkIsLost();
  EXPECT_TRUE(time_->MarkBeforeCommit(0).has_value());
  EXPECT_FALSE(time_->MarkForRestart(0, /*closing=*/false).has_value());
  time_->MarkIsLost();
  EXPECT_TRUE(time_->MarkForRestart(0, /*closing=*/false).has_value());
  EXPECT_TRUE(time_->MarkForRestart(0, /*closing=*/true).has_value());
}

TEST_F(MapTimeTest, C1MarksThatNoAgeNeedsAreForgotten) {
  const SemanticObject old = Put(absl::Hours(100));
  Pass(absl::Hours(20));
  const absl::Time commit = Commit();
  const SemanticObject young = Put(absl::Hours(100));
  Pass(absl::Hours(2));
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(Left(old), absl::Hours(78));
    EXPECT_EQ(Left(young), absl::Hours(98));
    EXPECT_TRUE(IsOlder(commit, absl::Hours(2)));
    EXPECT_FALSE(IsOlder(commit, absl::Hours(2) + absl::Seconds(1)));
    time_->MarkIsStored(time_->Passed() - absl::Hours(3));
  }
}

// A random life of a server and its machine, against the time that really passed.
TEST_F(MapTimeTest, C1NothingIsEarlyAndObjectsEndInTimeInARandomLife) {
  struct Made {
    absl::Time commit;
    absl::Duration at;
    SemanticObject object;
  };
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  hypermap::testing::Rng rng(seed);
  const auto random = [&](int low, int high) {
    return hypermap::testing::UniformInt(rng, low, high);
  };
  std::vector<Made> made;
  absl::Duration passed;
  const auto pass = [&](absl::Duration time) {
    Pass(time);
    passed += time;
  };
  for (int i = 0; i < 600; ++i) {
    switch (random(0, 9)) {
      case 0:
        machine_.Jump(absl::Seconds(random(-100'000, 100'000)));
        break;
      case 1:
        machine_.Jump(random(0, 1) == 0 ? kYear : -kYear);
        break;
      case 2:
        machine_.Freeze(random(0, 1) == 0);
        break;
      case 3:
        if (random(0, 1) == 0) Close();
        machine_.Advance(absl::Minutes(5));
        passed += absl::Minutes(5);
        Start();
        break;
      default:
        pass(absl::Seconds(random(0, 1800)));
    }
    const absl::Duration time_to_live = absl::Seconds(random(1, 20'000));
    const absl::Time last = newest_commit_;
    const SemanticObject object = Put(time_to_live);
    EXPECT_GE(newest_commit_, last);
    made.push_back({newest_commit_, passed, object});
    const absl::Duration age = absl::Seconds(random(0, 50'000));
    const absl::Time bound = time_->CommitTimeBefore(age);
    for (const Made& m : made) {
      // Marks are exact to a second, or to ten while commit times stand still.
      if (m.commit <= bound) EXPECT_GE(passed - m.at, age - absl::Seconds(2));
      if (m.commit > bound) EXPECT_LE(passed - m.at, age + absl::Minutes(1));
      const absl::Duration left = *m.object.expires_at - m.commit - (passed - m.at);
      EXPECT_LE(absl::AbsDuration(Left(m.object) - left), absl::Seconds(15));
    }
    if (HasFailure()) return;
  }
}

}  // namespace
}  // namespace hypermap::server
