// Tests that a map outlives power losses: at random moments of its life, its files are rebuilt from
// the recorded writes, of which those that were not synced are lost, torn or out of order.
//
// The witness of the newest revision (revision_witness.h) is not written by SQLite, and is checked
// as the disk may have it:
// - as it was at that moment: it is never ahead of the acknowledged revisions, so that it tells of
//   no loss, and the map keeps its incarnation;
// - as it was synced last, when the map was opened: it is behind, which is no discontinuity either;
// - not there at all, because nothing syncs the name of a new lock file: all acknowledged revisions
//   are there, but the map may be another incarnation.
#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/testing/edited_map.h"
#include "storage/geopackage/testing/faulty_files.h"
#include "storage/geopackage/testing/map.h"
#include "storage/geopackage/testing/map_life.h"

namespace hypermap::storage {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr char kWitnessName[] = ".site.gpkg.lock";
constexpr char kDeletion[] = "delete site";

// The state of the map as far as the caller of the store knows it between two calls.
struct Knowledge {
  // True if the creation was begun, and acknowledged.
  bool may_exist = false;
  bool exists = false;
  // The same of the deletion.
  bool may_be_gone = false;
  bool is_gone = false;
  LifeProgress least;
  LifeProgress most;
  uint64_t incarnation = 0;
  std::string synced_witness;
};

enum class WitnessOnDisk { kNow, kSynced, kNone };

// A map whose life is recorded.
class RecordedLife {
 public:
  RecordedLife(uint64_t seed, std::string folder)
      : rng_(seed), folder_(std::move(folder)), files_(folder_, kWitnessName) {}

  // From the creation to the deletion.
  void Live(int num_commits) {
    life_ = std::make_unique<MapLife>(rng_, "site", num_commits);
    Note();
    store_ = OpenStore(folder_);
    now_.may_exist = true;
    Note();
    auto created = store_->Create(HeaderOf("site"));
    ASSERT_TRUE(created.ok()) << created.status();
    TakeOver(*std::move(created));
    for (const MapLife::Step& step : life_->steps()) TakeStep(step);
    if (::testing::Test::HasFatalFailure()) return;
    Delete();
  }

  // A map that exists already goes on with one commit.
  void GoOn(const MapLife& life, const LifeProgress& found) {
    now_.may_exist = now_.exists = true;
    now_.least = now_.most = found;
    now_.synced_witness = ReadFile(folder_ + "/" + kWitnessName);
    Note();
    store_ = OpenStore(folder_);
    auto opened = store_->Open("site");
    ASSERT_TRUE(opened.ok()) << opened.status();
    TakeOver(*std::move(opened));
    now_.most = life.Next(found);
    Note();
    life.ExpectGoesOn(*map_, found);
    now_.least = now_.most;
    Note();
    map_ = nullptr;
    Note();
  }

  const std::vector<FileEvent>& events() const { return files_.events(); }
  const std::vector<Knowledge>& notes() const { return notes_; }
  const MapLife& life() const { return *life_; }
  std::unique_ptr<MapLife> TakeLife() { return std::move(life_); }

 private:
  void Note() {
    files_.Note(static_cast<int64_t>(notes_.size()));
    notes_.push_back(now_);
  }

  void TakeOver(std::unique_ptr<StoredMap> map) {
    map_ = std::move(map);
    now_.exists = true;
    now_.incarnation = map_->header().incarnation;
    now_.synced_witness = ReadFile(folder_ + "/" + kWitnessName);
    Note();
  }

  void TakeStep(const MapLife::Step& step) {
    now_.most = step.after;
    Note();
    if (step.kind == MapLife::Step::Kind::kReopen) {
      map_ = nullptr;
      auto opened = store_->Open("site");
      ASSERT_TRUE(opened.ok()) << opened.status();
      EXPECT_THAT((*opened)->opening_notes(), IsEmpty());
      TakeOver(*std::move(opened));
    } else {
      const absl::Status status = life_->Do(step, now_.least, *map_);
      ASSERT_TRUE(status.ok()) << status;
    }
    now_.least = step.after;
    Note();
  }

