#include "base/admission/budget.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/admission/refusals.h"
#include "base/status/status_macros.h"

namespace hypermap::admission {

absl::Status Budget::Charge::Add(int64_t amount) {
  HYPERMAP_RETURN_IF_ERROR(budget_->Take(client_, amount));
  amount_ += amount;
  return absl::OkStatus();
}

Budget::Budget(absl::string_view flag, int64_t amount, BudgetOptions options)
    : flag_(flag),
      amount_(amount > 0 ? amount : std::numeric_limits<int64_t>::max()),
      options_(std::move(options)),
      of_one_client_(options_.whole_for_one_client ? amount_ : amount_ / 2) {}

int64_t Budget::used() const {
  const MutexLock lock(&mutex_);
  return used_;
}

absl::Status Budget::Take(const std::string& client, int64_t amount) {
  const MutexLock lock(&mutex_);
  const auto it = used_by_.find(client);
  const int64_t of_client = it == used_by_.end() ? 0 : it->second;
  if (amount > of_one_client_ && !options_.takes_one_larger) return RefuseForGood(amount);
  const bool larger_of_client = options_.takes_one_larger && of_client == 0;
  if (amount > of_one_client_ - of_client && !larger_of_client) return RefuseClient();
  const bool larger_of_all = options_.takes_one_larger && used_ == 0;
  if (amount > amount_ - used_ && !larger_of_all) return Refuse();
  if (amount == 0) return absl::OkStatus();
  used_ += amount;
  if (it != used_by_.end()) {
    it->second += amount;
    return absl::OkStatus();
  }
  if (used_by_.size() >= forget_at_) {
    absl::erase_if(used_by_, [](const auto& of_client) { return of_client.second == 0; });
    forget_at_ = std::max(kForgetAt, 2 * used_by_.size());
  }
  used_by_[client] = amount;
  return absl::OkStatus();
}

absl::Status Budget::RefuseForGood(int64_t amount) const {
  return absl::ResourceExhaustedError(
      absl::StrCat(amount, " ", options_.unit, " are more than ",
                   options_.whole_for_one_client ? "" : "one client may hold, half of ", "--",
                   flag_, ", ", amount_, " ", options_.unit));
}

absl::Status Budget::RefuseClient() const {
  if (options_.whole_for_one_client) return Refuse();
  return TryLater(absl::StrCat("requests of one client may hold half of --", flag_, ", ", amount_,
                               " ", options_.unit, "; try again when others have ended"));
}

absl::Status Budget::Refuse() const {
  return TryLater(absl::StrCat("requests already hold --", flag_, ", ", amount_, " ", options_.unit,
                               "; try again later"));
}

void Budget::GiveBack(const std::string& client, int64_t amount) {
  if (amount == 0) return;
  const MutexLock lock(&mutex_);
  used_ -= amount;
  used_by_.find(client)->second -= amount;
}

}  // namespace hypermap::admission
