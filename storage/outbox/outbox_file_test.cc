#include "storage/outbox/outbox_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "storage/sqlite/sqlite.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr absl::Time kNoon = absl::FromUnixSeconds(1'700'000'000);
constexpr int64_t kMaxBytes = 1 << 20;

SendTime SentAt(absl::Time wall) { return {wall, true, "boot 1", absl::Hours(2)}; }

class OutboxFileTest : public ::testing::Test {
 protected:
  OutboxFileTest() { Open(); }

  void Open() {
    file_.reset();
    auto file = OutboxFile::Open(path_, kMaxBytes);
    ASSERT_TRUE(file.ok()) << file.status();
    file_ = *std::move(file);
  }

  int64_t StreamOf(const std::string& map, const std::string& layer = "",
                   const std::string& robot = "") {
    const absl::StatusOr<OutboxStream> stream = file_->FindStream(map, layer, robot);
    EXPECT_TRUE(stream.ok()) << stream.status();
    return stream->id;
  }

  int64_t Put(int64_t stream, const std::string& body) {
    QueuedRequest request;
    request.stream = stream;
    request.body = body;
    request.put_at = kNoon;
    const absl::StatusOr<int64_t> id = file_->Put(request);
    EXPECT_TRUE(id.ok()) << id.status();
    return id.value_or(0);
  }

  std::vector<QueuedRequest> First(int64_t stream, int limit = 100) {
    absl::StatusOr<std::vector<QueuedRequest>> requests = file_->First(stream, limit);
    EXPECT_TRUE(requests.ok()) << requests.status();
    return *std::move(requests);
  }

  std::vector<std::string> Bodies(int64_t stream, int limit = 100) {
    std::vector<std::string> bodies;
    for (const QueuedRequest& request : First(stream, limit)) bodies.push_back(request.body);
    return bodies;
  }

  // Sends all requests of the stream, and returns their sequence numbers.
  std::vector<int64_t> Sequences(int64_t stream, int64_t unused) {
    std::vector<QueuedRequest> requests = First(stream);
    EXPECT_EQ(file_->MarkSentInSequence(absl::MakeSpan(requests), unused, SentAt(kNoon)),
              absl::OkStatus());
    std::vector<int64_t> sequences;
    for (const QueuedRequest& request : requests) sequences.push_back(*request.sequence);
    return sequences;
  }

  void ExpectCounts(int64_t queued, int64_t delivered, int64_t refused) {
    const absl::StatusOr<OutboxCounts> counts = file_->Counts();
    ASSERT_TRUE(counts.ok()) << counts.status();
    EXPECT_EQ(counts->queued, queued);
    EXPECT_EQ(counts->delivered, delivered);
    EXPECT_EQ(counts->refused, refused);
  }

  TemporaryFolder folder_;
  const std::string path_ = folder_ / "outbox.db";
  std::unique_ptr<OutboxFile> file_;
};

TEST_F(OutboxFileTest, RequestsOfAStreamComeInOrderAlsoAfterOpeningAgain) {
  const int64_t office = StreamOf("office"), yard = StreamOf("yard");
  Put(office, "first");
  Put(yard, "elsewhere");
  Put(office, std::string("\0second", 7));
  EXPECT_THAT(Bodies(office), ElementsAre("first", std::string("\0second", 7)));
  Open();
  EXPECT_EQ(StreamOf("office"), office);
  EXPECT_THAT(Bodies(office), ElementsAre("first", std::string("\0second", 7)));
  EXPECT_THAT(Bodies(office, 1), ElementsAre("first"));
  EXPECT_EQ(First(office)[0].put_at, kNoon);
}

TEST_F(OutboxFileTest, WhatIsDeliveredIsGoneAndCounted) {
  const int64_t office = StreamOf("office");
  const int64_t first = Put(office, "first");
  Put(office, "second");
  ASSERT_EQ(file_->Settle({first}, {}), absl::OkStatus());
  EXPECT_THAT(Bodies(office), ElementsAre("second"));
  Open();
  ExpectCounts(1, 1, 0);
}

