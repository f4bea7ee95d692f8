#include "storage/geopackage/testing/simulated_disk.h"

#include <deque>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "gtest/gtest.h"

namespace hypermap::storage {
namespace {

using Files = std::map<std::string, std::string>;
using Kind = FileEvent::Kind;

// Events that happen on a disk.
class Recorded {
 public:
  explicit Recorded(NameOrder order) : disk_(7, order) {}

  FileEvent& Add(Kind kind, int file, const std::string& name = "") {
    FileEvent& event = events_.emplace_back();
    event.kind = kind;
    event.file = file;
    event.name = name;
    return event;
  }
  void Happen() {
    for (; applied_ < events_.size(); ++applied_) disk_.Apply(events_[applied_]);
  }
  // All that may be on the disk after a power loss.
  std::set<Files> Outcomes() {
    Happen();
    std::set<Files> outcomes;
    for (int i = 0; i < 1000; ++i) outcomes.insert(disk_.LosePower());
    return outcomes;
  }

 private:
  std::deque<FileEvent> events_;
  size_t applied_ = 0;
  SimulatedDisk disk_;
};

TEST(SimulatedDiskTest, FileThatIsSyncedMayHaveNoNameBeforeItsFolderIsSynced) {
  for (const NameOrder order : {NameOrder::kJournal, NameOrder::kFolders}) {
    Recorded disk(order);
    disk.Add(Kind::kCreate, 0, "a");
    disk.Add(Kind::kWrite, 0).bytes = "text";
    disk.Add(Kind::kSync, 0);
    EXPECT_EQ(disk.Outcomes(), (std::set<Files>{{}, {{"a", "text"}}}));
    disk.Add(Kind::kSyncFolder, -1, "");
    EXPECT_EQ(disk.Outcomes(), (std::set<Files>{{{"a", "text"}}}));
  }
}

TEST(SimulatedDiskTest, SyncOfAnotherFolderIsOneOfAllOnlyInAJournal) {
  for (const NameOrder order : {NameOrder::kJournal, NameOrder::kFolders}) {
    Recorded disk(order);
    disk.Add(Kind::kAppear, -1, "f");
    disk.Add(Kind::kCreate, 0, "a");
    disk.Add(Kind::kSyncFolder, -1, "f");
    EXPECT_EQ(disk.Outcomes().size(), order == NameOrder::kJournal ? 1 : 2);
  }
}

TEST(SimulatedDiskTest, FileThatIsMovedToAnotherFolderIsInOneOfThem) {
  for (const NameOrder order : {NameOrder::kJournal, NameOrder::kFolders}) {
    Recorded disk(order);
    disk.Add(Kind::kAppear, -1, "f");
    disk.Add(Kind::kAppear, 0, "a").bytes = "text";
    disk.Add(Kind::kMove, 0, "f/a").from = "a";
    EXPECT_EQ(disk.Outcomes(),
              (std::set<Files>{{{"a", "text"}, {"f/", ""}}, {{"f/", ""}, {"f/a", "text"}}}));
  }
}

TEST(SimulatedDiskTest, ExchangeIsDoneWholeOrNotAtAll) {
  for (const NameOrder order : {NameOrder::kJournal, NameOrder::kFolders}) {
    Recorded disk(order);
    disk.Add(Kind::kAppear, 0, "a").bytes = "one";
    disk.Add(Kind::kAppear, 1, "b").bytes = "other";
    disk.Add(Kind::kExchange, 0, "b").from = "a";
    EXPECT_EQ(disk.Outcomes(),
              (std::set<Files>{{{"a", "one"}, {"b", "other"}}, {{"a", "other"}, {"b", "one"}}}));
  }
}

TEST(SimulatedDiskTest, ContentOfAFolderIsGoneWithItsName) {
  Recorded disk(NameOrder::kFolders);
  disk.Add(Kind::kMakeFolder, -1, "f");
  disk.Add(Kind::kCreate, 0, "f/a");
  disk.Add(Kind::kSyncFolder, -1, "f");
  EXPECT_EQ(disk.Outcomes(), (std::set<Files>{{}, {{"f/", ""}, {"f/a", ""}}}));
}

TEST(SimulatedDiskTest, SyncThatFailsIsNotRepairedByTheNext) {
  bool was_lost = false;
  for (int i = 0; i < 50; ++i) {
    SimulatedDisk disk(i);
    FileEvent file, write, failed, sync;
    file.kind = Kind::kAppear;
    file.file = write.file = failed.file = sync.file = 0;
    file.name = "a";
    write.kind = Kind::kWrite;
    write.bytes = "text";
    failed.kind = Kind::kSyncFailed;
    sync.kind = Kind::kSync;
    for (const FileEvent* event : {&file, &write, &failed, &sync}) disk.Apply(*event);
    was_lost = was_lost || disk.LosePower().at("a") != "text";
  }
  EXPECT_TRUE(was_lost);
}

}  // namespace
}  // namespace hypermap::storage
