// An editor, which moves its own objects about.
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_EDIT_WORKER_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_EDIT_WORKER_H_

#include <cstdint>
#include <optional>

#include "client_libs/bench/edit_ledger.h"
#include "client_libs/bench/robot_workers.h"
#include "client_libs/cpp/client.h"
#include "map/edits/edit.h"

namespace hypermap::bench {

// Applies batches of two edits to kShapesLayer: it puts a few objects, and then replaces them at
// random. The client retries a batch with the same request id while the server is away.
class EditWorker final : public PacedWorker {
 public:
  EditWorker(const Load& load, client::Client client, int editor);

  absl::Status Open() override { return absl::OkStatus(); }

  const EditLedger& ledger() const { return ledger_; }

 private:
  std::optional<SteadyTime> Do(const RunTimes& times) override;
  EditBatch NextBatch();

  client::Client client_;
  EditLedger ledger_;
  int64_t num_edits_ = 0;
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_EDIT_WORKER_H_