TEST_F(OutboxFileTest, NumbersAreNotUsedAgain) {
  const int64_t office = StreamOf("office");
  const int64_t first = Put(office, "first");
  ASSERT_EQ(file_->Settle({first}, {}), absl::OkStatus());
  Open();
  EXPECT_GT(Put(office, "second"), first);
}

TEST_F(OutboxFileTest, WhatIsRefusedIsSetAside) {
  const int64_t office = StreamOf("office", "chairs", "cart");
  const int64_t bad = Put(office, "bad");
  Put(office, "good");
  ASSERT_EQ(file_->Settle({}, {{{bad, absl::AbortedError("stale")}}}), absl::OkStatus());
  Open();
  EXPECT_THAT(Bodies(office), ElementsAre("good"));
  ExpectCounts(1, 0, 1);
  const absl::StatusOr<std::vector<RefusedRequest>> refused = file_->Refused();
  ASSERT_TRUE(refused.ok()) << refused.status();
  ASSERT_EQ(refused->size(), 1u);
  EXPECT_EQ(refused->front().request.body, "bad");
  EXPECT_EQ(refused->front().stream.robot, "cart");
  EXPECT_EQ(refused->front().why, absl::AbortedError("stale"));

  ASSERT_EQ(file_->PutBack(bad), absl::OkStatus());
  EXPECT_THAT(Bodies(office), ElementsAre("bad", "good"));
  EXPECT_TRUE(absl::IsNotFound(file_->PutBack(bad)));
  EXPECT_TRUE(absl::IsNotFound(file_->Discard(bad))) << "it is to be sent again";
  ASSERT_EQ(file_->Settle({}, {{{bad, absl::AbortedError("stale")}}}), absl::OkStatus());
  ASSERT_EQ(file_->Discard(bad), absl::OkStatus());
  ExpectCounts(1, 0, 0);
}

TEST_F(OutboxFileTest, SequencesAreGivenOnceAndNeverAgain) {
  const int64_t cart = StreamOf("office", "chairs", "cart");
  Put(cart, "a");
  Put(cart, "b");
  EXPECT_THAT(Sequences(cart, 5), ElementsAre(5, 6));
  Open();
  EXPECT_THAT(Sequences(cart, 100), ElementsAre(5, 6)) << "they may have arrived";
  const int64_t last = First(cart)[1].id;
  ASSERT_EQ(file_->Settle({First(cart)[0].id, last}, {}), absl::OkStatus());
  Put(cart, "c");
  EXPECT_THAT(Sequences(cart, 0), ElementsAre(100));
}

TEST_F(OutboxFileTest, TheTimeOfTheFirstSendingStays) {
  const int64_t office = StreamOf("office");
  Put(office, "a");
  std::vector<QueuedRequest> requests = First(office);
  EXPECT_EQ(requests[0].first_sent, std::nullopt);
  ASSERT_EQ(file_->MarkSent(absl::MakeSpan(requests), SentAt(kNoon)), absl::OkStatus());
  Open();
  requests = First(office);
  ASSERT_EQ(file_->MarkSent(absl::MakeSpan(requests), SentAt(kNoon + absl::Hours(1))),
            absl::OkStatus());
  EXPECT_EQ(First(office)[0].first_sent, SentAt(kNoon));
}

TEST_F(OutboxFileTest, ARequestThatIsPutBackWasNeverSent) {
  const int64_t office = StreamOf("office");
  Put(office, "a");
  std::vector<QueuedRequest> requests = First(office);
  ASSERT_EQ(file_->MarkSent(absl::MakeSpan(requests), SentAt(kNoon)), absl::OkStatus());
  ASSERT_EQ(file_->Settle({}, {{{requests[0].id, absl::AbortedError("stale")}}}), absl::OkStatus());
  ASSERT_EQ(file_->PutBack(requests[0].id), absl::OkStatus());
  EXPECT_EQ(First(office)[0].first_sent, std::nullopt);
}

