#include "tests/robustness/trials.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "storage/sqlite/page_checksums.h"
#include "tests/robustness/life.h"
#include "tests/support/random_map.h"

namespace hypermap::robustness {

using storage::FileEvent;
using storage::NameOrder;
using storage::SimulatedDisk;
using testing::Rng;
using testing::UniformInt;

namespace {

void CountOutcome(const Judgement& judgement, Counts* counts) {
  counts->lost += judgement.outcome == Outcome::kLost;
  counts->half_done += judgement.outcome == Outcome::kHalfDone;
  counts->wrong += judgement.outcome == Outcome::kWrong;
  counts->wedged += judgement.outcome == Outcome::kWedged;
}

// Runs trials of one rehearsal and fault.
class Runner {
 public:
  Runner(const Rehearsal& rehearsal, Fault fault, bool every, uint64_t seed, Plant plant,
         std::string folder)
      : rehearsal_(rehearsal),
        fault_(fault),
        seed_(seed),
        plant_(plant),
        folder_(std::move(folder)),
        failing_calls_(FailingCalls(rehearsal, fault, seed, every)) {}

  void RunCall(int64_t number) {
    Rng rng = RngOf(number);
    const FailingCall failing = ChooseCall(number, rng);
    WriteTree(rehearsal_.before, folder_);
    FaultyCalls faulty(fault_, failing, plant_);
    const Life life = RunLife(rehearsal_, folder_, plant_, &faulty, nullptr, nullptr);
    const std::string where =
        absl::StrCat("call ", failing.at, " (", NameOf(rehearsal_.calls[failing.at].call), " of \"",
                     rehearsal_.calls[failing.at].path, "\")");
    Judgement judgement = JudgeLife(life);
    if (judgement.outcome == Outcome::kWhole) {
      judgement = JudgeFolder(rehearsal_, folder_, life.progress, /*lost_power=*/false);
    }
    Count(number, where, judgement, life.has_ended);
  }

  void RunFailedSync(int64_t number) {
    constexpr int kLosses = 3;
    Rng rng = RngOf(number / kLosses);
    const FailingCall failing = ChooseCall(number / kLosses, rng);
    WriteTree(rehearsal_.before, folder_);
    FaultyCalls faulty(fault_, failing, plant_);
    Recorder recorder(folder_);
    std::vector<Progress> notes;
    RunLife(rehearsal_, folder_, plant_, &faulty, &recorder, &notes);
    Rng moments = RngOf(number);
    const auto& events = recorder.events();
    const auto failed = std::find_if(events.begin(), events.end(), [](const FileEvent& event) {
      return event.kind == FileEvent::Kind::kSyncFailed;
    });
    // Another run makes its calls in another order, and then the one that fails may be no sync.
    const int first =
        failed == events.end() ? FirstEventOf(recorder) : static_cast<int>(failed - events.begin());
    LosePowerAt(recorder, notes, {UniformInt(moments, first, static_cast<int>(events.size()) - 1)},
                moments, [&](int moment, const Progress& known) {
                  JudgeLoss(number, absl::StrCat("call ", failing.at, ", event ", moment), known);
                });
  }

  void RunLosses(int64_t first, int64_t count) {
    Rng rng = RngOf(first);
    std::vector<int> moments(static_cast<size_t>(count));
    for (int& moment : moments) moment = UniformInt(rng, FirstEvent(), NumEvents() - 1);
    std::sort(moments.begin(), moments.end());
    int64_t number = first;
    LosePowerAt(*rehearsal_.record, rehearsal_.progress, moments, rng,
                [&](int moment, const Progress& known) {
                  if (fault_ == Fault::kPowerLoss) {
                    JudgeLoss(number++, absl::StrCat("event ", moment), known);
                  } else {
                    LosePowerAgain(number++, moment, known, rng);
                  }
                });
  }

  void RunFlip(int64_t number) {
    Rng rng = RngOf(number);
    Progress known{rehearsal_.scenario->num_steps(), rehearsal_.scenario->num_steps()};
    FileTree files = rehearsal_.after;
    if (fault_ == Fault::kBitFlipAfterKill) {
      WriteTree(rehearsal_.before, folder_);
      FaultyCalls faulty(fault_, ChooseCall(number, rng), plant_);
      known = RunLife(rehearsal_, folder_, plant_, &faulty, nullptr, nullptr).progress;
      files = ReadTree(folder_);
    }
    std::erase_if(files, [](const auto& file) {
      return file.second.empty() || file.first.ends_with("-shm");
    });
    if (files.empty()) return;
    const FileTree intact = files;
    JudgeFlip(number, Flip(&files, rng), files, intact, known);
  }

  TrialReport TakeReport() { return std::move(report_); }

 private:
  using AfterLoss = std::function<void(int moment, const Progress& known)>;

