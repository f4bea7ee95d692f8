#include "storage/conformance/testing/model_map.h"

#include <algorithm>
#include <iterator>
#include <memory>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/testing/recorded_history.h"
#include "storage/conformance/testing/time_mark.h"

namespace hypermap::storage {

using ::hypermap::testing::RandomSite;
using ::hypermap::testing::Rng;
using ::hypermap::testing::UniformInt;

namespace {

constexpr int kObjects = 10;

EditedMap Made(MapStore& store, const MapHeader& header) {
  auto stored = store.Create(header);
  EXPECT_TRUE(stored.ok()) << stored.status();
  if (!stored.ok()) return {};
  auto snapshot = (*stored)->Load();
  EXPECT_TRUE(snapshot.ok()) << snapshot.status();
  return {*std::move(stored), snapshot.ok() ? *snapshot : std::make_shared<Snapshot>()};
}

EditBatch NextBatch(Rng& rng, const Snapshot& now) {
  return now.revision == 0 ? RandomSite(rng, kObjects) : RandomBatch(rng, now);
}

}  // namespace

ModelMap::ModelMap(MapStore& store, const MapHeader& header)
    : header_(header), history_(Made(store, header)) {
  header_.incarnation = history_.stored().header().incarnation;
  EXPECT_NE(header_.incarnation, 0);
}

Commit ModelMap::RandomCommit(Rng& rng, const Snapshot& before) {
  Commit commit = MakeCommit(before, NextBatch(rng, before));
  commit.author = UniformInt(rng, 0, 1) == 0 ? "tester" : "Ärztin \"A\" <a@b>; '%_\\";
  if (UniformInt(rng, 0, 2) > 0) {
    commit.request_id = absl::StrCat("request ", before.revision + 1);
    commit.request_digest = absl::StrCat(std::string("\0\xff", 2), before.revision);
    const Receipt receipt{commit.request_id, before.revision + 1, commit.applied.object_ids,
                          commit.request_digest};
    receipts_[commit.request_id] = {receipt, commit.time};
  }
  AddEvidence(rng, &commit);
  return commit;
}

void ModelMap::AddEvidence(Rng& rng, Commit* commit) {
  for (const Change& change : commit->applied.changes) {
    if (const auto* deleted = std::get_if<LayerDeleted>(&change)) {
      evidence_.erase(deleted->spec.name);
    }
  }
  for (const char* layer : {"semantic", "dock.objects"}) {
    if (commit->applied.snapshot->FindSemantic(layer) == nullptr) continue;
    if (UniformInt(rng, 0, 1) == 0) continue;
    EvidenceModel& evidence = evidence_[layer];
    commit->fusion.push_back(evidence.RandomChange(rng, layer));
    evidence.Apply(commit->fusion.back());
  }
}

void ModelMap::WriteGroup(Rng& rng) {
  std::vector<Commit> commits;
  for (int i = UniformInt(rng, 1, 3); i > 0; --i) {
    const Snapshot& before = commits.empty() ? history_.now() : *commits.back().applied.snapshot;
    commits.push_back(RandomCommit(rng, before));
  }
  history_.WriteCommits(commits);
}

void ModelMap::WriteAsReplica(Rng& rng) {
  std::vector<EditBatch> batches;
  SnapshotPtr now = std::make_shared<Snapshot>(history_.now());
  for (int i = UniformInt(rng, 1, 4); i > 0; --i) {
    batches.push_back(NextBatch(rng, *now));
    const Commit commit = MakeCommit(*now, batches.back());
    now = commit.applied.snapshot;
  }
  const std::vector<Change> changes = history_.WriteSquashed(batches);
  for (const Change& change : changes) {
    if (const auto* deleted = std::get_if<LayerDeleted>(&change)) {
      evidence_.erase(deleted->spec.name);
    }
  }
  oldest_ = history_.newest();
  history_.Compact(oldest_, 100);
  SettleCompaction(absl::InfinitePast());
}

Revision ModelMap::RandomKept(Rng& rng) const {
  return UniformInt(rng, static_cast<int>(oldest_), static_cast<int>(history_.newest()));
}

void ModelMap::CompactOnce(Rng& rng) {
  const Revision oldest = RandomKept(rng);
  const absl::Time receipts_before =
      oldest == 0 ? absl::InfinitePast() : history_.commit(oldest).time;
  oldest_ = oldest;
  receipts_may_end_ = std::max(receipts_may_end_, receipts_before);
  const auto more = history_.stored().Compact(oldest, receipts_before, UniformInt(rng, 1, 20));
  ASSERT_TRUE(more.ok()) << more.status();
  if (!*more) SettleCompaction(receipts_before);
}

void ModelMap::CompactAll(Rng& rng) {
  oldest_ = RandomKept(rng);
  const absl::Time receipts_before =
      oldest_ == 0 ? absl::InfinitePast() : history_.commit(oldest_).time;
  history_.Compact(oldest_, UniformInt(rng, 1, 200), receipts_before);
  SettleCompaction(receipts_before);
}

void ModelMap::SettleCompaction(absl::Time receipts_before) {
  for (auto& [layer, evidence] : evidence_) evidence.RemoveForgotten();
  for (auto it = receipts_.begin(); it != receipts_.end();) {
    it = it->second.time < receipts_before ? receipts_.erase(it) : std::next(it);
  }
  if (receipts_may_end_ <= receipts_before) receipts_may_end_ = absl::InfinitePast();
}

void ModelMap::KeepCheckpoint(Rng& rng) {
  for (auto& [layer, evidence] : evidence_) {
    const auto [checkpoint, dropped] = evidence.RandomCheckpoint(rng);
    const absl::Status status =
        history_.stored().fusion_log().KeepCheckpoint(layer, checkpoint, dropped);
    ASSERT_TRUE(status.ok()) << status;
    evidence.Keep(checkpoint, dropped);
  }
}

void ModelMap::MoveBase(Rng& rng) {
  for (auto& [layer, evidence] : evidence_) {
    const auto next = evidence.NextBase(absl::FromUnixNanos(UniformInt(rng, 0, 101)));
    if (!next) continue;
    const absl::Status status = history_.stored().fusion_log().MoveBase(layer, next->key);
    ASSERT_TRUE(status.ok()) << status;
    evidence.MoveBase(next->key);
  }
}

void ModelMap::AddMark(Rng& rng) {
  const TimeMark mark = MarkAt(10 * ++num_marks_);
  const absl::Duration forget_before = absl::Seconds(UniformInt(rng, 0, 10 * num_marks_));
  const absl::Status status = history_.stored().AddTimeMark(mark, forget_before);
  ASSERT_TRUE(status.ok()) << status;
  marks_.push_back(mark);
  while (marks_.size() > 1 && marks_[1].passed < forget_before) marks_.erase(marks_.begin());
}

void ModelMap::ExpectSame(Rng& rng) {
  SCOPED_TRACE(header_.name);
  ExpectSameHeader();
  const auto snapshot = history_.stored().Load();
  ASSERT_TRUE(snapshot.ok()) << snapshot.status();
  hypermap::storage::ExpectSame(**snapshot, history_.now());
  EXPECT_EQ((*snapshot)->layer_versions, history_.now().layer_versions);
  ExpectSameReceipts();
  const auto marks = history_.stored().TimeMarks();
  ASSERT_TRUE(marks.ok()) << marks.status();
  EXPECT_EQ(*marks, marks_);
  const std::unique_ptr<HistoryReader> reader = history_.Reader();
  ASSERT_NE(reader, nullptr);
  ExpectAllAsRecorded(rng, *reader, history_, oldest_);
  ExpectSameRevisions(rng, *reader);
  ExpectSameTimes(rng, *reader);
  ExpectSameEvidence(rng);
}

void ModelMap::ExpectSameHeader() {
  const MapHeader& header = history_.stored().header();
  EXPECT_EQ(header.name, header_.name);
  EXPECT_EQ(header.frame_id, header_.frame_id);
  EXPECT_EQ(header.created_at, header_.created_at);
  EXPECT_EQ(header.request_id, header_.request_id);
  EXPECT_EQ(header.incarnation, header_.incarnation);
  EXPECT_TRUE(history_.stored().CheckFile().ok());
  EXPECT_TRUE(history_.stored().damage().ok());
}

void ModelMap::ExpectSameReceipts() {
  for (Revision revision = 0; revision <= history_.newest() + 1; ++revision) {
    const std::string id = absl::StrCat("request ", revision);
    const auto found = history_.stored().FindReceipt(id);
    ASSERT_TRUE(found.ok()) << found.status();
    const auto expected = receipts_.find(id);
    if (expected == receipts_.end()) {
      EXPECT_EQ(*found, std::nullopt) << id;
      continue;
    }
    if (!found->has_value() && expected->second.time < receipts_may_end_) continue;
    ASSERT_TRUE(found->has_value()) << id;
    const Receipt& receipt = expected->second.receipt;
    EXPECT_EQ((*found)->request_id, receipt.request_id);
    EXPECT_EQ((*found)->revision, receipt.revision);
    EXPECT_EQ((*found)->object_ids, receipt.object_ids);
    EXPECT_EQ((*found)->request_digest, receipt.request_digest);
  }
}

void ModelMap::ExpectSameRevisions(Rng& rng, HistoryReader& reader) const {
  const int newest = static_cast<int>(history_.newest());
  const Revision after = UniformInt(rng, -1, newest);
  const Revision before = UniformInt(rng, 0, newest + 2);
  const bool newest_first = UniformInt(rng, 0, 1) == 0;
  const size_t max_count = UniformInt(rng, 0, newest + 1);
  std::vector<RevisionRecord> expected;
  for (Revision revision = std::max(oldest_, Revision{1}); revision <= newest; ++revision) {
    if (revision <= after || revision >= before) continue;
    const Commit& commit = history_.commit(revision);
    expected.push_back({revision, commit.time, commit.author,
                        static_cast<int64_t>(commit.applied.changes.size())});
  }
  if (newest_first) std::reverse(expected.begin(), expected.end());
  if (expected.size() > max_count) expected.resize(max_count);
  const auto records = reader.Revisions(after, before, newest_first, static_cast<int>(max_count));
  ASSERT_TRUE(records.ok()) << records.status();
  EXPECT_EQ(*records, expected);
}

void ModelMap::ExpectSameTimes(Rng& rng, HistoryReader& reader) const {
  const Revision revision = RandomKept(rng);
  const absl::Time time = revision == 0 ? header_.created_at : history_.commit(revision).time;
  EXPECT_EQ(*reader.RevisionAt(time), revision);
  const auto before = reader.RevisionAt(time - absl::Nanoseconds(1));
  if (revision == oldest_) {
    EXPECT_TRUE(absl::IsOutOfRange(before.status())) << before.status();
  } else {
    EXPECT_EQ(*before, revision - 1);
  }
  EXPECT_EQ(*reader.RevisionAt(absl::InfiniteFuture()), history_.newest());
  EXPECT_TRUE(absl::IsOutOfRange(reader.RevisionAt(absl::InfinitePast()).status()));
}

void ModelMap::ExpectSameEvidence(Rng& rng) {
  FusionLog& log = history_.stored().fusion_log();
  std::vector<std::pair<std::string, FusionSettings>> settings;
  for (const auto& [layer, evidence] : evidence_) {
    settings.emplace_back(layer, *evidence.settings());
  }
  const auto layers = log.FusedLayers();
  ASSERT_TRUE(layers.ok()) << layers.status();
  EXPECT_THAT(*layers, ::testing::UnorderedElementsAreArray(settings));
  for (const auto& [layer, evidence] : evidence_) evidence.ExpectSame(rng, log, layer);
  EvidenceModel().ExpectSame(rng, log, "no such layer");
}

}  // namespace hypermap::storage
