// A server on a scratch folder, with what writes to it and follows it.
#ifndef HYPERMAP_TESTS_PROVE_SITE_H_
#define HYPERMAP_TESTS_PROVE_SITE_H_

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "client_libs/cpp/client.h"
#include "tests/prove/follower.h"
#include "tests/prove/model.h"
#include "tests/prove/writer.h"
#include "tests/support/server_process.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::prove {

// The folder is removed in the end.
class Site {
 public:
  // `flags` are the server's, besides those that say where it is.
  Site(const std::string& server_binary, const std::vector<std::string>& flags);
  ~Site();

  // Starts the server and makes the map.
  absl::Status Start();

  testing::ServerProcess& server() { return *server_; }
  client::Client NewClient() const;
  Model& model() { return model_; }
  std::string map_file() const;
  const std::string& folder() const { return folder_.path(); }

 private:
  testing::TemporaryFolder folder_;
  std::unique_ptr<testing::ServerProcess> server_;
  Model model_;
};

// Writers, each with a thread and a connection of its own.
class Crew {
 public:
  Crew(Site& site, int writers, const WriterLoad& load, uint64_t seed);
  ~Crew() { (void)Stop(); }

  // Returns when the load is written.
  absl::Status Wait();
  // Returns when each has ended the batch it is at.
  absl::Status Stop();
  bool failed() const { return failed_; }

 private:
  std::atomic<bool> stop_ = false;
  std::atomic<bool> failed_ = false;
  std::vector<std::unique_ptr<Writer>> writers_;
  std::vector<absl::Status> statuses_;
  std::vector<std::thread> threads_;
};

// Followers, each with a thread and a connection of its own.
class Audience {
 public:
  Audience(Site& site, int watchers, uint64_t seed);
  ~Audience();

  // Returns when all have been told what the map holds.
  absl::Status WaitUntilBegun();
  // Breaks the first half of them off.
  void CutHalf();
  // Returns when all have been told of revision `last`.
  absl::Status WaitUntil(Revision last);

  const std::vector<std::unique_ptr<Follower>>& followers() const { return followers_; }

 private:
  std::atomic<Revision> last_ = -1;
  std::vector<std::unique_ptr<Follower>> followers_;
  std::vector<absl::Status> statuses_;
  std::vector<std::thread> threads_;
};

}  // namespace hypermap::prove

#endif  // HYPERMAP_TESTS_PROVE_SITE_H_
