// A client of a service as nodes of rmw_fastrtps_cpp have it: requests name its reader of replies,
// and replies name their request. For tests.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_DDS_TESTING_FAST_CLIENT_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_DDS_TESTING_FAST_CLIENT_H_

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "client_libs/ros2/dds/dds.h"
#include "client_libs/ros2/dds/node.h"

namespace hypermap::ros2 {

// A node of its own. Its functions are called by one thread.
class FastClient : private DataReaderListener {
 public:
  // `service` is a name of ROS such as "/map_server/map", `type` one of the wire (Service::kType).
  FastClient(const DdsOptions& options, const std::string& service, const std::string& type);
  ~FastClient() override;

  // Waits until somebody reads requests. Returns whether that has come to pass.
  bool AwaitService(absl::Duration timeout);
  // Sends a request in CDR and returns the reply to it, also in CDR. nullopt: none has come.
  std::optional<std::string> Call(std::string request, absl::Duration timeout);
  // Whether each reply so far, also those to others, has named a call. ros2-client needs that.
  bool all_replies_named_calls() const { return all_named_calls_; }

 private:
  void on_data_available(DataReader* reader) override;

  const std::unique_ptr<Node> node_;
  DataReader* replies_ = nullptr;
  DataWriter* requests_ = nullptr;
  std::atomic<bool> all_named_calls_ = true;
  Mutex mutex_;
  CondVar changed_;
  // By the numbers of their requests.
  std::map<int64_t, std::string> replied_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_DDS_TESTING_FAST_CLIENT_H_