TEST_F(OutboxFileTest, StreamsAreThoseWithRequestsToSend) {
  StreamOf("empty");
  const int64_t bad = Put(StreamOf("refused"), "bad");
  ASSERT_EQ(file_->Settle({}, {{{bad, absl::AbortedError("stale")}}}), absl::OkStatus());
  Put(StreamOf("office", "chairs", "cart"), "a");
  const absl::StatusOr<std::vector<OutboxStream>> streams = file_->Streams();
  ASSERT_TRUE(streams.ok()) << streams.status();
  ASSERT_EQ(streams->size(), 1u);
  EXPECT_EQ(streams->front().map, "office");
  EXPECT_EQ(streams->front().layer, "chairs");
  EXPECT_EQ(streams->front().robot, "cart");
}

TEST_F(OutboxFileTest, FullFileTakesNoMoreAndKeepsWhatItHas) {
  const int64_t office = StreamOf("office");
  QueuedRequest request;
  request.stream = office;
  request.body = std::string(100'000, 'x');
  int64_t taken = 0;
  absl::StatusOr<int64_t> put = file_->Put(request);
  for (; put.ok() && taken < 100; ++taken) put = file_->Put(request);
  EXPECT_TRUE(absl::IsResourceExhausted(put.status())) << put.status();
  ExpectCounts(taken, 0, 0);
  std::vector<QueuedRequest> requests = First(office);
  EXPECT_EQ(file_->MarkSentInSequence(absl::MakeSpan(requests), 7, SentAt(kNoon)),
            absl::OkStatus());
  ASSERT_EQ(file_->Settle({First(office, 1)[0].id}, {}), absl::OkStatus());
  EXPECT_TRUE(file_->Put(request).ok());
}

TEST_F(OutboxFileTest, OneAtATimeHasTheFile) {
  const absl::Status second = OutboxFile::Open(path_, kMaxBytes).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(second)) << second;
}

TEST_F(OutboxFileTest, OtherFilesAreRefused) {
  folder_.Write("text", std::string(5000, 'x'));
  EXPECT_TRUE(absl::IsFailedPrecondition(OutboxFile::Open(folder_ / "text", kMaxBytes).status()));
  const std::string other = folder_ / "other.db";
  {
    auto database = Database::Open(other, Database::OpenMode::kCreate, absl::Seconds(1));
    ASSERT_EQ((*database)->Execute("CREATE TABLE t (a)"), absl::OkStatus());
  }
  const absl::Status status = OutboxFile::Open(other, kMaxBytes).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("not an outbox"));
}

// A file as version 1 made it, with a request that was sent at kNoon.
constexpr char kVersion1[] = R"sql(
CREATE TABLE streams (
  id INTEGER PRIMARY KEY,
  map TEXT NOT NULL,
  layer TEXT NOT NULL,
  robot TEXT NOT NULL,
  next_sequence INTEGER NOT NULL DEFAULT 0,
  UNIQUE (map, layer, robot)
);
CREATE TABLE letters (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  stream INTEGER NOT NULL REFERENCES streams (id),
  request_id TEXT NOT NULL,
  sequence INTEGER,
  options TEXT NOT NULL,
  body BLOB NOT NULL,
  put_at_ns INTEGER NOT NULL,
  first_sent_at_ns INTEGER,
  code INTEGER,
  message TEXT
);
CREATE INDEX letters_to_send ON letters (stream, id) WHERE code IS NULL;
CREATE TABLE counts (
  id INTEGER PRIMARY KEY CHECK (id = 1),
  delivered INTEGER NOT NULL
);
INSERT INTO counts VALUES (1, 5);
INSERT INTO streams (id, map, layer, robot) VALUES (3, 'office', '', '');
INSERT INTO letters (id, stream, request_id, options, body, put_at_ns, first_sent_at_ns)
VALUES (7, 3, 'r', '', CAST('a' AS BLOB), 1700000000000000000, 1700000000000000000);
PRAGMA application_id = 1215123298;
PRAGMA user_version = 1;
)sql";

