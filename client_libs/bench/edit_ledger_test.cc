#include "client_libs/bench/edit_ledger.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace hypermap::bench {
namespace {

class EditLedgerTest : public testing::Test {
 protected:
  EditLedgerTest() {
    ledger_.NoteAcknowledged({7, 9}, 20);
    ledger_.NoteAcknowledged({9}, 30);
  }

  void ExpectFaults(const std::map<ObjectId, Revision>& versions, int64_t lost, int64_t repeated) {
    const EditFaults faults = ledger_.Compare(versions);
    EXPECT_EQ(faults.lost, lost);
    EXPECT_EQ(faults.repeated, repeated);
  }

  EditLedger ledger_;
};

TEST_F(EditLedgerTest, CountsWhatWasAcknowledged) {
  EXPECT_EQ(ledger_.size(), 2U);
  EXPECT_EQ(ledger_.IdAt(1), 9);
  EXPECT_EQ(ledger_.num_acknowledged(), 2);
  EXPECT_EQ(ledger_.newest(), 30);
}

TEST_F(EditLedgerTest, ObjectsOfOthersDoNotMatter) {
  ExpectFaults({{7, 20}, {8, 99}, {9, 30}}, 0, 0);
}

TEST_F(EditLedgerTest, ObjectThatIsAbsentOrOlderIsLost) {
  ExpectFaults({{9, 30}}, 1, 0);
  ExpectFaults({{7, 20}, {9, 20}}, 1, 0);
  ExpectFaults({}, 2, 0);
}

TEST_F(EditLedgerTest, ObjectThatIsNewerThanAllEditsWasEditedTwice) {
  ExpectFaults({{7, 20}, {9, 31}}, 0, 1);
}

TEST_F(EditLedgerTest, EditWithoutAnswerMayHaveBeenCarriedOutOrNot) {
  ledger_.NoteUncertain(9);
  ledger_.NoteUncertain(0);
  EXPECT_EQ(ledger_.size(), 2U);
  ExpectFaults({{7, 20}, {9, 31}}, 0, 0);
  ExpectFaults({{7, 20}, {9, 30}}, 0, 0);
  ExpectFaults({{7, 20}, {9, 29}}, 1, 0);
}

}  // namespace
}  // namespace hypermap::bench
