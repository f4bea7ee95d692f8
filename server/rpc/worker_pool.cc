#include "server/rpc/worker_pool.h"

#include <utility>

#include "base/admission/client_host.h"
#include "base/cancellation/give_way.h"
#include "server/rpc/scheduling.h"

namespace hypermap::server {

WorkerPool::WorkerPool(ThreadName name, int num_threads, int niceness) {
  threads_.reserve(num_threads);
  for (int i = 0; i < num_threads; ++i) {
    threads_.emplace_back([this, name, niceness] {
      NameThisThread(name);
      ScheduleLongWork(niceness);
      Work();
    });
  }
}

WorkerPool::~WorkerPool() {
  {
    MutexLock lock(&mutex_);
    ending_ = true;
    changed_.NotifyAll();
  }
  for (std::thread& thread : threads_) thread.join();
}

void WorkerPool::Run(absl::string_view client, absl::string_view subject, Task task) {
  const std::string host = admission::HostOfPeer(client);
  MutexLock lock(&mutex_);
  FindOrAddConnection(client, host)->tasks.push_back({std::string(subject), std::move(task)});
  changed_.NotifyOne();
}

std::list<WorkerPool::Connection>::iterator WorkerPool::FindOrAddConnection(
    absl::string_view client, absl::string_view host) {
  const auto known = connection_by_client_.find(client);
  if (known != connection_by_client_.end()) return known->second;
  auto entry = host_by_name_.find(host);
  if (entry == host_by_name_.end()) {
    const auto added = hosts_.insert(hosts_.end(), {std::string(host), {}});
    entry = host_by_name_.emplace(added->name, added).first;
  }
  std::list<Connection>& connections = entry->second->connections;
  const auto added = connections.insert(connections.end(), {std::string(client), {}});
  connection_by_client_.emplace(added->client, added);
  return added;
}

std::optional<WorkerPool::Turn> WorkerPool::FindTurn() {
  for (auto host = hosts_.begin(); host != hosts_.end(); ++host) {
    for (auto connection = host->connections.begin(); connection != host->connections.end();
         ++connection) {
      if (!busy_subjects_.contains(connection->tasks.front().subject)) {
        return Turn{host, connection};
      }
    }
  }
  return std::nullopt;
}

WorkerPool::Queued WorkerPool::TakeTurn(const Turn& turn) {
  const auto [host, connection] = turn;
  Queued next = std::move(connection->tasks.front());
  connection->tasks.pop_front();
  std::list<Connection>& connections = host->connections;
  if (connection->tasks.empty()) {
    connection_by_client_.erase(connection->client);
    connections.erase(connection);
  } else {
    connections.splice(connections.end(), connections, connection);
  }
  if (connections.empty()) {
    host_by_name_.erase(host->name);
    hosts_.erase(host);
  } else {
    hosts_.splice(hosts_.end(), hosts_, host);
  }
  return next;
}

WorkerPool::Queued WorkerPool::Take() {
  MutexLock lock(&mutex_);
  std::optional<Turn> turn = FindTurn();
  while (!turn && !(ending_ && hosts_.empty())) {
    changed_.Wait(&mutex_);
    turn = FindTurn();
  }
  if (!turn) return {};
  Queued next = TakeTurn(*turn);
  if (!next.subject.empty()) busy_subjects_.insert(next.subject);
  return next;
}

void WorkerPool::Ended(const std::string& subject) {
  if (subject.empty()) return;
  MutexLock lock(&mutex_);
  busy_subjects_.erase(subject);
  // Several tasks may have waited for the subject, and a thread that waits for the pool's end, too.
  changed_.NotifyAll();
}

void WorkerPool::Work() {
  for (;;) {
    Queued next = Take();
    if (!next.task) return;
    std::move(next.task)();
    // Frees the objects that the task holds before the thread waits for the next one.
    next.task = nullptr;
    Ended(next.subject);
    GiveWay();
  }
}

}  // namespace hypermap::server