TEST_F(OutboxFileTest, AFileOfVersion1IsContinued) {
  file_.reset();
  std::filesystem::remove(path_);
  {
    auto database = Database::Open(path_, Database::OpenMode::kCreate, absl::Seconds(1));
    ASSERT_EQ((*database)->Execute(kVersion1), absl::OkStatus());
  }
  Open();
  ExpectCounts(1, 5, 0);
  const int64_t office = StreamOf("office");
  EXPECT_EQ(Put(office, "b"), 8);
  std::vector<QueuedRequest> requests = First(office);
  ASSERT_EQ(requests.size(), 2u);
  EXPECT_EQ(requests[0].first_sent, (SendTime{.wall = kNoon}));
  ASSERT_EQ(file_->MarkSent(absl::MakeSpan(requests), SentAt(kNoon)), absl::OkStatus());
  Open();
  EXPECT_EQ(First(office)[0].first_sent, (SendTime{.wall = kNoon}));
  EXPECT_EQ(First(office)[1].first_sent, SentAt(kNoon));
}

// A process that was killed leaves its log, whose end SQLite ignores after a damaged record.
TEST_F(OutboxFileTest, DamagedEndOfTheLogIsToldUntilItIsAccepted) {
  const int64_t office = StreamOf("office");
  Put(office, "first");
  Put(office, "last");
  const std::string killed = folder_ / "killed.db";
  for (const char* suffix : {"", "-wal", ".lock"}) {
    std::filesystem::copy_file(path_ + suffix, killed + suffix);
  }
  file_.reset();
  {
    std::fstream log(killed + "-wal", std::ios::in | std::ios::out | std::ios::binary);
    log.seekp(-100, std::ios::end);
    log.put('!');
  }
  for (int i = 0; i < 2; ++i) {
    const absl::Status status = OutboxFile::Open(killed, kMaxBytes).status();
    EXPECT_TRUE(absl::IsDataLoss(status)) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr("the newest 1 of 3 changes are missing"));
  }
  auto accepted = OutboxFile::Open(killed, kMaxBytes, /*accept_loss=*/true);
  ASSERT_TRUE(accepted.ok()) << accepted.status();
  EXPECT_EQ((*accepted)->Counts()->queued, 1);
  accepted->reset();
  EXPECT_TRUE(OutboxFile::Open(killed, kMaxBytes).ok());
}

TEST_F(OutboxFileTest, FileOfWhichEverythingWasInADamagedLogIsTold) {
  Put(StreamOf("office"), "only");
  const std::string killed = folder_ / "killed.db";
  for (const char* suffix : {"", "-wal", ".lock"}) {
    std::filesystem::copy_file(path_ + suffix, killed + suffix);
  }
  {
    std::fstream log(killed + "-wal", std::ios::in | std::ios::out | std::ios::binary);
    log.seekp(200);
    log.put('!');
  }
  for (int i = 0; i < 2; ++i) {
    const absl::Status status = OutboxFile::Open(killed, kMaxBytes).status();
    EXPECT_TRUE(absl::IsDataLoss(status)) << status;
  }
  EXPECT_TRUE(OutboxFile::Open(killed, kMaxBytes, /*accept_loss=*/true).ok());
  EXPECT_TRUE(OutboxFile::Open(killed, kMaxBytes).ok());
}

TEST_F(OutboxFileTest, OlderCopyIsTold) {
  const int64_t office = StreamOf("office");
  Put(office, "first");
  file_.reset();
  std::filesystem::copy_file(path_, folder_ / "copy");
  Open();
  Put(office, "second");
  file_.reset();
  std::filesystem::rename(folder_ / "copy", path_);
  EXPECT_TRUE(absl::IsDataLoss(OutboxFile::Open(path_, kMaxBytes).status()));
  // Another outbox in its place has lost nothing.
  std::filesystem::remove(path_);
  EXPECT_TRUE(OutboxFile::Open(path_, kMaxBytes).ok());
}

TEST_F(OutboxFileTest, FileFromTheFutureIsRefused) {
  file_.reset();
  {
    auto database = Database::Open(path_, Database::OpenMode::kExisting, absl::Seconds(1));
    ASSERT_EQ((*database)->Execute("PRAGMA user_version = 4"), absl::OkStatus());
  }
  const absl::Status status = OutboxFile::Open(path_, kMaxBytes).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("version 4"));
}

}  // namespace
}  // namespace hypermap::storage
