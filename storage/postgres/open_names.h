// Which maps of a store are open in this process.
#ifndef HYPERMAP_STORAGE_POSTGRES_OPEN_NAMES_H_
#define HYPERMAP_STORAGE_POSTGRES_OPEN_NAMES_H_

#include <functional>
#include <set>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "base/sync/mutex.h"

namespace hypermap::storage::postgres {

// The maps that are open in this process, or are being opened. Thread safe.
class OpenNames {
 public:
  // Returns whether the name was not there.
  bool Add(const std::string& name) {
    const MutexLock lock(&mutex_);
    return names_.insert(name).second;
  }
  void Remove(const std::string& name) {
    const MutexLock lock(&mutex_);
    names_.erase(name);
  }
  bool Contains(const std::string& name) const {
    const MutexLock lock(&mutex_);
    return names_.contains(name);
  }

 private:
  mutable Mutex mutex_;
  std::set<std::string> names_ ABSL_GUARDED_BY(mutex_);
};

// Has a name of OpenNames, until it is given to a map.
class NameHolder {
 public:
  // FAILED_PRECONDITION if the map is open.
  static absl::StatusOr<NameHolder> Take(OpenNames* names, const std::string& name) {
    if (names->Add(name)) return NameHolder(names, name);
    return absl::FailedPreconditionError(absl::StrCat("map ", name, " is open"));
  }
  NameHolder(NameHolder&& other) noexcept
      : names_(std::exchange(other.names_, nullptr)), name_(std::move(other.name_)) {}
  NameHolder& operator=(NameHolder&&) = delete;
  ~NameHolder() {
    if (names_ != nullptr) names_->Remove(name_);
  }
  // Returns what gives the name back.
  std::function<void()> Give() && {
    return [names = std::exchange(names_, nullptr), name = name_] { names->Remove(name); };
  }

 private:
  NameHolder(OpenNames* names, std::string name) : names_(names), name_(std::move(name)) {}
  OpenNames* names_;
  std::string name_;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_OPEN_NAMES_H_