  void Delete() {
    life_->CloseReader();
    map_ = nullptr;
    now_.may_be_gone = true;
    Note();
    const absl::Status status = store_->Delete("site", kDeletion);
    ASSERT_TRUE(status.ok()) << status;
    now_.is_gone = true;
    Note();
    store_ = nullptr;
    Note();
  }

  testing::Rng rng_;
  const std::string folder_;
  FaultyFiles files_;
  Knowledge now_;
  std::vector<Knowledge> notes_;
  std::unique_ptr<MapLife> life_;
  std::unique_ptr<MapStore> store_;
  std::unique_ptr<StoredMap> map_;
};

// Numbers of events after which power is lost, ascending: some anywhere, and some next to writes to
// other files than a write-ahead log, which are rare and of which each matters.
std::vector<size_t> ChooseMoments(testing::Rng& rng, const std::vector<FileEvent>& events,
                                  int num_moments) {
  std::map<int, std::string> names;
  std::vector<size_t> rare;
  // The first events list the files that were there before.
  const auto first_note = std::find_if(events.begin(), events.end(), [](const FileEvent& event) {
    return event.kind == FileEvent::Kind::kNote;
  });
  const int first = static_cast<int>(first_note - events.begin());
  for (size_t i = 0; i < events.size(); ++i) {
    if (!events[i].name.empty()) names[events[i].file] = events[i].name;
    const bool is_change = events[i].kind != FileEvent::Kind::kNote;
    if (static_cast<int>(i) > first && is_change && !names[events[i].file].ends_with("-wal")) {
      rare.push_back(i);
    }
  }
  std::vector<size_t> moments;
  for (int i = 0; i < num_moments; ++i) {
    const bool is_rare = i % 3 == 0 && !rare.empty();
    const int last = static_cast<int>(is_rare ? rare.size() : events.size()) - 1;
    const size_t place = testing::UniformInt(rng, is_rare ? 0 : first, last);
    moments.push_back(is_rare ? rare[place] : place);
  }
  std::sort(moments.begin(), moments.end());
  return moments;
}

// The files of a store after a power loss.
struct LostPower {
  std::map<std::string, std::string> files;
  Knowledge known;
  WitnessOnDisk witness_on_disk = WitnessOnDisk::kNow;
  std::string witness;

