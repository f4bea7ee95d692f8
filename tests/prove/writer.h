// Random edits of the map.
#ifndef HYPERMAP_TESTS_PROVE_WRITER_H_
#define HYPERMAP_TESTS_PROVE_WRITER_H_

#include <atomic>
#include <cstdint>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "client_libs/cpp/client.h"
#include "tests/prove/model.h"

namespace hypermap::prove {

using Rng = std::mt19937_64;

// Width and height of the site, in metres and in cells.
inline constexpr double kSiteSize = 60.0;
inline constexpr int kSiteCells = 600;

const std::vector<std::string>& Labels();
double Uniform(Rng& rng, double low, double high);
// Returns a part of the site with sides between `low` and `high`.
Box RandomArea(Rng& rng, double low, double high);

// Creates the map and its layers, and adds their initial content to the model.
absl::Status MakeSite(client::Client& client, Model& model);

struct WriterLoad {
  int edits = 25'000;
  int max_batch = 8;
  // True if cells are written, too.
  bool cells = true;
  // Maximum number of objects of one writer.
  size_t max_things = 200;
};

// Puts, moves and deletes its own objects, and writes cells that all writers share, in batches of
// random size. Used by one thread.
class Writer {
 public:
  Writer(const client::Client& client, uint64_t seed, const WriterLoad& load, Model& model)
      : client_(client), rng_(seed), load_(load), model_(model) {}

  // Runs until the load is written, `stop` is set, or a call fails.
  absl::Status Run(const std::atomic<bool>& stop);
  int64_t batches() const { return batches_; }

 private:
  struct Batch {
    EditBatch edits;
    Written written;            // ids of new objects are not yet known
    std::set<ObjectId> used;    // objects that have an edit
    std::set<CellIndex> cells;  // cells that have an edit
  };

  Batch RandomBatch();
  void AddEdit(Batch& batch);
  void AddPut(ObjectId id, Batch& batch);
  void AddCells(Batch& batch);
  absl::Status Send(Batch batch);

  client::Client client_;
  Rng rng_;
  const WriterLoad load_;
  Model& model_;
  std::vector<ObjectId> mine_;
  int edits_ = 0;
  int64_t batches_ = 0;
};

}  // namespace hypermap::prove

#endif  // HYPERMAP_TESTS_PROVE_WRITER_H_
