// The action that a command line has selected.
#ifndef HYPERMAP_INGEST_WORKER_COMMAND_H_
#define HYPERMAP_INGEST_WORKER_COMMAND_H_

#include <functional>

#include "absl/status/status.h"
#include "ingest/worker/interruption.h"

namespace hypermap::ingest {

// Runs until the action is complete or interrupted. Its error is the program's.
using Command = std::function<absl::Status(const Interruption&)>;

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_COMMAND_H_
