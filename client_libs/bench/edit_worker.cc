#include "client_libs/bench/edit_worker.h"

#include <utility>
#include <variant>

namespace hypermap::bench {
namespace {

constexpr uint64_t kEditRole = 4;
constexpr size_t kOwnObjects = 32;
constexpr int kEditsOfBatch = 2;

}  // namespace

EditWorker::EditWorker(const Load& load, client::Client client, int editor)
    : PacedWorker(OperationKind::kEdit, load, load.options.edits_hz, kEditRole, editor),
      client_(std::move(client)) {}

EditBatch EditWorker::NextBatch() {
  EditBatch batch;
  const size_t first = random()();
  for (int i = 0; i < kEditsOfBatch; ++i) {
    PutObject put;
    put.layer = kShapesLayer;
    put.object = load().site.EditedObject(num_edits_++, random());
    if (ledger_.size() >= kOwnObjects) put.object.id = ledger_.IdAt((first + i) % ledger_.size());
    batch.edits.emplace_back(std::move(put));
  }
  return batch;
}

std::optional<SteadyTime> EditWorker::Do(const RunTimes& times) {
  const EditBatch batch = NextBatch();
  client::CallOptions options;
  options.timeout = options.retry_for = times.give_up - SteadyTime::Now();
  const absl::StatusOr<client::EditAnswer> answer =
      client_.ApplyEdits(load().options.map, batch, options);
  if (answer.ok()) {
    ledger_.NoteAcknowledged(answer->object_ids, answer->revision);
    return SteadyTime::Now();
  }
  NoteFailure(answer.status());
  for (const Edit& edit : batch.edits) {
    ledger_.NoteUncertain(std::get<PutObject>(edit).object.id);
  }
  return std::nullopt;
}

}  // namespace hypermap::bench
