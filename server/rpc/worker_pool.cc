#include "server/rpc/worker_pool.h"

#include <utility>

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

void WorkerPool::Run(Origin origin, absl::string_view subject, Task task) {
  MutexLock lock(&mutex_);
  FindOrAddConnection(origin)->tasks.push_back({std::string(subject), std::move(task)});
  changed_.NotifyOne();
}

std::list<WorkerPool::Connection>::iterator WorkerPool::FindOrAddConnection(const Origin& origin) {
  const auto known = connection_by_names_.find(ConnectionKey(origin.client, origin.connection));
  if (known != connection_by_names_.end()) return known->second;
  auto entry = client_by_name_.find(origin.client);
  if (entry == client_by_name_.end()) {
    const auto added = clients_.insert(clients_.end(), {std::string(origin.client), {}});
    entry = client_by_name_.emplace(added->name, added).first;
  }
  Client& client = *entry->second;
  const auto added =
      client.connections.insert(client.connections.end(), {std::string(origin.connection), {}});
  connection_by_names_.emplace(ConnectionKey(client.name, added->name), added);
  return added;
}

std::optional<WorkerPool::Turn> WorkerPool::FindTurn() {
  for (auto client = clients_.begin(); client != clients_.end(); ++client) {
    for (auto connection = client->connections.begin(); connection != client->connections.end();
         ++connection) {
      if (!busy_subjects_.contains(connection->tasks.front().subject)) {
        return Turn{client, connection};
      }
    }
  }
  return std::nullopt;
}

WorkerPool::Queued WorkerPool::TakeTurn(const Turn& turn) {
  const auto [client, connection] = turn;
  Queued next = std::move(connection->tasks.front());
  connection->tasks.pop_front();
  std::list<Connection>& connections = client->connections;
  if (connection->tasks.empty()) {
    connection_by_names_.erase(ConnectionKey(client->name, connection->name));
    connections.erase(connection);
  } else {
    connections.splice(connections.end(), connections, connection);
  }
  if (connections.empty()) {
    client_by_name_.erase(client->name);
    clients_.erase(client);
  } else {
    clients_.splice(clients_.end(), clients_, client);
  }
  return next;
}

WorkerPool::Queued WorkerPool::Take() {
  MutexLock lock(&mutex_);
  std::optional<Turn> turn = FindTurn();
  while (!turn && !(ending_ && clients_.empty())) {
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
