// What the conformance suites can't see: the order of text, large content, damage and costs.
#include "storage/postgres/fusion_log.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "storage/postgres/evidence_retention.h"
#include "storage/postgres/fusion_changes.h"
#include "storage/postgres/testing/written_map.h"

namespace hypermap::storage::postgres {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

ObservationKey Key(int64_t stamp_ns, const std::string& robot, int64_t sequence) {
  return {absl::FromUnixNanos(stamp_ns), robot, sequence};
}

LoggedObservation Logged(const ObservationKey& key, std::string body) {
  return {key, /*content_hash=*/0xfedcba9876543210, absl::FromUnixNanos(5), std::move(body)};
}

std::string RandomBytes(size_t size) {
  std::mt19937 random(7);
  std::string bytes(size, '\0');
  for (char& byte : bytes) byte = static_cast<char>(random());
  return bytes;
}

class PostgresFusionLogTest : public WrittenMapTest {
 protected:
  void SetUp() override {
    WrittenMapTest::SetUp();
    if (IsSkipped()) return;
    log_ = std::make_unique<PostgresFusionLog>(owned_.get());
  }

  absl::Status Write(const FusionChange& change) {
    return owned_->Write([&](Pipeline& pipeline) {
      AddFusionChange(pipeline, owned_->map(), change);
      return absl::OkStatus();
    });
  }

  std::vector<std::string> Bodies(const LogKey& after = BeforeAll()) {
    const auto entries = log_->Read("things", after, 100);
    EXPECT_TRUE(entries.ok()) << entries.status();
    std::vector<std::string> bodies;
    for (const LogEntry& entry : *entries) bodies.push_back(entry.body);
    return bodies;
  }

  // The pages of tables and indexes that `work` of the owner looks at.
  template <typename Work>
  int64_t PagesSeen(Work work) {
    const int64_t before = PagesSeen();
    work();
    return PagesSeen() - before;
  }

  std::unique_ptr<PostgresFusionLog> log_;

