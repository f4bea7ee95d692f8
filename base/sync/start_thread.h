// Starts a thread without an exception if the system has none to give.
#ifndef HYPERMAP_BASE_SYNC_START_THREAD_H_
#define HYPERMAP_BASE_SYNC_START_THREAD_H_

#include <system_error>
#include <thread>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "base/sync/thread_name.h"

namespace hypermap {

// Starts a thread of this name, which runs `run`. RESOURCE_EXHAUSTED if there are too many threads
// or too little memory for one more.
template <typename Function>
absl::StatusOr<std::thread> StartThread(ThreadName name, Function run) {
  try {
    return std::thread([name, run = std::move(run)]() mutable {
      NameThisThread(name);
      run();
    });
  } catch (const std::system_error& error) {
    return absl::ResourceExhaustedError(absl::StrCat("no thread can be started: ", error.what()));
  }
}

}  // namespace hypermap

#endif  // HYPERMAP_BASE_SYNC_START_THREAD_H_
