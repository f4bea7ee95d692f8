#include "client_libs/bench/edit_worker.h"

#include <utility>
#include <variant>

#include "base/status/status_macros.h"

namespace hypermap::bench {
namespace {

constexpr size_t kOwnObjects = 32;
constexpr int kEditsOfBatch = 2;

}  // namespace

EditWorker::EditWorker(const Load& load, client::Client client, int editor)
    : PacedWorker(OperationKind::kEdit, load, std::move(client), load.options.edits_hz,
                  RandomRole::kEdit, editor) {}

void EditWorker::Prepare() {
  batch_.edits.clear();
  request_id_ = client::NewRequestId();
  const size_t first = random()();
  for (int i = 0; i < kEditsOfBatch; ++i) {
    PutObject put;
    put.layer = kShapesLayer;
    put.object = load().site.EditedObject(num_edits_++, random());
    if (ledger_.size() >= kOwnObjects) put.object.id = ledger_.IdAt((first + i) % ledger_.size());
    batch_.edits.emplace_back(std::move(put));
  }
}

absl::StatusOr<SteadyTime> EditWorker::Attempt(const RunTimes& times) {
  HYPERMAP_ASSIGN_OR_RETURN(const client::EditAnswer answer,
                            client().ApplyEdits(load().options.map, batch_,
                                                {.timeout = times.give_up - SteadyTime::Now(),
                                                 .retry_for = absl::ZeroDuration(),
                                                 .request_id = request_id_}));
  const SteadyTime answered = SteadyTime::Now();
  ledger_.NoteAcknowledged(answer.object_ids, answer.revision);
  return answered;
}

void EditWorker::GiveUp() {
  for (const Edit& edit : batch_.edits) {
    ledger_.NoteUncertain(std::get<PutObject>(edit).object.id);
  }
}

}  // namespace hypermap::bench
