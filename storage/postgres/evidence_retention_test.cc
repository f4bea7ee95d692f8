#include "storage/postgres/evidence_retention.h"

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "storage/postgres/testing/written_map.h"
#include "tests/support/random_map.h"

namespace hypermap::storage::postgres {
namespace {

using ::hypermap::testing::Rng;
using ::hypermap::testing::TestSeed;
using ::hypermap::testing::UniformInt;
using ::testing::ElementsAre;

class PostgresEvidenceRetentionTest : public WrittenMapTest {
 protected:
  // Inserts observations of a robot that are older than the base.
  void InsertForgotten(const std::string& robot, const std::vector<int64_t>& sequences) {
    const absl::StatusOr<Rows> rows = connection_->Query(
        "INSERT INTO hypermap.observations SELECT $1, 'things', 0, $2, s, 0, false, 0, 0, '' "
        "FROM unnest($3::bigint[]) AS s",
        owned_->map(), robot, sequences);
    ASSERT_TRUE(rows.ok()) << rows.status();
  }

  void InsertBase() {
    Run("INSERT INTO hypermap.fusion_bases SELECT $1, 'things', 1, '', 0, 0, 0, 0, ''");
  }

  int64_t Remove(int64_t max_rows) {
    const auto removed = RemoveForgottenEvidence(*connection_, owned_->map(), max_rows);
    EXPECT_TRUE(removed.ok()) << removed.status();
    return removed.value_or(0);
  }

  std::vector<SequenceRange> Forgotten(const std::string& robot) {
    Rows rows = *connection_->Query(
        "SELECT first_sequence, last_sequence FROM hypermap.forgotten_sequences "
        "WHERE map = $1 AND robot = $2 ORDER BY first_sequence",
        owned_->map(), robot);
    std::vector<SequenceRange> ranges;
    while (rows.Next()) ranges.push_back({rows.Int64(0), rows.Int64(1)});
    return ranges;
  }
};

TEST_F(PostgresEvidenceRetentionTest, RangesAreJoinedHoweverTheRowsAreRemoved) {
  Rng rng(TestSeed());
  InsertBase();
  std::vector<int64_t> sequences(300);
  for (int i = 0; i < 300; ++i) sequences[i] = i + i / 50;  // A gap after each 50.
  std::shuffle(sequences.begin(), sequences.end(), rng);
  for (size_t done = 0; done < sequences.size(); done += 60) {
    const std::vector<int64_t> some(sequences.begin() + done, sequences.begin() + done + 60);
    InsertForgotten("a", some);
    InsertForgotten("b", some);
    while (Remove(UniformInt(rng, 1, 40)) > 0) {
    }
  }
  for (const char* robot : {"a", "b"}) {
    EXPECT_THAT(Forgotten(robot), ElementsAre(SequenceRange{0, 49}, SequenceRange{51, 100},
                                              SequenceRange{102, 151}, SequenceRange{153, 202},
                                              SequenceRange{204, 253}, SequenceRange{255, 304}))
        << robot;
  }
}

TEST_F(PostgresEvidenceRetentionTest, TheGreatestSequencesAreRangesToo) {
  constexpr int64_t kFirst = std::numeric_limits<int64_t>::min();
  constexpr int64_t kLast = std::numeric_limits<int64_t>::max();
  InsertBase();
  for (const int64_t sequence : {kLast, kFirst, kLast - 1, kFirst + 1, int64_t{0}}) {
    InsertForgotten("a", {sequence});
    EXPECT_EQ(Remove(10), 1);
  }
  EXPECT_THAT(Forgotten("a"), ElementsAre(SequenceRange{kFirst, kFirst + 1}, SequenceRange{0, 0},
                                          SequenceRange{kLast - 1, kLast}));
}

TEST_F(PostgresEvidenceRetentionTest, RemovesNoMoreRowsThanItMay) {
  InsertBase();
  InsertForgotten("a", {0, 1, 2});
  Run("INSERT INTO hypermap.operator_facts "
      "SELECT $1, 'things', 0, 'a', 0, i, 'pin', 't', '' FROM generate_series(1, 3) AS i");
  EXPECT_EQ(Remove(0), 0);
  EXPECT_EQ(Remove(2), 2);
  EXPECT_EQ(Remove(2), 2);
  EXPECT_EQ(Remove(10), 2);
  EXPECT_EQ(Remove(10), 0);
}

}  // namespace
}  // namespace hypermap::storage::postgres
