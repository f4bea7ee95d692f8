#include "server/services/points_call.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "base/status/unless_memory_fails.h"
#include "base/sync/cancel_scope.h"
#include "server/rpc/asked_revision.h"
#include "server/rpc/raw_messages.h"
#include "server/rpc/short_turn.h"
#include "wire/answer.h"
#include "wire/scope.h"

namespace hypermap::server {
namespace {

// Larger batches are not begun on gRPC's thread.
constexpr int kMaxInlinePoints = 4096;
// The bytes of such a batch, with room for an opening. Larger messages are not even counted there.
constexpr size_t kMaxInlineBytes = 80 << 10;
// A message that costs more (CallTicket::CostOfRequest) is parsed on a worker. Points cost five
// times their bytes, of which this leaves room for more than kMaxInlinePoints. Empty names cost
// fifty times theirs: some 5,000, which are parsed in half a millisecond.
constexpr int64_t kMaxInlineCost = 512 << 10;
// The scope is in memory twice: in the call and in its PointsAsker.
constexpr int64_t kCopiesOfScope = 2;
// Fewest bytes of an object in an answer: three varints (point, id, label) and its existence.
constexpr int kLeastHitBytes = 3 + sizeof(float);
// Estimated memory of an entry in the table of labels that were sent, besides its text.
constexpr int64_t kBytesOfLabel = 64;
// Messages of batches that took more than this are freed after the answer; smaller ones are reused.
constexpr int64_t kMaxKeptBytes = 1 << 20;

}  // namespace

PointsCall::PointsCall(grpc::CallbackServerContext* context, const Facilities* facilities,
                       OpenStreams* open)
    : facilities_(facilities),
      open_(open),
      context_(facilities->for_calls(), context, Rpc::kQueryPoints),
      ticket_(context_.ticket()) {
  StartRead(&read_);
  if (!context_.admitted().ok()) {
    End(context_.admitted());
  } else if (!open->Add(this)) {
    End(ServerStops());
  }
}

void PointsCall::OnReadDone(bool ok) {
  Go(Change([&] {
    mutex_.AssertHeld();
    // No work may start on a batch that arrives after Finish, because OnDone does not wait for it.
    if (ok && !finished_) {
      has_next_ = true;
    } else {
      no_more_reads_ = true;
    }
  }));
}

void PointsCall::OnWriteDone(bool ok) {
  if (ok) return Go(EndBatch(absl::OkStatus()));
  absl::Status status = context_.CheckWanted();
  if (status.ok()) {
    status = absl::ResourceExhaustedError(absl::StrCat(
        "the answer to ", points_.size(), " points is larger than --max_message_bytes"));
  }
  Go(EndBatch(status));
}

void PointsCall::OnCancel() {
  const CancelScope in_cancel(this);
  const absl::Status status = context_.CheckWanted();
  wait_.Stop();
  End(status.ok() ? absl::CancelledError("the caller went away") : status);
}

void PointsCall::OnDone() {
  open_->Remove(this);
  ticket_.LookForCancellation();
  delete this;
}

void PointsCall::End(const absl::Status& status) {
  Go(Change([&] {
    mutex_.AssertHeld();
    if (status_.ok()) status_ = status;
  }));
}

PointsCall::Step PointsCall::Change(absl::FunctionRef<void()> change) {
  MutexLock lock(&mutex_);
  change();
  return NextStep();
}

PointsCall::Step PointsCall::NextStep() {
  if (busy_ || finished_) return Step::kNothing;
  if (status_.ok() && has_next_) {
    has_next_ = false;
    busy_ = true;
    return Step::kTakeBatch;
  }
  if (status_.ok() && !no_more_reads_) return Step::kNothing;
  if (status_.ok() && !opened_) status_ = absl::InvalidArgumentError("the stream was not opened");
  finished_ = true;
  return Step::kFinish;
}

void PointsCall::Go(Step step) {
  while (step == Step::kTakeBatch) {
    const std::optional<absl::Status> end = TakeBatch();
    if (!end) return;
    step = EndBatch(*end);
  }
  if (step != Step::kFinish) return;
  absl::Status status;
  {
    MutexLock lock(&mutex_);
    status = status_;
  }
  // gRPC may call OnDone, which deletes this, at any time from here on.
  Finish(context_.End(status, num_answered_));
}

PointsCall::Step PointsCall::EndBatch(const absl::Status& status) {
  // Messages keep their memory for the next batch.
  const bool is_large = batch_cost_ + meter_.taken() > kMaxKeptBytes;
  if (is_large) {
    v1::QueryPointsRequest().Swap(&batch_);
    v1::QueryPointsResponse().Swap(&response_);
    std::vector<Point>().swap(points_);
  }
  written_.Clear();
  ticket_.FreeMemory(std::exchange(batch_cost_, 0));
  // Each batch has its own view of the past.
  if (is_large || as_of_.is_past()) asker_.reset();
  meter_.GiveBack();
  return Change([&] {
    mutex_.AssertHeld();
    busy_ = false;
    if (status_.ok()) status_ = status;
  });
}

std::optional<absl::Status> PointsCall::TakeBatch() {
  grpc::ByteBuffer bytes;
  bytes.Swap(&read_);
  StartRead(&read_);  // Allowed here: the call is not finished while a batch has an owner.
  ticket_.Received(bytes);
  HYPERMAP_RETURN_IF_ERROR(CheckBatchSize(bytes, facilities_->limits));
  const bool is_counted = bytes.Length() <= kMaxInlineBytes;
  const int64_t cost =
      is_counted ? CallTicket::CostOfRequest(batch_, bytes) : static_cast<int64_t>(bytes.Length());
  HYPERMAP_RETURN_IF_ERROR(Charge(cost));
  WorkerPool& long_questions = facilities_->workers->long_questions;
  if (!is_counted || cost > kMaxInlineCost) {
    long_questions.Run(context_.origin(), [this, bytes] { TakeOnWorker(bytes); });
    return std::nullopt;
  }
  HYPERMAP_RETURN_IF_ERROR(UnlessMemoryFails([&] { return Parse(bytes); }));
  if (WaitsForRevision()) return std::nullopt;
  if (!IsLong()) return AnswerAtOnce();
  AnswerOn(&long_questions);
  return std::nullopt;
}

void PointsCall::TakeOnWorker(const grpc::ByteBuffer& bytes) {
  absl::Status status = context_.CheckWanted();
  if (status.ok()) status = Charge(CallTicket::CostOfRequest(batch_, bytes));
  if (status.ok()) status = UnlessMemoryFails([&] { return Parse(bytes); });
  if (!status.ok()) return Go(EndBatch(status));
  if (!WaitsForRevision()) AnswerHere();
}

bool PointsCall::WaitsForRevision() {
  const bool is_linearizable = as_of_.consistency == Consistency::kLinearizable;
  const bool asks_for_revision = as_of_.min_revision > 0 || as_of_.seen_revision > 0;
  if (!is_linearizable && (!batch_.has_opening() || !asks_for_revision)) return false;
  v1::AsOf as_of;
  wire::EncodeAsOf(as_of_, &as_of);
  wait_.Start(*facilities_, map_, as_of, [this](const absl::StatusOr<Revision>& reached) {
    WorkerPools& workers = *facilities_->workers;
    if (!reached.ok()) {
      return workers.questions.Run(context_.origin(), [this, status = reached.status()] {
        const absl::Status wanted = context_.CheckWanted();
        Go(EndBatch(wanted.ok() ? status : wanted));
      });
    }
    as_of_.min_revision = *reached;
    AnswerOn(IsLong() ? &workers.long_questions : &workers.questions);
  });
  return true;
}

bool PointsCall::IsLong() const {
  return as_of_.is_past() || batch_.xs_size() > kMaxInlinePoints ||
         !(tolerance_m_ <= kSmallTolerance_m);
}

std::optional<absl::Status> PointsCall::AnswerAtOnce() {
  ShortTurn cancellation;
  absl::Status status;
  {
    const ScopedCancellation here(&cancellation);
    status = UnlessMemoryFails([&] { return AskPoints(); });
  }
  if (!cancellation.status().ok()) {
    AnswerOn(&facilities_->workers->long_questions);
    return std::nullopt;
  }
  HYPERMAP_RETURN_IF_ERROR(status);
  return WriteAnswer();
}

void PointsCall::AnswerOn(WorkerPool* workers) {
  workers->Run(context_.origin(), [this] { AnswerHere(); });
}

void PointsCall::AnswerHere() {
  Cancellation cancellation([this] { return context_.CheckWanted(); });
  absl::Status status;
  {
    const ScopedCancellation here(&cancellation);
    status = UnlessMemoryFails([&] { return AskPoints(); });
  }
  // Work that was given up has no result.
  if (!cancellation.status().ok()) status = cancellation.status();
  if (!status.ok()) return Go(EndBatch(status));
  if (const std::optional<absl::Status> answered = WriteAnswer()) Go(EndBatch(*answered));
}

std::optional<absl::Status> PointsCall::WriteAnswer() {
  if (points_.empty()) return absl::OkStatus();
  const grpc::Slice slice = Serialize(response_);
  const int64_t cost = CallTicket::CostOfAnswer(static_cast<int64_t>(slice.size()));
  HYPERMAP_RETURN_IF_ERROR(ticket_.ChargeMemory(cost));
  batch_cost_ += cost;
  grpc::ByteBuffer(&slice, 1).Swap(&written_);
  StartWrite(&written_);
  return std::nullopt;
}

absl::Status PointsCall::Charge(int64_t cost) {
  ticket_.FreeMemory(std::exchange(batch_cost_, 0));
  HYPERMAP_RETURN_IF_ERROR(ticket_.ChargeRequest(cost));
  batch_cost_ = cost;
  return absl::OkStatus();
}

absl::Status PointsCall::Parse(const grpc::ByteBuffer& bytes) {
  HYPERMAP_RETURN_IF_ERROR(ParseRequest(bytes, &batch_));
  if (batch_.has_opening()) return Open();
  if (opened_) return absl::OkStatus();
  return absl::InvalidArgumentError("the first message must carry the opening");
}

absl::Status PointsCall::Open() {
  if (opened_) {
    return absl::InvalidArgumentError("opening may come once, in the first message");
  }
  const v1::QueryPointsOpening& opening = batch_.opening();
  HYPERMAP_ASSIGN_OR_RETURN(AsOf as_of, wire::DecodeAsOf(opening.as_of()));
  HYPERMAP_RETURN_IF_ERROR(wire::CheckScope(opening.scope(), facilities_->limits));
  // Kept until the call ends.
  const auto bytes = static_cast<int64_t>(opening.scope().SpaceUsedLong());
  if (bytes > CallTicket::kFreeBytes) {
    HYPERMAP_RETURN_IF_ERROR(ticket_.ChargeMemory(kCopiesOfScope * bytes));
  }
  map_.set_map(opening.scope().map());
  map_.set_incarnation(opening.scope().incarnation());
  HYPERMAP_RETURN_IF_ERROR(context_.EnterMap(map_.map()));
  HYPERMAP_ASSIGN_OR_RETURN(scope_, wire::DecodeScope(opening.scope(), facilities_->limits));
  tolerance_m_ = opening.tolerance_m();
  as_of_ = as_of;
  opened_ = true;
  return absl::OkStatus();
}

absl::Status PointsCall::AskPoints() {
  HYPERMAP_RETURN_IF_ERROR(context_.CheckWanted());
  absl::Status decoded = wire::DecodePoints(batch_, facilities_->limits.max_points, &points_);
  if (!decoded.ok()) return decoded;
  meter_.GiveBack();
  const ScopedMeter metered(&meter_);
  HYPERMAP_RETURN_IF_ERROR(Pin());
  const size_t max_hits = facilities_->limits.max_message_bytes / kLeastHitBytes;
  absl::StatusOr<absl::Span<const LayerPointsContent>> contents =
      asker_->ContentAtEach(points_, max_hits);
  if (!contents.ok()) {
    // Frees the contents that were found until then, which may be large.
    asker_.reset();
    return contents.status();
  }
  response_.Clear();
  response_.set_revision(asker_->snapshot().revision);
  response_.set_incarnation(incarnation_);
  wire::EncodePointsContent(*contents, &labels_, &response_);
  for (const std::string& label : response_.new_labels()) {
    HYPERMAP_RETURN_IF_ERROR(
        labels_meter_.Take(kBytesOfLabel + static_cast<int64_t>(label.size())));
  }
  num_answered_ += static_cast<int64_t>(points_.size());
  return absl::OkStatus();
}

absl::Status PointsCall::Pin() {
  // The map is looked up for each batch, because it may have been deleted or created again.
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session, FindMap(*facilities_, map_));
  HYPERMAP_ASSIGN_OR_RETURN(const AskedRevision asked, AskedRevision::Find(*session, as_of_));
  // A past time is resolved once: all batches of the stream are answered from the same revision.
  if (as_of_.is_past()) {
    as_of_ = {.revision = asked.revision()};
    map_.set_incarnation(asked.incarnation());
  }
  as_of_.min_revision = 0;
  as_of_.seen_revision = 0;
  incarnation_ = asked.incarnation();
  HYPERMAP_ASSIGN_OR_RETURN(SnapshotPtr snapshot, asked.ForPoints(scope_, points_, tolerance_m_));
  if (asker_ && &asker_->snapshot() == snapshot.get()) return absl::OkStatus();
  HYPERMAP_ASSIGN_OR_RETURN(PointsAsker asker,
                            PointsAsker::Make(std::move(snapshot), scope_, tolerance_m_));
  asker_ = std::move(asker);
  return absl::OkStatus();
}

}  // namespace hypermap::server
