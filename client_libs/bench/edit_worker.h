// An editor, which moves its own objects about.
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_EDIT_WORKER_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_EDIT_WORKER_H_

#include <cstdint>
#include <string>

#include "client_libs/bench/edit_ledger.h"
#include "client_libs/bench/paced_worker.h"
#include "client_libs/cpp/client.h"
#include "map/edits/edit.h"

namespace hypermap::bench {

// Applies batches of two edits to kShapesLayer: it puts a few objects, and then replaces them at
// random. A batch that is tried again has the same request id.
class EditWorker final : public PacedWorker {
 public:
  EditWorker(const Load& load, client::Client client, int editor);

  absl::Status Open() override { return absl::OkStatus(); }

  const EditLedger& ledger() const { return ledger_; }

 private:
  void Prepare() override;
  absl::StatusOr<SteadyTime> Attempt(const RunTimes& times) override;
  void GiveUp() override;

  EditBatch batch_;
  std::string request_id_;
  EditLedger ledger_;
  int64_t num_edits_ = 0;
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_EDIT_WORKER_H_
