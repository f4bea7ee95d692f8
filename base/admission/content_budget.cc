#include "base/admission/content_budget.h"

#include <algorithm>
#include <limits>

#include "absl/strings/str_cat.h"

namespace hypermap::admission {

int64_t ContentBudget::room() const {
  if (limit_ == 0) return std::numeric_limits<int64_t>::max();
  return std::max<int64_t>(0, limit_ - bytes_);
}

bool ContentBudget::Take(int64_t bytes) {
  int64_t before = bytes_;
  do {
    if (limit_ != 0 && bytes > limit_ - before) return false;
  } while (!bytes_.compare_exchange_weak(before, before + bytes));
  return true;
}

absl::Status ContentBudget::Share::Grow(int64_t bytes) {
  if (bytes <= 0) {
    Add(bytes);
    return absl::OkStatus();
  }
  if (budget_->Take(bytes)) {
    bytes_ += bytes;
    return absl::OkStatus();
  }
  return absl::ResourceExhaustedError(
      absl::StrCat("the content of the map would grow by ", bytes, " bytes of memory to ",
                   bytes_ + bytes, ", and that of all maps to ", budget_->bytes() + bytes,
                   ": --max_content_bytes is ", budget_->limit_));
}

void ContentBudget::Share::Add(int64_t bytes) {
  bytes_ += bytes;
  budget_->bytes_ += bytes;
}

}  // namespace hypermap::admission
