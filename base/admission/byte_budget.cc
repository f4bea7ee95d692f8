#include "base/admission/byte_budget.h"

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::admission {

absl::Status ByteBudget::Charge::Add(int64_t bytes) {
  HYPERMAP_RETURN_IF_ERROR(budget_->Take(client_, bytes));
  bytes_ += bytes;
  return absl::OkStatus();
}

int64_t ByteBudget::used_bytes() const {
  const MutexLock lock(&mutex_);
  return used_;
}

absl::Status ByteBudget::Take(const std::string& client, int64_t bytes) {
  const MutexLock lock(&mutex_);
  const auto it = used_by_.find(client);
  const int64_t of_client = (it == used_by_.end() ? 0 : it->second) + bytes;
  if (of_client > bytes_ / 2) {
    return absl::ResourceExhaustedError(absl::StrCat("requests of one client may hold half of --",
                                                     flag_, ", ", bytes_,
                                                     " bytes; try again when others have ended"));
  }
  if (used_ + bytes > bytes_) {
    return absl::ResourceExhaustedError(
        absl::StrCat("requests already hold --", flag_, ", ", bytes_, " bytes; try again later"));
  }
  used_ += bytes;
  used_by_[client] = of_client;
  return absl::OkStatus();
}

void ByteBudget::GiveBack(const std::string& client, int64_t bytes) {
  if (bytes == 0) return;
  const MutexLock lock(&mutex_);
  used_ -= bytes;
  const auto it = used_by_.find(client);
  it->second -= bytes;
  if (it->second == 0) used_by_.erase(it);
}

}  // namespace hypermap::admission
