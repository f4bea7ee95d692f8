// The statuses of the services of a server, and the watches of them.
#ifndef HYPERMAP_WIRE_HEALTH_STATUSES_H_
#define HYPERMAP_WIRE_HEALTH_STATUSES_H_

#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "absl/strings/string_view.h"
#include "base/sync/mutex.h"
#include "wire/health/messages.h"

namespace hypermap::health {

class WatchCall;

// At first it knows the empty name, which stands for the whole server and is SERVING. Thread safe.
// Its lock is held briefly, and never while a call is told something.
class Statuses {
 public:
  // Tells the calls that watch the service, if its status changes. Nothing is SERVING after Stop.
  void Set(const std::string& name, bool serving);
  // Makes the service unknown again, and tells the calls that watch it.
  void Forget(const std::string& name);
  // SERVICE_UNKNOWN if the status was never set, or was forgotten.
  ServingStatus Find(absl::string_view name) const;

  // Tells the call the status of its service now, and whenever it changes until Remove.
  void Add(const std::shared_ptr<WatchCall>& call);
  // Does nothing if the call was not added.
  void Remove(const WatchCall* call);

  // Makes all services NOT_SERVING, and ends all calls, and those that are added later, when they
  // have sent their statuses.
  void Stop();

 private:
  using Calls = absl::flat_hash_set<std::shared_ptr<WatchCall>>;

  struct Service {
    ServingStatus status = HealthCheckResponse::SERVICE_UNKNOWN;
    Calls calls;
  };

  mutable Mutex mutex_;
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  // Includes unknown services as long as they are watched.
  absl::flat_hash_map<std::string, Service> services_ ABSL_GUARDED_BY(mutex_) = {
      {"", {HealthCheckResponse::SERVING, {}}}};
};

}  // namespace hypermap::health

#endif  // HYPERMAP_WIRE_HEALTH_STATUSES_H_
