#include "server/fusion/remembered_steps.h"

#include <iterator>
#include <utility>

namespace hypermap::server {

fusion::FoldStepPtr RememberedSteps::Find(const storage::LogKey& key,
                                          const Observation& observation) const {
  const auto found = steps_.find(key);
  if (found == steps_.end() || found->second.observation.get() != &observation) return nullptr;
  return found->second.step;
}

void RememberedSteps::Set(const storage::LogKey& key,
                          std::shared_ptr<const Observation> observation,
                          fusion::FoldStepPtr step) {
  if (const auto former = steps_.find(key); former != steps_.end()) Erase(former);
  if (!step) return;
  const int64_t bytes = step->bytes();
  steps_.emplace(key, Remembered{std::move(observation), std::move(step), bytes});
  bytes_ += bytes;
  while (!steps_.empty() && (steps_.size() > kMostSteps || bytes_ > max_bytes_)) {
    Erase(steps_.begin());
  }
}

void RememberedSteps::Erase(Steps::iterator step) {
  bytes_ -= step->second.bytes;
  steps_.erase(step);
}

size_t RememberedSteps::NumAfter(const storage::LogKey& key) const {
  return static_cast<size_t>(std::distance(steps_.upper_bound(key), steps_.end()));
}

}  // namespace hypermap::server
