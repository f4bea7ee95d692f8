#include "server/session/map_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <future>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/admission/refusals.h"
#include "base/cancellation/cancellation.h"
#include "base/cancellation/testing/cancelled_after.h"
#include "server/session/testing/memory_map_store.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

using Answer = absl::StatusOr<storage::Receipt>;

EditBatch CreateThings(const std::string& layer) {
  LayerSpec spec;
  spec.name = layer;
  return {{CreateLayer{spec}}};
}

EditBatch PutCup() {
  PutObject put{"things", {}, ""};
  put.object.label = "cup";
  put.object.shape = Polygon::FromBox({{0, 0}, {1, 1}});
  return {{put}};
}

// As the reserve of a backup: there is room for all.
absl::Status AnySize(int64_t /*most_bytes*/) { return absl::OkStatus(); }

// A batch whose second edit fails.
EditBatch PutCupInTwoLayers() {
  EditBatch batch = PutCup();
  batch.edits.push_back(batch.edits.front());
  std::get<PutObject>(batch.edits.back()).layer = "nowhere";
  return batch;
}

class MapSessionTest : public ::testing::Test {
 protected:
  // A session of a map with the empty layer "things" at revision 1.
  void SetUp() override {
    MemoryMapStore store(&disk_);
    ASSERT_TRUE(store.Create({"site", "map", absl::UnixEpoch(), ""}).ok());
    Reopen();
    ASSERT_TRUE(session_->SubmitAndWait({CreateThings("things"), "test", ""}).ok());
  }

  void Reopen(SessionOptions options = {}) {
    // Tests count what is written together, however long that takes.
    options.max_group_time = absl::InfiniteDuration();
    session_.reset();
    MemoryMapStore store(&disk_);
    auto stored = store.Open("site");
    ASSERT_TRUE(stored.ok()) << stored.status();
    auto session = MapSession::Start(*std::move(stored), options);
    ASSERT_TRUE(session.ok()) << session.status();
    session_ = *std::move(session);
  }

  std::future<Answer> Submit(EditBatch batch, const std::string& request_id = "") {
    return Submit(Submission{std::move(batch), "test", request_id});
  }
  std::future<Answer> SubmitFrom(const std::string& client, EditBatch batch) {
    Submission submission{std::move(batch), "test", ""};
    submission.client = client;
    return Submit(std::move(submission));
  }
  std::future<Answer> Submit(Submission submission) {
    auto promise = std::make_shared<std::promise<Answer>>();
    session_->Submit(std::move(submission),
                     [promise](Answer answer) { promise->set_value(std::move(answer)); });
    return promise->get_future();
  }

  // Makes the writer wait for the disk with one batch, so that later submissions queue.
  std::future<Answer> HoldWriter() {
    disk_.Hold();
    auto held = Submit(PutCup());
    disk_.AwaitHeldWrite();
    return held;
  }

  int64_t NumThings() const { return session_->snapshot()->FindLayer("things")->Size(); }

  MemoryDisk disk_;
  std::unique_ptr<MapSession> session_;
};

TEST_F(MapSessionTest, AnswersWhenTheBatchIsStoredAndVisible) {
  const Answer receipt = session_->SubmitAndWait({PutCup(), "test", "r1"});
  ASSERT_TRUE(receipt.ok()) << receipt.status();
  EXPECT_EQ(receipt->revision, 2);
  EXPECT_EQ(receipt->request_id, "r1");
  EXPECT_THAT(receipt->object_ids, ElementsAre(1));
  EXPECT_EQ(session_->snapshot()->revision, 2);
  EXPECT_EQ(NumThings(), 1);
  Reopen();
  EXPECT_EQ(session_->snapshot()->revision, 2);
}

