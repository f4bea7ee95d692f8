// A pool of threads for each class of work, so that no class can take the threads of another.
#ifndef HYPERMAP_SERVER_RPC_WORKER_POOLS_H_
#define HYPERMAP_SERVER_RPC_WORKER_POOLS_H_

#include "server/rpc/worker_pool.h"

namespace hypermap::server {

struct WorkerPools {
  // Classes that may take long leave most of the processors to the others while these need them:
  // of a processor for which two threads compete, a tenth.
  static constexpr int kLongNiceness = 10;

  // `num_threads` for each class that computes. The other classes wait for the disk or for each
  // other, and have a few threads.
  explicit WorkerPools(int num_threads)
      : questions(num_threads),
        long_questions(num_threads, kLongNiceness),
        watches(num_threads),
        writes(num_threads),
        long_writes(num_threads, kLongNiceness),
        openings(2),
        files(2, kLongNiceness),
        explorations(4, kLongNiceness) {}

  // Questions until they prove long, and small requests.
  WorkerPool questions;
  // The rest of answers that take more than one turn, and questions that are long from the
  // beginning: about large areas, about the past, and large batches of points.
  WorkerPool long_questions;
  WorkerPool watches;
  // Decoding of edits and observations. The maps' own threads write them.
  WorkerPool writes;
  // Decoding of large batches of edits and observations.
  WorkerPool long_writes;
  // Creating and deleting maps, and opening streams of observations, which wait for the disk.
  WorkerPool openings;
  // Import, export and backup.
  WorkerPool files;
  // Explorations, whose calls wait for commits and for each other.
  WorkerPool explorations;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_WORKER_POOLS_H_
