// What a command line says is to be done.
#ifndef HYPERMAP_INGEST_WORKER_COMMAND_H_
#define HYPERMAP_INGEST_WORKER_COMMAND_H_

#include <functional>

#include "absl/status/status.h"
#include "ingest/worker/interruption.h"

namespace hypermap::ingest {

using Command = std::function<absl::Status(const Interruption&)>;

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_COMMAND_H_