TEST_F(MapSessionTest, AnswersAreGivenInOrderWhileTheNextGroupIsWritten) {
  const std::unique_ptr<Answers> answers = *Answers::Start();
  SessionOptions options;
  options.answers = answers.get();
  Reopen(options);
  const std::future<Answer> held = HoldWriter();
  std::vector<int> order;  // used by one thread after another
  std::promise<void> all_answered;
  session_->Submit({PutCup(), "test", ""}, [&](const Answer&) {
    order.push_back(1);
    session_->Submit({PutCup(), "test", ""}, [&](const Answer&) {
      order.push_back(3);
      all_answered.set_value();
    });
  });
  session_->Submit({PutCup(), "test", ""}, [&](const Answer&) {
    // The writer, which writes it, must not wait here.
    std::promise<void> written;
    session_->feed().Await(4, [&] { written.set_value(); });
    written.get_future().wait();
    order.push_back(2);
  });
  disk_.Release();
  all_answered.get_future().wait();
  EXPECT_THAT(order, ElementsAre(1, 2, 3));
  session_.reset();
}

TEST_F(MapSessionTest, AnswersBeforeItCallsThoseWhoWaitForTheRevision) {
  // Used by the writer's thread only, until `woken`.
  std::vector<std::string> order;
  std::promise<void> woken;
  session_->feed().Await(1, [&] {
    EXPECT_EQ(session_->snapshot()->revision, 2);
    order.emplace_back("woken");
    woken.set_value();
  });
  session_->Submit({PutCup(), "test", ""}, [&](const Answer& answer) {
    EXPECT_EQ(answer->revision, 2);
    // A client that has the answer finds the revision, also in the feed.
    EXPECT_EQ(session_->snapshot()->revision, 2);
    const auto commits = session_->feed().Read(1, 100);
    ASSERT_TRUE(commits.has_value());
    EXPECT_EQ(commits->size(), 1u);
    EXPECT_TRUE(session_->feed().StructureAt(2).has_value());
    order.emplace_back("answered");
  });
  woken.get_future().wait();
  EXPECT_THAT(order, ElementsAre("answered", "woken"));
}

TEST_F(MapSessionTest, ReadersDoNotWaitForTheDiskAndSeeNothingUnwritten) {
  auto held = HoldWriter();
  EXPECT_EQ(session_->snapshot()->revision, 1);
  EXPECT_EQ(NumThings(), 0);
  disk_.Release();
  EXPECT_EQ(held.get()->revision, 2);
  EXPECT_EQ(NumThings(), 1);
}

TEST_F(MapSessionTest, A4_BatchWhoseCallerHasGoneIsNotCarriedOut) {
  auto held = HoldWriter();
  bool is_gone = false;
  int looks = 0;
  Submission submission{PutCup(), "test", "r1"};
  submission.cancellation = std::make_shared<Cancellation>(
      [&] {
        ++looks;
        return is_gone ? absl::CancelledError("gone") : absl::OkStatus();
      },
      absl::ZeroDuration());
  std::promise<Answer> answer;
  session_->Submit(std::move(submission),
                   [&answer](Answer receipt) { answer.set_value(std::move(receipt)); });
  auto other = Submit(PutCup());
  is_gone = true;
  disk_.Release();
  EXPECT_TRUE(absl::IsCancelled(answer.get_future().get().status()));
  EXPECT_EQ(looks, 1);
  EXPECT_EQ(held.get()->revision, 2);
  EXPECT_EQ(other.get()->revision, 3);
  EXPECT_EQ(NumThings(), 2);
  // The request was not carried out, so that a retry is.
  EXPECT_EQ(session_->SubmitAndWait({PutCup(), "test", "r1"})->revision, 4);
}

TEST_F(MapSessionTest, A4_CallsThatWaitForTheWriterUseTheirOwnCancellation) {
  EXPECT_GT(TimesCancelled([&] {
              return session_->SubmitAndWait({PutCup(), "test", ""}).status();
            }),
            1);
  EXPECT_EQ(NumThings(), 1);
  // The caller looks while it waits, and the task when it begins.
  EXPECT_GE(TimesCancelled([&] { return session_->FindReceipt("r1").status(); }), 1);
}

// A submission with a cancellation that is looked at each time.
Submission WithCaller(EditBatch batch, Cancellation::Look look) {
  Submission submission{std::move(batch), "test", ""};
  submission.cancellation = std::make_shared<Cancellation>(std::move(look), absl::ZeroDuration());
  return submission;
}