  void WriteTo(testing::Rng& rng, const std::string& folder) const {
    for (const auto& [name, bytes] : files) WriteFile(absl::StrCat(folder, "/", name), bytes);
    if (!witness.empty()) WriteFile(folder + "/" + kWitnessName, witness);
    // The index of the log is not synced ever.
    if (testing::UniformInt(rng, 0, 1) == 0) return;
    std::string garbage(32768, '\0');
    for (char& byte : garbage) byte = static_cast<char>(rng());
    WriteFile(folder + "/site.gpkg-shm", garbage);
  }
};

// Calls `check` with the files of a power loss at each of the moments.
template <typename Check>
void LosePowerAt(testing::Rng& rng, const RecordedLife& recorded,
                 const std::vector<size_t>& moments, Check check) {
  SimulatedDisk disk(rng());
  Knowledge known = recorded.notes().front();
  auto moment = moments.begin();
  const std::vector<FileEvent>& events = recorded.events();
  for (size_t i = 0; i < events.size() && moment != moments.end(); ++i) {
    disk.Apply(events[i]);
    if (events[i].kind == FileEvent::Kind::kNote) known = recorded.notes()[events[i].offset];
    for (; moment != moments.end() && *moment == i; ++moment) {
      SCOPED_TRACE(::testing::Message() << "event " << i << " of " << events.size());
      LostPower lost{disk.LosePower(), known};
      lost.witness_on_disk = static_cast<WitnessOnDisk>(testing::UniformInt(rng, 0, 2));
      if (lost.witness_on_disk == WitnessOnDisk::kNow) lost.witness = events[i].witness;
      if (lost.witness_on_disk == WitnessOnDisk::kSynced) lost.witness = known.synced_witness;
      check(lost);
      if (::testing::Test::HasFailure()) return;
    }
  }
}

void ExpectContinuity(const StoredMap& map, const LostPower& lost) {
  if (lost.known.incarnation == 0) return;  // its creation was not acknowledged
  if (lost.witness_on_disk != WitnessOnDisk::kNone) {
    EXPECT_THAT(map.opening_notes(), IsEmpty());
    EXPECT_EQ(map.header().incarnation, lost.known.incarnation);
    return;
  }
  for (const std::string& note : map.opening_notes()) {
    EXPECT_THAT(note, HasSubstr("nothing tells that this store wrote the file last"));
  }
}

// Expects that the store in the folder has what was acknowledged. Returns what was found, nullopt
// if there is no map. `expect_more`: that the map goes on, too.
std::optional<LifeProgress> ExpectNothingIsLost(testing::Rng& rng, const MapLife& life,
                                                const LostPower& lost, const std::string& folder,
                                                bool expect_more) {
  const Knowledge& known = lost.known;
  const auto store = OpenStore(folder);
  if (store == nullptr) return std::nullopt;
  const std::vector<std::string> maps = store->List().value_or(std::vector<std::string>{"?"});
  if (known.is_gone) {
    EXPECT_EQ(store->FindDeletion(kDeletion).value(), "site");
  }
  if (maps.empty()) {
    EXPECT_TRUE(!known.exists || known.may_be_gone) << "the map is lost";
    return std::nullopt;
  }
  EXPECT_THAT(maps, ::testing::ElementsAre("site"));
  EXPECT_TRUE(known.may_exist && !known.is_gone);
  auto opened = store->Open("site");
  EXPECT_TRUE(opened.ok()) << opened.status();
  if (!opened.ok()) return std::nullopt;
  ExpectContinuity(**opened, lost);
  const LifeProgress found = life.ExpectWhole(rng, **opened, known.least, known.most);
  if (expect_more) life.ExpectGoesOn(**opened, found);
  return found;
}

TEST(PowerLossTest, NothingAcknowledgedIsLostAtAnyMoment) {
  const uint64_t seed = testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  testing::Rng rng(seed);
  const testing::TemporaryFolder folder;
  RecordedLife recorded(rng(), folder.path());
  recorded.Live(90);
  ASSERT_FALSE(HasFailure());
  const std::vector<size_t> moments = ChooseMoments(rng, recorded.events(), 200);
  int num_found = 0;
  LosePowerAt(rng, recorded, moments, [&](const LostPower& lost) {
    const testing::TemporaryFolder after;
    lost.WriteTo(rng, after.path());
    if (ExpectNothingIsLost(rng, recorded.life(), lost, after.path(), true)) ++num_found;
  });
  EXPECT_GT(num_found, 50);
}

TEST(PowerLossTest, PowerThatIsLostAgainDuringTheRecoveryLosesNothing) {
  const uint64_t seed = testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  testing::Rng rng(seed);
  const testing::TemporaryFolder folder;
  std::vector<LostPower> first_losses;
  std::vector<LifeProgress> found;
  std::unique_ptr<MapLife> life;
  {
    RecordedLife recorded(rng(), folder.path());
    recorded.Live(40);
    ASSERT_FALSE(HasFailure());
    const std::vector<size_t> moments = ChooseMoments(rng, recorded.events(), 12);
    LosePowerAt(rng, recorded, moments, [&](const LostPower& lost) {
      const testing::TemporaryFolder after;
      lost.WriteTo(rng, after.path());
      const auto now = ExpectNothingIsLost(rng, recorded.life(), lost, after.path(), false);
      if (!now || lost.known.may_be_gone || !lost.known.exists) return;
      first_losses.push_back(lost);
      found.push_back(*now);
    });
    life = recorded.TakeLife();
  }
  for (size_t i = 0; i < first_losses.size() && !HasFailure(); ++i) {
    const testing::TemporaryFolder again;
    first_losses[i].WriteTo(rng, again.path());
    RecordedLife recorded(rng(), again.path());
    recorded.GoOn(*life, found[i]);
    const std::vector<size_t> moments = ChooseMoments(rng, recorded.events(), 4);
    LosePowerAt(rng, recorded, moments, [&](const LostPower& lost) {
      const testing::TemporaryFolder after;
      lost.WriteTo(rng, after.path());
      ExpectNothingIsLost(rng, *life, lost, after.path(), true);
    });
  }
}

}  // namespace
}  // namespace hypermap::storage