  Rng RngOf(int64_t number) const {
    std::seed_seq seeds{seed_, static_cast<uint64_t>(fault_), static_cast<uint64_t>(number),
                        std::hash<std::string>()(rehearsal_.scenario->name())};
    return Rng(seeds);
  }

  FailingCall ChooseCall(int64_t number, Rng& rng) const {
    if (fault_ == Fault::kCallFails || fault_ == Fault::kCallsFail) {
      return failing_calls_[number % failing_calls_.size()];
    }
    if (fault_ == Fault::kPowerLossAfterFailedSync) {
      const std::vector<int> syncs = CallsOf(rehearsal_, FileCall::kSync);
      return {syncs[number % syncs.size()], 0};
    }
    return {UniformInt(rng, 0, static_cast<int>(rehearsal_.calls.size()) - 1), 0};
  }

  int NumEvents() const { return static_cast<int>(rehearsal_.record->events().size()); }
  int FirstEvent() const { return FirstEventOf(*rehearsal_.record); }
  // The first events list the files that were there before.
  static int FirstEventOf(const Recorder& record) {
    const auto& events = record.events();
    const auto note = std::find_if(events.begin(), events.end(), [](const FileEvent& event) {
      return event.kind == FileEvent::Kind::kNote;
    });
    return static_cast<int>(note - events.begin());
  }

  // Carries out recorded events on two disks, of which one, by chance, loses power at each moment.
  void LosePowerAt(const Recorder& record, const std::vector<Progress>& notes,
                   const std::vector<int>& moments, Rng& rng, const AfterLoss& after) {
    SimulatedDisk journal(rng(), NameOrder::kJournal);
    SimulatedDisk folders(rng(), NameOrder::kFolders);
    Progress known;
    auto moment = moments.begin();
    for (int i = 0; i <= moments.back(); ++i) {
      const FileEvent& event = record.events()[i];
      journal.Apply(event);
      folders.Apply(event);
      if (event.kind == FileEvent::Kind::kNote) known = notes[event.offset];
      for (; moment != moments.end() && *moment == i; ++moment) {
        FileTree files = (UniformInt(rng, 0, 1) == 0 ? journal : folders).LosePower();
        SpoilIndexes(&files, rng);
        WriteTree(files, folder_);
        after(i, known);
      }
    }
  }

  // The index of a log is written by memory mapping, and never synced.
  static void SpoilIndexes(FileTree* files, Rng& rng) {
    for (auto& [name, bytes] : *files) {
      if (!name.ends_with("-shm")) continue;
      bytes.assign(32768, '\0');
      for (char& byte : bytes) byte = static_cast<char>(rng());
    }
  }

  void JudgeLoss(int64_t number, const std::string& where, const Progress& known) {
    Count(number, where, JudgeFolder(rehearsal_, folder_, known, /*lost_power=*/true),
          /*by_itself=*/false);
  }

  // The process that opens the files after a loss loses power, too.
  void LosePowerAgain(int64_t number, int first_moment, const Progress& known, Rng& rng) {
    Recorder recorder(folder_);
    recorder.AddNote(0);
    const int first = static_cast<int>(recorder.events().size()) - 1;
    Supervised supervised;
    supervised.folder = folder_;
    supervised.child = [&](const Teller&) { rehearsal_.scenario->Describe(folder_).IgnoreError(); };
    supervised.on_call = [&](const SeenCall& call) {
      recorder.Add(call, {});
      return Answer{};
    };
    supervised.on_message = [](const Message&) {};
    Supervise(supervised);
    const int moment = UniformInt(rng, first, static_cast<int>(recorder.events().size()) - 1);
    LosePowerAt(recorder, {known}, {moment}, rng, [&](int, const Progress&) {
      JudgeLoss(number, absl::StrCat("event ", first_moment, ", then ", moment), known);
    });
  }

  // Returns where it was.
  std::string Flip(FileTree* files, Rng& rng) {
    // Of small files, such as witnesses, each is as likely as one page of a large one.
    constexpr int64_t kPage = 4096;
    int64_t weight = 0;
    for (const auto& [name, bytes] : *files) weight += bytes.size() / kPage + 1;
    int64_t chosen = static_cast<int64_t>(rng() % static_cast<uint64_t>(weight));
    for (auto& [name, bytes] : *files) {
      const int64_t pages = static_cast<int64_t>(bytes.size()) / kPage + 1;
      if (chosen >= pages) {
        chosen -= pages;
        continue;
      }
      const size_t at = rng() % bytes.size();
      const int bit = UniformInt(rng, 0, 7);
      bytes[at] = static_cast<char>(bytes[at] ^ (1 << bit));
      if (plant_ == Plant::kDamageWithChecksum && bytes.size() % kPage == 0) {
        auto* page = reinterpret_cast<unsigned char*>(bytes.data() + at / kPage * kPage);
        storage::SetPageChecksum(absl::MakeSpan(page, kPage));
      }
      return absl::StrCat("bit ", bit, " of byte ", at, " of ", name);
    }
    return "nothing";
  }