TEST_F(MapSessionTest, AWriteIsGivenUpWhenItsCallerHasGone) {
  std::atomic<bool> is_gone = false;
  disk_.Hold();
  std::promise<Answer> answer;
  session_->Submit(
      WithCaller(PutCup(),
                 [&] { return is_gone ? absl::CancelledError("gone") : absl::OkStatus(); }),
      [&answer](Answer receipt) { answer.set_value(std::move(receipt)); });
  disk_.AwaitHeldWrite();
  is_gone = true;
  disk_.Release();
  EXPECT_TRUE(absl::IsCancelled(answer.get_future().get().status()));
  EXPECT_EQ(session_->snapshot()->revision, 1);
  EXPECT_EQ(session_->SubmitAndWait({PutCup(), "test", ""})->revision, 2);
  EXPECT_EQ(NumThings(), 1);
}

TEST_F(MapSessionTest, AWriteForWhichSomebodyWaitsIsCompleted) {
  auto held = HoldWriter();
  // The first caller goes when the batch of the second one is applied.
  bool is_gone = false;
  std::promise<Answer> first, second;
  session_->Submit(
      WithCaller(PutCup(),
                 [&] { return is_gone ? absl::CancelledError("gone") : absl::OkStatus(); }),
      [&first](Answer receipt) { first.set_value(std::move(receipt)); });
  session_->Submit(WithCaller(PutCup(),
                              [&] {
                                is_gone = true;
                                return absl::OkStatus();
                              }),
                   [&second](Answer receipt) { second.set_value(std::move(receipt)); });
  disk_.Release();
  EXPECT_EQ(held.get()->revision, 2);
  EXPECT_EQ(first.get_future().get()->revision, 3);
  EXPECT_EQ(second.get_future().get()->revision, 4);
}

TEST_F(MapSessionTest, LayersBeyondTheLimitAreRefusedBeforeAnythingIsWritten) {
  SessionOptions options;
  options.limits.max_layers = 3;
  Reopen(options);
  const size_t num_writes = disk_.writes().size();
  EditBatch batch;
  for (int i = 0; i < 3; ++i) {
    batch.edits.push_back(CreateLayer{{.name = absl::StrCat("layer", i)}});
  }
  const absl::Status refused = session_->SubmitAndWait({batch, "test", ""}).status();
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr("--max_layers"));
  EXPECT_EQ(disk_.writes().size(), num_writes);
  batch.edits.pop_back();
  EXPECT_TRUE(session_->SubmitAndWait({batch, "test", ""}).ok());
}

TEST_F(MapSessionTest, SnapshotHeldByAReaderStaysAsItWas) {
  const SnapshotPtr before = session_->snapshot();
  ASSERT_TRUE(session_->SubmitAndWait({PutCup(), "test", ""}).ok());
  EXPECT_EQ(before->revision, 1);
  EXPECT_EQ(before->FindLayer("things")->Size(), 0);
}

TEST_F(MapSessionTest, BatchesThatQueueAreWrittenTogetherEachItsRevision) {
  auto held = HoldWriter();
  std::vector<std::future<Answer>> queued;
  for (int i = 0; i < 5; ++i) queued.push_back(Submit(PutCup()));
  disk_.Release();
  EXPECT_EQ(held.get()->revision, 2);
  for (int i = 0; i < 5; ++i) {
    const Answer answer = queued[i].get();
    ASSERT_TRUE(answer.ok()) << answer.status();
    EXPECT_EQ(answer->revision, 3 + i);
  }
  EXPECT_THAT(disk_.writes(), ElementsAre(1, 1, 5));
}

TEST_F(MapSessionTest, BatchThatFailsChangesNothingAndSpoilsNoOther) {
  auto held = HoldWriter();
  auto good = Submit(PutCup());
  auto bad = Submit(PutCupInTwoLayers(), "bad");
  auto also_good = Submit(PutCup());
  disk_.Release();
  EXPECT_EQ(good.get()->revision, 3);
  EXPECT_TRUE(absl::IsNotFound(bad.get().status()));
  EXPECT_EQ(also_good.get()->revision, 4);
  EXPECT_EQ(NumThings(), 3);
}

