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
      : questions("hm-questions", num_threads),
        long_questions("hm-long-q", num_threads, kLongNiceness),
        watches("hm-watches", num_threads),
        writes("hm-writes", num_threads),
        long_writes("hm-long-writes", num_threads, kLongNiceness),
        openings("hm-openings", 2),
        files("hm-files", 2, kLongNiceness),
        uploads("hm-uploads", 2, kLongNiceness),
        explorations("hm-explorations", 4, kLongNiceness),
        estimates("hm-estimates", 2, kLongNiceness) {}

  // Questions until they prove long, and small requests.
  WorkerPool questions;
  // The rest of answers that take more than one turn, and questions that are long from the
  // beginning: about large areas, about the past, and large batches of points.
  WorkerPool long_questions;
  WorkerPool watches;
  // Decoding of edits and observations. The maps' own threads write them.
  WorkerPool writes;
  // Decoding of large batches of edits and observations, and of large requests to create a layer.
  WorkerPool long_writes;
  // Creating and deleting maps, and opening streams of observations, which wait for the disk.
  WorkerPool openings;
  // Import, export and backup.
  WorkerPool files;
  // The pieces of imports as they arrive, each of which takes milliseconds. In `files` they would
  // wait for imports that are being decoded, for minutes; in `long_writes`, edits would wait for a
  // disk that is slow to take them.
  WorkerPool uploads;
  // Explorations, whose calls wait for commits and for each other.
  WorkerPool explorations;
  // Estimates of transforms, each of which takes seconds in one piece.
  WorkerPool estimates;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_WORKER_POOLS_H_