  void JudgeFlip(int64_t number, const std::string& where, const FileTree& files,
                 const FileTree& intact, const Progress& known) {
    WriteTree(files, folder_);
    absl::StatusOr<Description> found = DescribeApart(*rehearsal_.scenario, folder_);
    const bool died = absl::IsInternal(found.status());
    const bool is_named = !died && (!found.ok() || NamesDamage(*found));
    Judgement judgement;
    if (died) {
      judgement = {Outcome::kWedged, found.status().ToString()};
    } else if (is_named) {
      // What was intact, a backup, takes its place.
      WriteTree(intact, folder_);
      judgement = JudgeFolder(rehearsal_, folder_, known, /*lost_power=*/false);
    } else {
      judgement = Judge(found, rehearsal_.states, known.done, known.begun, /*with_notes=*/true);
      if (judgement.outcome == Outcome::kLost && LacksNoRevision(*found, known)) judgement = {};
    }
    Count(number, where, judgement, /*by_itself=*/!is_named, is_named);
  }

  // The end of a log that is damaged is lost. If it has no commit of a client, such as a
  // compaction, which is made again, nobody needs to be told.
  bool LacksNoRevision(const Description& found, const Progress& known) const {
    const Description& expected = rehearsal_.states[known.done];
    return fault_ == Fault::kBitFlipAfterKill &&
           std::all_of(expected.begin(), expected.end(), [&](const auto& part) {
             const bool is_told =
                 part.first.ends_with("/newest") || part.first.ends_with("/receipts") ||
                 part.first.ends_with("/evidence") || part.first.find('/') == std::string::npos;
             const auto same = found.find(part.first);
             return !is_told || (same != found.end() && same->second == part.second);
           });
  }

  static bool NamesDamage(const Description& description) {
    return std::any_of(description.begin(), description.end(), [](const auto& part) {
      return !part.second.empty() &&
             (part.first.ends_with("/notes") || part.first.ends_with("/findings") ||
              part.first.ends_with("damaged") || part.second == "nothing");
    });
  }

  void Count(int64_t number, const std::string& where, const Judgement& judgement, bool by_itself,
             bool is_named = false) {
    Counts& counts = report_.counts;
    ++counts.runs;
    CountOutcome(judgement, &counts);
    if (judgement.outcome == Outcome::kWhole) {
      ++(is_named ? counts.named : by_itself ? counts.by_itself : counts.by_restart);
      return;
    }
    report_.problems.push_back(absl::StrCat(rehearsal_.scenario->name(), ", ", NameOf(fault_),
                                            ", trial ", number, ", ", where, ": ",
                                            NameOf(judgement.outcome), ": ", judgement.reason));
  }

  const Rehearsal& rehearsal_;
  const Fault fault_;
  const uint64_t seed_;
  const Plant plant_;
  const std::string folder_;
  const std::vector<FailingCall> failing_calls_;
  TrialReport report_;
};

}  // namespace

void Counts::Add(const Counts& other) {
  runs += other.runs;
  lost += other.lost;
  half_done += other.half_done;
  wrong += other.wrong;
  wedged += other.wedged;
  by_itself += other.by_itself;
  by_restart += other.by_restart;
  named += other.named;
}

int64_t NumDifferent(const Rehearsal& rehearsal, Fault fault, bool every) {
  if (fault == Fault::kCallFails || fault == Fault::kCallsFail) {
    return static_cast<int64_t>(FailingCalls(rehearsal, fault, 0, every).size());
  }
  if (fault != Fault::kPowerLossAfterFailedSync) return 0;
  return 3 * static_cast<int64_t>(CallsOf(rehearsal, FileCall::kSync).size());
}

TrialReport RunTrials(const Rehearsal& rehearsal, const Trials& trials, uint64_t seed, Plant plant,
                      const std::string& folder) {
  Runner runner(rehearsal, trials.fault, trials.every, seed, plant, folder);
  if (trials.fault == Fault::kPowerLoss || trials.fault == Fault::kPowerLossInRecovery) {
    runner.RunLosses(trials.first, trials.count);
    return runner.TakeReport();
  }
  for (int64_t i = trials.first; i < trials.first + trials.count; ++i) {
    switch (trials.fault) {
      case Fault::kPowerLossAfterFailedSync:
        runner.RunFailedSync(i);
        break;
      case Fault::kBitFlip:
      case Fault::kBitFlipAfterKill:
        runner.RunFlip(i);
        break;
      default:
        runner.RunCall(i);
    }
  }
  return runner.TakeReport();
}

}  // namespace hypermap::robustness