TEST_F(MapSessionTest, FailedWritePublishesNothingAndIsToldToAll) {
  auto held = HoldWriter();
  disk_.FailWrites(absl::UnavailableError("disk is gone"));
  auto one = Submit(PutCup(), "r1");
  // Its own error is not the answer: it was applied to a map that is never stored.
  auto two = Submit(PutCupInTwoLayers());
  disk_.Release();
  EXPECT_EQ(held.get().status(), absl::UnavailableError("disk is gone"));
  EXPECT_EQ(one.get().status(), absl::UnavailableError("disk is gone"));
  EXPECT_EQ(two.get().status(), absl::UnavailableError("disk is gone"));
  EXPECT_EQ(session_->snapshot()->revision, 1);

  disk_.FailWrites(absl::OkStatus());
  const Answer again = session_->SubmitAndWait({PutCup(), "test", "r1"});
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->revision, 2);
}

TEST_F(MapSessionTest, C6AnotherRequestWithTheIdIsRefusedAlsoAfterARestart) {
  const Answer first = session_->SubmitAndWait({PutCup(), "test", "r1", "one"});
  ASSERT_TRUE(first.ok()) << first.status();
  for (int i = 0; i < 2; ++i) {
    const Answer other = session_->SubmitAndWait({CreateThings("more"), "test", "r1", "two"});
    EXPECT_EQ(other.status(),
              absl::InvalidArgumentError("request_id \"r1\" was used for another request, which "
                                         "made revision 2; choose an id of its own for each "
                                         "request"));
    const Answer command = session_->RunAndWait(
        FusionSubmission{RebuildFusion{"things", "", ""}, "test", "r1", "three"});
    EXPECT_TRUE(absl::IsInvalidArgument(command.status())) << command.status();
    const Answer again = session_->SubmitAndWait({PutCup(), "test", "r1", "one"});
    ASSERT_TRUE(again.ok()) << again.status();
    EXPECT_EQ(again->revision, first->revision);
    EXPECT_EQ(session_->snapshot()->revision, 2);
    Reopen();
  }
}

TEST_F(MapSessionTest, C6AnotherRequestWithTheIdInTheSameGroupIsRefused) {
  const auto submit = [this](const std::string& digest) {
    auto promise = std::make_shared<std::promise<Answer>>();
    session_->Submit({PutCup(), "test", "r1", digest},
                     [promise](Answer answer) { promise->set_value(std::move(answer)); });
    return promise->get_future();
  };
  auto held = HoldWriter();
  auto one = submit("one");
  auto other = submit("two");
  auto again = submit("one");
  disk_.Release();
  EXPECT_TRUE(held.get().ok());
  EXPECT_EQ(one.get()->revision, 3);
  EXPECT_TRUE(absl::IsInvalidArgument(other.get().status()));
  EXPECT_EQ(again.get()->revision, 3);
  EXPECT_EQ(session_->snapshot()->revision, 3);
}

TEST_F(MapSessionTest, C6ReceiptWithoutADigestAnswersAnyRequestWithItsId) {
  // As receipts of older versions.
  ASSERT_TRUE(session_->SubmitAndWait({PutCup(), "test", "r1"}).ok());
  const Answer again = session_->SubmitAndWait({PutCup(), "test", "r1", "one"});
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->revision, 2);
}

TEST_F(MapSessionTest, SameRequestGetsTheSameReceiptAndChangesNothing) {
  const Answer first = session_->SubmitAndWait({PutCup(), "test", "r1"});
  const Answer again = session_->SubmitAndWait({PutCup(), "test", "r1"});
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->revision, first->revision);
  EXPECT_EQ(again->object_ids, first->object_ids);
  Reopen();
  const Answer later = session_->SubmitAndWait({PutCup(), "test", "r1"});
  ASSERT_TRUE(later.ok()) << later.status();
  EXPECT_EQ(later->revision, first->revision);
  EXPECT_EQ(NumThings(), 1);
}

TEST_F(MapSessionTest, SameRequestTwiceInTheQueueIsCarriedOutOnce) {
  auto held = HoldWriter();
  auto first = Submit(PutCup(), "r1");
  auto second = Submit(PutCup(), "r1");
  disk_.Release();
  const Answer receipt = first.get();
  ASSERT_TRUE(receipt.ok()) << receipt.status();
  EXPECT_EQ(second.get()->revision, receipt->revision);
  EXPECT_EQ(NumThings(), 2);
}

