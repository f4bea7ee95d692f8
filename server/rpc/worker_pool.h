// Threads that carry out requests, so that gRPC's own threads are not held up.
#ifndef HYPERMAP_SERVER_RPC_WORKER_POOL_H_
#define HYPERMAP_SERVER_RPC_WORKER_POOL_H_

#include <deque>
#include <list>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "absl/functional/any_invocable.h"
#include "absl/strings/string_view.h"
#include "base/sync/mutex.h"
#include "base/sync/thread_name.h"

namespace hypermap::server {

// Runs as many tasks at a time as there are threads. Clients take turns, however many connections
// each of them has, and within a client its connections take turns: the next task is of the client
// that has waited longest for its turn, and there of the connection that has. The tasks that a
// client sends by one connection run in the order in which they come. A connection whose next task
// is about a busy subject is passed over, and a client that has no others, too; both keep their
// place.
//
// A task costs O(1), and O(n) if n connections are passed over. The queue is not bounded: it has
// about one task for each request in flight. Thread safe.
class WorkerPool {
 public:
  using Task = absl::AnyInvocable<void() &&>;

  // The origin of a task. One connection may carry the calls of several clients.
  struct Origin {
    absl::string_view client;      // CallTicket::client
    absl::string_view connection;  // the peer, as gRPC writes it
  };

  // The threads have this name, and run at this niceness (nice(7)): a greater one leaves more of
  // the processors to the threads of other pools.
  WorkerPool(ThreadName name, int num_threads, int niceness = 0);
  // Runs the queued tasks, then joins the threads.
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  // Tasks about the same `subject` run one at a time, so that none holds a thread while it waits
  // for another; "" is no subject. The origin may be a part of what the task holds.
  void Run(Origin origin, absl::string_view subject, Task task);
  void Run(Origin origin, Task task) { Run(origin, "", std::move(task)); }
  // Runs a task of the server itself.
  void Run(Task task) { Run(Origin(), std::move(task)); }

  int num_threads() const { return static_cast<int>(threads_.size()); }

 private:
  struct Queued {
    std::string subject;
    Task task;
  };

  // A connection that has queued tasks.
  struct Connection {
    std::string name;
    std::deque<Queued> tasks;
  };
  // A client that has such connections.
  struct Client {
    std::string name;
    std::list<Connection> connections;  // in the order of their turns
  };
  using ConnectionKey = std::pair<absl::string_view, absl::string_view>;
  struct Turn {
    std::list<Client>::iterator client;
    std::list<Connection>::iterator connection;
  };

  void Work();
  // Waits for a task; one without a task means that the pool ends. The subject is busy until Ended.
  Queued Take();
  void Ended(const std::string& subject);
  // Returns the entry of a connection. A new one has no task yet and must get one under this lock.
  std::list<Connection>::iterator FindOrAddConnection(const Origin& origin)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Returns the first turn whose task can run.
  std::optional<Turn> FindTurn() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Removes the task of this turn, and its connection and client if they have no others; otherwise
  // these go to the end of their lists.
  Queued TakeTurn(const Turn& turn) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  Mutex mutex_;
  CondVar changed_;
  std::list<Client> clients_ ABSL_GUARDED_BY(mutex_);  // in the order of their turns
  // Find the entries of these lists. The keys are the names that stand in the entries; a connection
  // has those of its client and itself.
  absl::flat_hash_map<absl::string_view, std::list<Client>::iterator> client_by_name_
      ABSL_GUARDED_BY(mutex_);
  absl::flat_hash_map<ConnectionKey, std::list<Connection>::iterator> connection_by_names_
      ABSL_GUARDED_BY(mutex_);
  absl::flat_hash_set<std::string> busy_subjects_ ABSL_GUARDED_BY(mutex_);
  bool ending_ ABSL_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> threads_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_WORKER_POOL_H_
