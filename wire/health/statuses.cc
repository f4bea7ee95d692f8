#include "wire/health/statuses.h"

#include <vector>

#include "absl/status/status.h"
#include "wire/health/watch_call.h"

namespace hypermap::health {
namespace {

void EndAfterUpdate(WatchCall& call) {
  call.Update();
  call.End(absl::UnavailableError("the server is stopping"));
}

}  // namespace

void Statuses::Set(const std::string& name, bool serving) {
  std::vector<std::shared_ptr<WatchCall>> calls;
  {
    MutexLock lock(&mutex_);
    const ServingStatus status =
        serving && !stopping_ ? HealthCheckResponse::SERVING : HealthCheckResponse::NOT_SERVING;
    Service& service = services_[name];
    if (status == service.status) return;
    service.status = status;
    calls.assign(service.calls.begin(), service.calls.end());
  }
  for (const auto& call : calls) call->Update();
}

void Statuses::Forget(const std::string& name) {
  std::vector<std::shared_ptr<WatchCall>> calls;
  {
    MutexLock lock(&mutex_);
    const auto found = services_.find(name);
    if (found == services_.end() || stopping_) return;
    found->second.status = HealthCheckResponse::SERVICE_UNKNOWN;
    calls.assign(found->second.calls.begin(), found->second.calls.end());
    if (calls.empty()) services_.erase(found);
  }
  for (const auto& call : calls) call->Update();
}

ServingStatus Statuses::Find(absl::string_view name) const {
  MutexLock lock(&mutex_);
  const auto found = services_.find(name);
  return found == services_.end() ? HealthCheckResponse::SERVICE_UNKNOWN : found->second.status;
}

void Statuses::Add(const std::shared_ptr<WatchCall>& call) {
  bool stopping = false;
  {
    MutexLock lock(&mutex_);
    stopping = stopping_;
    services_[call->service()].calls.insert(call);
  }
  if (stopping) {
    EndAfterUpdate(*call);
  } else {
    call->Update();
  }
}

void Statuses::Remove(const WatchCall* call) {
  MutexLock lock(&mutex_);
  const auto found = services_.find(call->service());
  if (found == services_.end()) return;
  Service& service = found->second;
  service.calls.erase(call);
  if (service.calls.empty() && service.status == HealthCheckResponse::SERVICE_UNKNOWN) {
    services_.erase(found);
  }
}

void Statuses::Stop() {
  std::vector<std::shared_ptr<WatchCall>> calls;
  {
    MutexLock lock(&mutex_);
    stopping_ = true;
    for (auto& [name, service] : services_) {
      if (service.status == HealthCheckResponse::SERVING) {
        service.status = HealthCheckResponse::NOT_SERVING;
      }
      calls.insert(calls.end(), service.calls.begin(), service.calls.end());
    }
  }
  for (const auto& call : calls) EndAfterUpdate(*call);
}

}  // namespace hypermap::health