TEST_F(MapSessionTest, RequestThatFailedMayBeSentAgain) {
  EXPECT_FALSE(session_->SubmitAndWait({PutCupInTwoLayers(), "test", "r1"}).ok());
  ASSERT_TRUE(session_->SubmitAndWait({CreateThings("nowhere"), "test", ""}).ok());
  EXPECT_TRUE(session_->SubmitAndWait({PutCupInTwoLayers(), "test", "r1"}).ok());
}

TEST_F(MapSessionTest, FullQueueRefusesNamingTheLimit) {
  SessionOptions options;
  options.limits.max_queue = 2;
  Reopen(options);
  auto held = HoldWriter();
  auto one = Submit(PutCup());
  auto two = Submit(PutCup());
  const Answer refused = Submit(PutCup()).get();
  EXPECT_TRUE(absl::IsResourceExhausted(refused.status())) << refused.status();
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("--max_queue"));
  disk_.Release();
  EXPECT_TRUE(one.get().ok());
  EXPECT_TRUE(two.get().ok());
}

EditBatch PutCupWithNote(size_t num_bytes) {
  EditBatch batch = PutCup();
  std::get<PutObject>(batch.edits.front()).object.attributes = {
      {"note", std::string(num_bytes, 'x')}};
  return batch;
}

