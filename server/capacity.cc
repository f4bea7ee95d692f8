#include "server/capacity.h"

#include <algorithm>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/admission/file_limit.h"
#include "base/status/status_macros.h"

namespace hypermap::server {
namespace {

// Files that the server itself needs: its log, pipes and polls, the listening sockets, the list of
// deletions, and the files of a few creations, imports, backups and reserved readers (HistoryPool)
// under way.
constexpr int64_t kFilesOfServer = 64;
// Files that an open map needs: its lock, the database and the write-ahead log of the writer and of
// one reader of the history, the index of the log, and one more while it is opened; later, that one
// may be the file of a reserved reader, which SQLite keeps open.
constexpr int64_t kFilesOfMap = 7;
// Files that a further reader of past revisions needs: the database and its log.
constexpr int64_t kFilesOfReader = 2;
// Connections get at least this many files, which are enough for 16 (LimitConnections).
constexpr int64_t kFewestFilesOfConnections = 24;
// Memory that a new map needs for its thread, its writer's statements, and one reader.
constexpr int64_t kBytesOfMap = int64_t{2} << 20;
// Memory that a reader of a map with few layers needs: up to Database::kMaxIdleStatements
// statements, its page cache, and the schema.
constexpr int64_t kBytesOfReader = int64_t{1} << 20;
constexpr int64_t kMostExtraReaders = 10'000;
// Threads whose number does not depend on the processors: the main program, the listener, timers,
// gRPC's first threads, and the pools of a fixed size.
constexpr int64_t kFixedThreads = 48;
// Threads for each worker: one in each of five pools, and those that gRPC starts when all of its
// own are busy.
constexpr int64_t kThreadsOfWorker = 8;

// Address space of the program itself, its libraries and their data.
constexpr int64_t kAddressesOfProgram = int64_t{192} << 20;
// The least memory with which a server is of use: an eighth of it is for requests.
constexpr int64_t kLeastMemory = int64_t{64} << 20;
// Addresses that glibc reserves for an arena (HEAP_MAX_SIZE).
constexpr int64_t kAddressesOfArena = int64_t{64} << 20;

int64_t ThreadsOfServer(int num_workers) { return kFixedThreads + kThreadsOfWorker * num_workers; }

// Addresses that the program and the stacks of its threads take.
int64_t OwnAddresses(const Resources& resources) {
  return kAddressesOfProgram + ThreadsOfServer(resources.num_workers) * resources.stack_bytes;
}

// The most memory that a server with a limited address space may count on.
int64_t MostMemory(const Resources& resources) {
  return (resources.address_space - OwnAddresses(resources)) / 2;
}

// Returns the number of files of which LimitConnections makes this many connections.
int64_t FilesOfConnections(int64_t connections) { return (connections + 2) / 3 * 4; }

}  // namespace

absl::StatusOr<int64_t> MemoryLimit(int64_t asked, const Resources& resources) {
  const int64_t usable = resources.memory / 4 * 3;
  if (resources.address_space == 0) return asked == 0 ? usable : asked;
  const int64_t most = MostMemory(resources);
  if (most < kLeastMemory) {
    return absl::FailedPreconditionError(
        absl::StrCat("the process may have ", resources.address_space,
                     " bytes of address space (ulimit -v), and needs ",
                     OwnAddresses(resources) + 2 * kLeastMemory));
  }
  if (asked > most) {
    return absl::InvalidArgumentError(
        absl::StrCat("--memory_limit=", asked, " is more than the ", most,
                     " for which the limit of address space (ulimit -v) leaves room"));
  }
  return asked == 0 ? std::min(usable, most) : asked;
}

int MostArenas(const Resources& resources) {
  if (resources.address_space == 0) return 0;
  const int64_t most = MostMemory(resources) / kAddressesOfArena;
  return static_cast<int>(std::clamp<int64_t>(most, 1, kFixedThreads));
}

absl::StatusOr<Capacity> DivideResources(const Limits& limits, const Resources& resources,
                                         int64_t num_maps) {
  const int64_t threads_of_maps = resources.threads - ThreadsOfServer(resources.num_workers);
  if (threads_of_maps < 1) {
    return absl::FailedPreconditionError(absl::StrCat(
        "the process may have ", resources.threads, " threads (ulimit -u, and pids.max of the ",
        "control group, without those of other processes), and needs ",
        ThreadsOfServer(resources.num_workers), ", and one for each map"));
  }
  const int64_t room = std::max<int64_t>(resources.files - kFilesOfServer, 0);
  const int64_t readers = std::min(
      {room / 8 / kFilesOfReader, limits.memory_limit / 32 / kBytesOfReader, kMostExtraReaders});
  const int64_t divided = room - readers * kFilesOfReader;
  const int64_t of_connections = std::max(
      {divided / 7, kFewestFilesOfConnections, FilesOfConnections(limits.max_connections)});
  const int64_t most_of_files = std::max<int64_t>((divided - of_connections) / kFilesOfMap, 1);
  const int64_t most_maps = std::min(most_of_files, threads_of_maps);

  int64_t maps = limits.max_maps;
  if (maps == 0) {
    maps = std::min(room / 8 * 3 / kFilesOfMap, limits.memory_limit / 4 / kBytesOfMap);
    maps = std::clamp<int64_t>(std::max(maps, num_maps), 1, most_maps);
  }
  if (maps > most_maps) {
    return absl::InvalidArgumentError(absl::StrCat(
        "--max_maps=", maps, " is more than the ", most_maps, " for which the limit of ",
        most_maps < most_of_files ? "threads (ulimit -u, pids.max)" : "open files (ulimit -n)",
        " leaves room"));
  }
  HYPERMAP_ASSIGN_OR_RETURN(
      const admission::ConnectionLimits connections,
      admission::LimitConnections({limits.max_connections, limits.max_connections_per_address},
                                  resources.files,
                                  kFilesOfServer + readers * kFilesOfReader + maps * kFilesOfMap));
  return Capacity{static_cast<int>(maps), static_cast<int>(readers), connections};
}

}  // namespace hypermap::server