 private:
  int64_t PagesSeen() {
    EXPECT_TRUE((*owned_->connection())->Execute("SELECT pg_stat_force_next_flush()").ok());
    const auto pages = connection_->QueryInt64(
        "SELECT sum(heap_blks_read + heap_blks_hit + idx_blks_read + idx_blks_hit)::bigint "
        "FROM pg_statio_user_tables");
    EXPECT_TRUE(pages.ok() && *pages) << pages.status();
    return **pages;
  }
};

TEST_F(PostgresFusionLogTest, TextIsOrderedByItsBytes) {
  const std::vector<std::string> robots = {"B", "Z", "_", "a", "b", "\xc3\xa9"};
  FusionChange change{.layer = "things"};
  for (const std::string& robot : robots) {
    change.observations.push_back(Logged(Key(1, robot, 0), robot));
    change.tracks.emplace_back(robot, 1);
  }
  std::reverse(change.observations.begin(), change.observations.end());
  ASSERT_TRUE(Write(change).ok());
  EXPECT_EQ(Bodies(), robots);
  EXPECT_THAT(Bodies({Key(1, "_", 0), 0}), ElementsAre("a", "b", "\xc3\xa9"));
  EXPECT_EQ(log_->NewestKey("things")->value().robot, "\xc3\xa9");
  EXPECT_EQ(*log_->Tracks("things"), change.tracks);
  ASSERT_TRUE(log_->KeepCheckpoint("things", {{Key(1, "a", 0), 0}, "", {}}, {}).ok());
  ASSERT_TRUE(Write({.layer = "things", .stale_from = LogKey{Key(1, "_", 0), 0}}).ok());
  EXPECT_TRUE(log_->Checkpoints("things")->empty());
}

TEST_F(PostgresFusionLogTest, LargeChangeComesBack) {
  FusionChange change{.layer = "things"};
  for (int i = 0; i < 2500; ++i) {
    change.observations.push_back(Logged(Key(i, "a", i), absl::StrCat(i)));
    change.facts.push_back({{Key(i, "a", i), i + 1}, "pin", "t", absl::StrCat("fact ", i)});
  }
  const std::string large = RandomBytes(9 << 20);
  for (int i = 2500; i < 2503; ++i) {
    change.observations.push_back(Logged(Key(i, "a", i), large));
  }
  ASSERT_TRUE(Write(change).ok());
  const auto entries = log_->Read("things", BeforeAll(), 10'000);
  ASSERT_TRUE(entries.ok()) << entries.status();
  ASSERT_EQ(entries->size(), 5003u);
  for (int i = 0; i < 2500; ++i) {
    EXPECT_EQ((*entries)[2 * i].body, absl::StrCat(i));
    EXPECT_EQ((*entries)[2 * i + 1].body, absl::StrCat("fact ", i));
  }
  EXPECT_TRUE(entries->back().body == large);
  EXPECT_THAT(*log_->Sequences("things", "a"), ElementsAre(SequenceRange{0, 2502}));
}

TEST_F(PostgresFusionLogTest, SequencesOfManyPagesAreJoined) {
  // Gaps at 10,000, where a page ends, and at 19,999.
  Run(R"(INSERT INTO hypermap.observations SELECT $1, 'things', i, 'a', i, 0, false, 0, 0, ''
           FROM generate_series(0, 25000) AS i WHERE i NOT IN (10000, 19999))");
  EXPECT_THAT(*log_->Sequences("things", "a"),
              ElementsAre(SequenceRange{0, 9999}, SequenceRange{10001, 19998},
                          SequenceRange{20000, 25000}));
}

TEST_F(PostgresFusionLogTest, ChangeMayPutATrackTwice) {
  ASSERT_TRUE(Write({.layer = "things", .tracks = {{"t", 1}, {"u", 2}, {"t", 3}}}).ok());
  EXPECT_THAT(*log_->Tracks("things"), ElementsAre(TrackId{"t", 3}, TrackId{"u", 2}));
}

TEST_F(PostgresFusionLogTest, RetractionOfNothingFailsTheCommit) {
  ASSERT_TRUE(Write({.layer = "things", .observations = {Logged(Key(1, "a", 0), "0")}}).ok());
  const absl::Status status =
      Write({.layer = "things", .retracted = {Key(1, "a", 0), Key(1, "b", 0)}});
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("an observation that is not there"));
  EXPECT_THAT(Bodies(), ElementsAre("0"));
  // The map is still owned. An observation may be named twice.
  ASSERT_TRUE(Write({.layer = "things", .retracted = {Key(1, "a", 0), Key(1, "a", 0)}}).ok());
  EXPECT_THAT(Bodies(), ElementsAre());
}

TEST_F(PostgresFusionLogTest, DamageIsNamed) {
  const LogKey key{Key(2, "a", 7), 0};
  ASSERT_TRUE(Write({.layer = "things", .observations = {Logged(key.after, "body")}}).ok());
  ASSERT_TRUE(log_->KeepCheckpoint("things", {key, "state", absl::FromUnixNanos(1)}, {}).ok());
  ASSERT_TRUE(log_->MoveBase("things", key).ok());
  ASSERT_TRUE(log_->KeepCheckpoint("things", {{key.after, 1}, "state", {}}, {}).ok());
  Run("UPDATE hypermap.observations SET body = '\\x00' WHERE map = $1");
  Run("UPDATE hypermap.fusion_checkpoints SET state = '\\x00' WHERE map = $1");
  Run("UPDATE hypermap.fusion_bases SET state_size = -1 WHERE map = $1");
  const struct {
    absl::Status status;
    const char* row;
  } cases[] = {
      {log_->Read("things", BeforeAll(), 1).status(), "hypermap.observations"},
      {log_->FindCheckpoint("things", std::nullopt).status(), "hypermap.fusion_checkpoints"},
      {log_->FindNextBase("things", absl::Now()).status(), "hypermap.fusion_checkpoints"},
      {log_->FindBase("things").status(), "hypermap.fusion_bases"},
  };
  for (const auto& c : cases) {
    EXPECT_EQ(c.status.code(), absl::StatusCode::kDataLoss) << c.status;
    EXPECT_THAT(std::string(c.status.message()),
                AllOf(HasSubstr(absl::StrCat(c.row, ", layer things, stamp_ns 2, robot a, ")),
                      HasSubstr("sequence 7, ")));
  }
}

// Each call is made often enough for the plan that is kept for many executions.
TEST_F(PostgresFusionLogTest, CostsDoNotGrowWithTheLog) {
  constexpr int kCalls = 20;
  constexpr int kMaxPagesOfCall = 60;
  // "old" has sent first, and "new" last. The newest are retracted. The bodies are empty, packed.
  Run(R"(INSERT INTO hypermap.observations
           SELECT $1, 'things', i, CASE WHEN i < 50000 THEN 'old' ELSE 'new' END, i, 0, i >= 99990,
               0, 0, '\x789c030000000001'
             FROM generate_series(0, 99999) AS i)");
  Run(R"(INSERT INTO hypermap.operator_facts
           SELECT $1, 'things', i, 'old', i, i, 'pin', 't', '' FROM generate_series(1, 20000) AS i)");
  Run(R"(INSERT INTO hypermap.forgotten_sequences
           SELECT $1, 'things', 'old', -2 * i, -2 * i FROM generate_series(1, 20000) AS i)");
  Run(R"(INSERT INTO hypermap.fusion_bases
           SELECT $1, 'things', 10000, 'old', 10000, 0, 10000, 0, '')");
  ASSERT_TRUE(connection_->Execute("VACUUM ANALYZE").ok());

  const struct {
    const char* name;
    std::function<absl::Status(int)> call;
  } cases[] = {
      {"NewestKey", [&](int) { return log_->NewestKey("things").status(); }},
      {"NewestFact", [&](int) { return log_->NewestFact("things").status(); }},
      {"NewestStamp of an old robot",
       [&](int) { return log_->NewestStamp("things", "old").status(); }},
      {"NewestStamp of a new robot",
       [&](int) { return log_->NewestStamp("things", "new").status(); }},
      {"NewestStamp of no robot", [&](int) { return log_->NewestStamp("things", "no").status(); }},
      {"FindObservation",
       [&](int i) { return log_->FindObservation("things", "old", 4000 * i).status(); }},
      {"FindObservation that is forgotten",
       [&](int i) { return log_->FindObservation("things", "old", -2000 * i - 1).status(); }},
      {"HasForgotten", [&](int) { return log_->HasForgotten("things", "new").status(); }},
      {"KeysOf",
       [&](int i) {
         const absl::Time from = absl::FromUnixNanos(2000 * i);
         return log_->KeysOf("things", "old", from, from + absl::Nanoseconds(10)).status();
       }},
      {"RemoveForgottenEvidence",
       [&](int) {
         return owned_->WriteInSteps([&](Connection& connection) {
           return RemoveForgottenEvidence(connection, owned_->map(), 5).status();
         });
       }},
      {"Read",
       [&](int i) {
         return log_->Read("things", {Key(5000 * i, "old", 5000 * i), 0}, 16).status();
       }},
  };
  int64_t all_seen = 0;
  for (const auto& c : cases) {
    const int64_t seen = PagesSeen([&] {
      for (int i = 0; i < kCalls; ++i) {
        const absl::Status status = c.call(i);
        EXPECT_TRUE(status.ok()) << c.name << ": " << status;
      }
    });
    EXPECT_LT(seen, kCalls * kMaxPagesOfCall) << c.name;
    all_seen += seen;
  }
  // The database counts.
  EXPECT_GT(all_seen, kCalls * 16);
}

}  // namespace
}  // namespace hypermap::storage::postgres
