// The number of maps, connections and readers for which the process has files, threads and memory.
#ifndef HYPERMAP_SERVER_CAPACITY_H_
#define HYPERMAP_SERVER_CAPACITY_H_

#include <cstdint>

#include "absl/status/statusor.h"
#include "base/admission/open_connections.h"
#include "base/limits/limits.h"

namespace hypermap::server {

struct Capacity {
  // Maps of the data folder, see Limits::max_maps.
  int max_maps = 0;
  // Readers of past revisions that may be open at once, besides one for each map.
  int max_extra_readers = 0;
  admission::ConnectionLimits connections;
};

// Resources that the system grants to the process.
struct Resources {
  int64_t files = 0;    // that may be open at once
  int64_t threads = 0;  // in all
  int num_workers = 0;  // threads of each class of short work
  int64_t memory = 0;   // bytes
  // Bytes of address space; 0 if they are not limited.
  int64_t address_space = 0;
  int64_t stack_bytes = 0;  // of a thread, in address space
};

// Returns the bytes that --memory_limit stands for, `asked`: if it is 0, three quarters of the
// memory. If the address space is limited, at most half of what the program and the stacks of its
// threads leave of it, because the allocator reserves more than it uses.
//
// FAILED_PRECONDITION, naming ulimit, if that is not enough for a server; INVALID_ARGUMENT if more
// is asked for.
absl::StatusOr<int64_t> MemoryLimit(int64_t asked, const Resources& resources);

// Returns how many arenas the allocator may have if the address space is limited, otherwise 0. Each
// reserves addresses, of which none would be left for the stack of a new thread.
int MostArenas(const Resources& resources);

// Divides the files that the process may have open, so that neither maps nor connections can take
// the share of the others. Limits that are set stay as they are. Of the files besides the server's
// own, an eighth is for readers of past revisions, three eighths are for maps, and the rest is for
// connections. New maps are also bounded by a quarter of `limits.memory_limit`, and readers by a
// thirty-second. The `num_maps` maps that exist may take more, as long as connections keep an
// eighth of the files. A map has a thread; those that the workers and gRPC need are left out.
//
// FAILED_PRECONDITION, naming ulimit, if there are not enough files for a map and 16 connections,
// or not enough threads for a map; INVALID_ARGUMENT if a limit that is set is more than fits.
absl::StatusOr<Capacity> DivideResources(const Limits& limits, const Resources& resources,
                                         int64_t num_maps);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_CAPACITY_H_
