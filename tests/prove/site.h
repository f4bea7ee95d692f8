// A server on a scratch folder, with its writers and followers.
#ifndef HYPERMAP_TESTS_PROVE_SITE_H_
#define HYPERMAP_TESTS_PROVE_SITE_H_

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/time/time.h"
#include "client_libs/cpp/client.h"
#include "tests/prove/follower.h"
#include "tests/prove/model.h"
#include "tests/prove/writer.h"
#include "tests/support/server_process.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::prove {

// How long a proof waits for an event before it takes it for lost.
inline constexpr absl::Duration kPatience = absl::Minutes(5);

// The folder is removed at destruction.
class Site {
 public:
  // `flags` are passed to the server besides those for its address and folder.
  Site(const std::string& server_binary, const std::vector<std::string>& flags);
  ~Site();

  // Starts the server and creates the map.
  absl::Status Start();
  // The same server program with another folder, not started.
  std::unique_ptr<Site> Elsewhere() const;

  testing::ServerProcess& server() { return *server_; }
  client::Client NewClient() const;
  const std::string& server_address() const { return server_->address(); }
  Model& model() { return *model_; }
  // Takes another model for what is written from now on. Returns the one before.
  std::unique_ptr<Model> Exchange(std::unique_ptr<Model> model);
  std::string map_file() const;
  const std::string& folder() const { return folder_.path(); }

 private:
  const std::string server_binary_;
  const std::vector<std::string> flags_;
  testing::TemporaryFolder folder_;
  std::unique_ptr<testing::ServerProcess> server_;
  std::unique_ptr<Model> model_ = std::make_unique<Model>();
};

// Writers, each with its own thread and connection.
class WriterGroup {
 public:
  WriterGroup(Site& site, int writers, const WriterLoad& load, uint64_t seed);
  ~WriterGroup() { (void)Stop(); }

  // Waits until the load is written.
  absl::Status Wait();
  // Waits until each writer has finished its current batch.
  absl::Status Stop();
  bool failed() const { return failed_; }
  // Returns whether the load is written, or a writer has failed.
  bool done() const { return running_ == 0; }

 private:
  std::atomic<bool> stop_ = false;
  std::atomic<bool> failed_ = false;
  std::atomic<int> running_ = 0;
  std::vector<std::unique_ptr<Writer>> writers_;
  std::vector<absl::Status> statuses_;
  std::vector<std::thread> threads_;
};

// Followers, each with its own thread and connection.
class WatcherGroup {
 public:
  WatcherGroup(Site& site, int watchers, uint64_t seed);
  ~WatcherGroup();

  // Waits until all followers have received the first snapshot.
  absl::Status WaitUntilBegun();
  // Breaks the watches of the first half of the followers.
  void CutHalf();
  // Waits until all followers receive events of this incarnation of the map.
  absl::Status WaitUntilFollowing(uint64_t incarnation);
  // Waits until all followers have received revision `last`.
  absl::Status WaitUntil(Revision last);

  const std::vector<std::unique_ptr<Follower>>& followers() const { return followers_; }

 private:
  absl::Status WaitUntilAll(absl::FunctionRef<bool(const Follower&)> condition) const;

  std::atomic<Revision> last_ = -1;
  std::vector<std::unique_ptr<Follower>> followers_;
  std::vector<absl::Status> statuses_;
  std::vector<std::thread> threads_;
};

}  // namespace hypermap::prove

#endif  // HYPERMAP_TESTS_PROVE_SITE_H_