TEST_F(MapSessionTest, B7QueueIsBoundedByItsBytes) {
  SessionOptions options;
  options.limits.max_queue_bytes = 10'000;
  Reopen(options);
  auto held = HoldWriter();
  // A submission of any size may wait alone.
  auto large = Submit(PutCupWithNote(1'000'000));
  const Answer refused = Submit(PutCup()).get();
  EXPECT_TRUE(absl::IsResourceExhausted(refused.status())) << refused.status();
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("--max_queue_bytes is 10000"));
  // A call that needs no place in the queue is not refused.
  auto receipt = std::async(std::launch::async, [this] { return session_->FindReceipt("none"); });
  disk_.Release();
  EXPECT_TRUE(held.get().ok());
  EXPECT_TRUE(large.get().ok());
  EXPECT_TRUE(receipt.get().ok());

  // A batch that was written has left the queue.
  held = HoldWriter();
  auto first = Submit(PutCupWithNote(6'000));
  EXPECT_TRUE(absl::IsResourceExhausted(Submit(PutCupWithNote(6'000)).get().status()));
  auto second = Submit(PutCup());
  disk_.Release();
  EXPECT_TRUE(first.get().ok());
  EXPECT_TRUE(second.get().ok());
}

TEST_F(MapSessionTest, AClientFillsHalfOfThePlacesInTheQueue) {
  SessionOptions options;
  options.limits.max_queue = 5;
  Reopen(options);
  for (int round = 0; round < 2; ++round) {
    auto held = HoldWriter();
    std::vector<std::future<Answer>> accepted;
    for (int i = 0; i < 2; ++i) accepted.push_back(SubmitFrom("10.0.0.1", PutCup()));
    const absl::Status refused = SubmitFrom("10.0.0.1", PutCup()).get().status();
    EXPECT_TRUE(admission::IsTryLater(refused)) << refused;
    EXPECT_THAT(std::string(refused.message()), HasSubstr("one client"));
    EXPECT_THAT(std::string(refused.message()), HasSubstr("half of --max_queue, 5"));
    // There is room for another client, and for the server itself.
    accepted.push_back(SubmitFrom("10.0.0.2", PutCup()));
    for (int i = 0; i < 2; ++i) accepted.push_back(Submit(PutCup()));
    const absl::Status full = Submit(PutCup()).get().status();
    EXPECT_THAT(std::string(full.message()), HasSubstr("--max_queue is 5"));
    disk_.Release();
    EXPECT_TRUE(held.get().ok());
    // Written batches have left the queue: the client has its half again.
    for (std::future<Answer>& answer : accepted) EXPECT_TRUE(answer.get().ok());
  }
}

TEST_F(MapSessionTest, AClientHasAPlaceInAQueueOfOne) {
  SessionOptions options;
  options.limits.max_queue = 1;
  Reopen(options);
  EXPECT_TRUE(SubmitFrom("10.0.0.1", PutCup()).get().ok());
}

TEST_F(MapSessionTest, AClientFillsHalfOfTheBytesInTheQueue) {
  SessionOptions options;
  options.limits.max_queue_bytes = 20'000;
  Reopen(options);
  auto held = HoldWriter();
  // The first of a client may be larger than its half, if the queue has room.
  auto large = SubmitFrom("10.0.0.1", PutCupWithNote(12'000));
  const absl::Status refused = SubmitFrom("10.0.0.1", PutCup()).get().status();
  EXPECT_TRUE(admission::IsTryLater(refused)) << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr("half of --max_queue_bytes, 20000"));
  const absl::Status full = SubmitFrom("10.0.0.2", PutCupWithNote(12'000)).get().status();
  EXPECT_THAT(std::string(full.message()), Not(HasSubstr("one client")));
  auto other = SubmitFrom("10.0.0.2", PutCupWithNote(2'000));
  auto own = Submit(PutCupWithNote(2'000));
  disk_.Release();
  EXPECT_TRUE(held.get().ok());
  EXPECT_TRUE(large.get().ok());
  EXPECT_TRUE(other.get().ok());
  EXPECT_TRUE(own.get().ok());
}

TEST_F(MapSessionTest, ObservationsAndCommandsCountForTheirClient) {
  SessionOptions options;
  options.limits.max_queue = 4;
  Reopen(options);
  auto held = HoldWriter();
  ObservationSubmission observations{"things", {}, "robot"};
  observations.client = "10.0.0.1";
  FusionSubmission command{RebuildFusion{"things", "", ""}, "test", ""};
  command.client = "10.0.0.1";
  std::promise<void> observed, commanded;
  session_->Observe(std::move(observations), [&](const auto&) { observed.set_value(); });
  session_->Run(std::move(command), [&](const Answer&) { commanded.set_value(); });
  const absl::Status refused = SubmitFrom("10.0.0.1", PutCup()).get().status();
  EXPECT_THAT(std::string(refused.message()), HasSubstr("half of --max_queue, 4"));
  disk_.Release();
  EXPECT_TRUE(held.get().ok());
  observed.get_future().wait();
  commanded.get_future().wait();
}

TEST_F(MapSessionTest, B7ObservationsCountByTheirBytes) {
  SessionOptions options;
  options.limits.max_queue_bytes = 10'000;
  Reopen(options);
  auto held = HoldWriter();
  auto queued = Submit(PutCup());
  ObservationSubmission submission{"things", {}, "robot"};
  submission.observations.emplace_back().depth.emplace().depth_mm.resize(10'000);
  std::promise<absl::Status> answer;
  session_->Observe(std::move(submission),
                    [&answer](auto verdicts) { answer.set_value(verdicts.status()); });
  EXPECT_THAT(std::string(answer.get_future().get().message()), HasSubstr("--max_queue_bytes"));
  disk_.Release();
  EXPECT_TRUE(queued.get().ok());
}

TEST_F(MapSessionTest, B1GroupEndsWhereItsChangesAreLarge) {
  SessionOptions options;
  options.max_group_bytes = 10'000;
  Reopen(options);
  auto held = HoldWriter();
  std::vector<std::future<Answer>> queued;
  for (int i = 0; i < 5; ++i) queued.push_back(Submit(PutCupWithNote(6'000)));
  disk_.Release();
  EXPECT_TRUE(held.get().ok());
  for (int i = 0; i < 5; ++i) EXPECT_EQ(queued[i].get()->revision, 3 + i);
  EXPECT_THAT(disk_.writes(), ElementsAre(1, 1, 2, 2, 1));
}

TEST_F(MapSessionTest, CloseFinishesWhatWasAcceptedAndTakesNothingMore) {
  auto held = HoldWriter();
  auto queued = Submit(PutCup());
  std::thread closing([this] { session_->Close(); });
  disk_.Release();
  closing.join();
  EXPECT_EQ(held.get()->revision, 2);
  EXPECT_EQ(queued.get()->revision, 3);
  EXPECT_TRUE(absl::IsUnavailable(Submit(PutCup()).get().status()));
  EXPECT_TRUE(absl::IsUnavailable(session_->BackupTo("/nowhere", AnySize)));
  EXPECT_EQ(session_->snapshot()->revision, 3);
}

TEST_F(MapSessionTest, BackupIsOfAStoredRevision) {
  ASSERT_TRUE(session_->SubmitAndWait({PutCup(), "test", ""}).ok());
  const testing::TemporaryFolder folder;
  const std::string path = folder / "backup";
  ASSERT_TRUE(session_->BackupTo(path, AnySize).ok());
  std::ifstream file(path);
  const std::string content((std::istreambuf_iterator<char>(file)), {});
  EXPECT_EQ(content, "copy of site at revision 2");
}

TEST_F(MapSessionTest, TasksDoNotWaitForAllSubmissionsThatQueueBeforeThem) {
  constexpr int kBatches = 3000;
  SessionOptions options;
  options.max_group_bytes = 1;
  options.limits.max_queue = 2 * kBatches;
  Reopen(options);
  auto held = HoldWriter();
  std::future<Answer> last;
  for (int i = 0; i < kBatches; ++i) last = Submit(PutCup());
  const testing::TemporaryFolder folder;
  std::promise<void> begins;
  auto revision = std::async(std::launch::async, [&] {
    Revision revision = 0;
    begins.set_value();
    const absl::Status status = session_->BackupTo(folder / "backup", [&](int64_t) {
      revision = session_->snapshot()->revision;
      return absl::OkStatus();
    });
    EXPECT_TRUE(status.ok()) << status;
    return revision;
  });
  begins.get_future().wait();
  disk_.Release();
  EXPECT_LT(revision.get(), 2 + kBatches);
  EXPECT_EQ(last.get()->revision, 2 + kBatches);
}

TEST_F(MapSessionTest, CallerThatHasGoneDoesNotWaitForTheWriter) {
  auto held = HoldWriter();
  auto status = std::async(std::launch::async, [&] {
    const CancelledAfter cancelled(2);
    return session_->BackupTo("/nowhere", [](int64_t) {
      ADD_FAILURE() << "the task has begun";
      return absl::OkStatus();
    });
  });
  EXPECT_TRUE(absl::IsCancelled(status.get()));
  disk_.Release();
  EXPECT_TRUE(held.get().ok());
  EXPECT_TRUE(session_->SubmitAndWait({PutCup(), "test", ""}).ok());
}

TEST_F(MapSessionTest, NothingIsWrittenOfABackupForWhichThereIsNoRoom) {
  const testing::TemporaryFolder folder;
  const std::string path = folder / "backup";
  int64_t asked = 0;
  const absl::Status status = session_->BackupTo(path, [&](int64_t most_bytes) {
    asked = most_bytes;
    EXPECT_FALSE(std::filesystem::exists(path));
    return absl::ResourceExhaustedError("full");
  });
  EXPECT_EQ(status, absl::ResourceExhaustedError("full"));
  EXPECT_GT(asked, 0);
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST_F(MapSessionTest, ManyWritersAndReadersSeeRevisionsInOrder) {
  constexpr int kWriters = 4;
  constexpr int kBatches = 50;
  std::atomic<bool> done = false;
  std::thread reader([&] {
    Revision last = 0;
    while (!done) {
      const SnapshotPtr snapshot = session_->snapshot();
      EXPECT_GE(snapshot->revision, last);
      // Revision 1 made the layer, every later one put an object.
      EXPECT_EQ(snapshot->FindLayer("things")->Size(), snapshot->revision - 1);
      last = snapshot->revision;
    }
  });
  std::vector<std::thread> writers;
  for (int w = 0; w < kWriters; ++w) {
    writers.emplace_back([&] {
      Revision last = 0;
      for (int i = 0; i < kBatches; ++i) {
        const Answer answer = session_->SubmitAndWait({PutCup(), "test", ""});
        ASSERT_TRUE(answer.ok()) << answer.status();
        EXPECT_GT(answer->revision, last);
        EXPECT_GE(session_->snapshot()->revision, answer->revision);
        last = answer->revision;
      }
    });
  }
  for (std::thread& writer : writers) writer.join();
  done = true;
  reader.join();
  EXPECT_EQ(session_->snapshot()->revision, 1 + kWriters * kBatches);
}

}  // namespace
}  // namespace hypermap::server
