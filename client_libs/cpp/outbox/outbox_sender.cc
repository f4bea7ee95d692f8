#include "client_libs/cpp/outbox/outbox_sender.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client_libs/cpp/backoff.h"
#include "wire/edit.h"
#include "wire/observation.h"

namespace hypermap::client {
namespace {

// Maximum number of observations sent over one stream. It is enough to keep the server busy, and
// limits how many are sent again after a break.
constexpr int kMostAtOnce = 16;
// Maximum time of one wait for an unreachable server.
constexpr absl::Duration kProbe = absl::Seconds(2);
// Time after which RESOURCE_EXHAUSTED counts as final. A full queue or disk is likely to recover by
// then; a batch that is too large stays too large.
constexpr absl::Duration kPatience = absl::Minutes(1);

absl::Status RefusalOf(const Acknowledgement& acknowledgement) {
  const std::string message = absl::StrCat(
      std::string(ObservationOutcomeName(acknowledgement.outcome)), ": ", acknowledgement.message);
  switch (acknowledgement.outcome) {
    case ObservationOutcome::kAccepted:
    case ObservationOutcome::kDuplicate:
      break;
    case ObservationOutcome::kRefusedLate:
      return absl::OutOfRangeError(message);
    case ObservationOutcome::kInvalid:
      return absl::InvalidArgumentError(message);
    case ObservationOutcome::kConflict:
      return absl::AlreadyExistsError(message);
  }
  return absl::OkStatus();
}

int64_t FirstUnused(const OpenedLayer& opened) {
  int64_t unused = 0;
  for (const SequenceRange& range : opened.known) unused = std::max(unused, range.last + 1);
  return unused;
}

// Keeps the leading entries that can be sent over one stream.
void KeepAlike(std::vector<storage::Letter>& letters) {
  const std::string& options = letters.front().options;
  letters.erase(std::find_if(letters.begin(), letters.end(),
                             [&](const auto& letter) { return letter.options != options; }),
                letters.end());
}

}  // namespace

OutboxSender::OutboxSender(const Client& client, OutboxDesk& desk, storage::OutboxStream stream,
                           const OutboxOptions& options)
    : client_(client), desk_(desk), stream_(std::move(stream)), options_(options), thread_([this] {
        Run();
      }) {}

OutboxSender::~OutboxSender() { thread_.join(); }

void OutboxSender::Run() {
  Backoff backoff;
  while (true) {
    absl::StatusOr<Letters> letters = desk_.AwaitFirst(stream_.id, one_by_one_ ? 1 : kMostAtOnce);
    if (letters.ok() && letters->empty()) return;
    const absl::Status status = letters.ok() ? Deliver(*std::move(letters)) : letters.status();
    desk_.NoteProblem(stream_.id, status);
    reached_ = status.ok();
    if (status.ok()) {
      backoff.Reset();
    } else if (!desk_.Sleep(backoff.Next())) {
      return;
    }
  }
}

absl::Status OutboxSender::Deliver(Letters letters) {
  if (stream_.layer.empty()) return DeliverEdits(std::move(letters.front()));
  KeepAlike(letters);
  return DeliverObservations(std::move(letters));
}

absl::Status OutboxSender::DeliverEdits(storage::Letter letter) {
  // Before an entry is marked as sent, because that starts its receipt_age.
  if (absl::Status status = ReachServer(); !status.ok()) return status;
  const absl::Time now = absl::Now();
  if (letter.first_sent_at && now - *letter.first_sent_at > options_.receipt_age) {
    return Settle({}, {{{letter.id, absl::AbortedError(absl::StrCat(
                                        "sent at ", absl::FormatTime(*letter.first_sent_at),
                                        ", and its answer was lost: whether it was carried out is "
                                        "not known any more"))}}});
  }
  const absl::StatusOr<EditBatch> batch = wire::EditsFromBytes(letter.body);
  if (!batch.ok()) return Settle({}, {{{letter.id, batch.status()}}});
  absl::Status status = desk_.With(
      [&](storage::OutboxFile& file) { return file.MarkSent(absl::MakeSpan(&letter, 1), now); });
  if (!status.ok()) return status;
  const absl::StatusOr<EditAnswer> answer = client_.ApplyEdits(stream_.map, *batch,
                                                               {.timeout = options_.timeout,
                                                                .retry_for = absl::ZeroDuration(),
                                                                .request_id = letter.request_id});
  if (answer.ok()) {
    if (options_.delivered) options_.delivered({letter.id, stream_.map, *answer});
    return Settle({letter.id}, {});
  }
  if (IsRefusal(answer.status())) return Settle({}, {{{letter.id, answer.status()}}});
  return answer.status();
}

absl::Status OutboxSender::ReachServer() {
  if (reached_) return absl::OkStatus();
  const absl::Status status =
      client_.GetMap(stream_.map, {.timeout = options_.timeout, .retry_for = kProbe}).status();
  // If the map does not exist, the edits themselves get that answer.
  return absl::IsNotFound(status) ? absl::OkStatus() : status;
}

absl::StatusOr<std::unique_ptr<ObserveStream>> OutboxSender::OpenStream(Letters& letters) {
  ObserveOptions observe;
  observe.exploration_layer = letters.front().options;
  observe.robot = stream_.robot;
  absl::StatusOr<std::unique_ptr<ObserveStream>> stream =
      client_.Observe(stream_.map, stream_.layer, observe, {.timeout = options_.timeout});
  if (!stream.ok()) return stream;
  absl::Status status = desk_.With([&](storage::OutboxFile& file) {
    return file.MarkSentInSequence(absl::MakeSpan(letters), FirstUnused((*stream)->opened()),
                                   absl::Now());
  });
  if (!status.ok()) return status;
  return stream;
}

OutboxSender::Outcome OutboxSender::Exchange(ObserveStream& stream, const Letters& letters) {
  Outcome outcome;
  std::map<int64_t, int64_t> ids;  // of entries, by sequence
  for (const storage::Letter& letter : letters) {
    absl::StatusOr<Observation> observation = wire::ObservationFromBytes(letter.body);
    if (!observation.ok()) {
      outcome.refused.push_back({letter.id, observation.status()});
      continue;
    }
    observation->sequence = *letter.sequence;
    ids.emplace(*letter.sequence, letter.id);
    if (!stream.Write(*observation)) break;
  }
  stream.WritesDone();
  while (std::optional<Acknowledgement> acknowledgement = stream.Read()) {
    const auto found = ids.find(acknowledgement->sequence);
    if (found == ids.end()) continue;
    if (absl::Status why = RefusalOf(*acknowledgement); !why.ok()) {
      outcome.refused.push_back({found->second, std::move(why)});
      continue;
    }
    outcome.delivered.push_back(found->second);
    if (!options_.delivered) continue;
    options_.delivered({found->second, stream_.map, *std::move(acknowledgement)});
  }
  outcome.end = stream.status();
  return outcome;
}

absl::Status OutboxSender::DeliverObservations(Letters letters) {
  if (absl::Status status = ReachServer(); !status.ok()) return status;
  Outcome outcome;
  const absl::StatusOr<std::unique_ptr<ObserveStream>> stream = OpenStream(letters);
  if (stream.ok()) {
    outcome = Exchange(**stream, letters);
  } else {
    outcome.end = stream.status();
  }
  const bool all = outcome.delivered.size() + outcome.refused.size() == letters.size();
  // Only if the stream carried a single entry can its error be attributed to that entry.
  if (!all && letters.size() == 1 && IsRefusal(outcome.end)) {
    return Settle({}, {{{letters.front().id, outcome.end}}});
  }
  one_by_one_ = !all;
  absl::Status settled = Settle(outcome.delivered, outcome.refused);
  if (all || !settled.ok()) return settled;
  if (!outcome.end.ok()) return outcome.end;
  return absl::UnavailableError("the stream ended before all was answered");
}

bool OutboxSender::IsRefusal(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kNotFound:
    case absl::StatusCode::kAlreadyExists:
    case absl::StatusCode::kFailedPrecondition:
    case absl::StatusCode::kAborted:
    case absl::StatusCode::kOutOfRange:
    case absl::StatusCode::kUnimplemented:
      return true;
    case absl::StatusCode::kResourceExhausted: {
      const absl::Time now = absl::Now();
      exhausted_since_ = std::min(exhausted_since_, now);
      return now - exhausted_since_ > kPatience;
    }
    default:
      return false;
  }
}

absl::Status OutboxSender::Settle(absl::Span<const int64_t> delivered,
                                  absl::Span<const storage::Refusal> refused) {
  if (delivered.empty() && refused.empty()) return absl::OkStatus();
  exhausted_since_ = absl::InfiniteFuture();
  return desk_.With([&](storage::OutboxFile& file) { return file.Settle(delivered, refused); });
}

}  // namespace hypermap::client
