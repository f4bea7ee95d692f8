#include "storage/decorators/store_meters.h"

#include <algorithm>

namespace hypermap::storage {
namespace {

// Whether the store could not do what was asked, rather than that it must not.
bool IsFailure(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kOk:
    case absl::StatusCode::kAlreadyExists:
    case absl::StatusCode::kCancelled:
    case absl::StatusCode::kFailedPrecondition:
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kNotFound:
    case absl::StatusCode::kUnimplemented:
      return false;
    default:
      return true;
  }
}

}  // namespace

const char* NameOf(StoreOperation operation) {
  switch (operation) {
    case StoreOperation::kOpen:
      return "open";
    case StoreOperation::kLoad:
      return "load";
    case StoreOperation::kWrite:
      return "write";
    case StoreOperation::kFindReceipts:
      return "find_receipts";
    case StoreOperation::kCompact:
      return "compact";
    case StoreOperation::kSurvey:
      return "survey";
    case StoreOperation::kNewestRevisions:
      return "newest_revisions";
  }
  return "";
}

void StoreMeters::Add(StoreOperation operation, absl::Duration time, const absl::Status& status) {
  OfOperation& of = operations_[static_cast<size_t>(operation)];
  const auto* const bound =
      std::lower_bound(kBounds.begin(), kBounds.end(), absl::ToDoubleSeconds(time));
  of.times[bound - kBounds.begin()].fetch_add(1, std::memory_order_relaxed);
  of.total_ns.fetch_add(absl::ToInt64Nanoseconds(time), std::memory_order_relaxed);
  if (IsFailure(status)) of.failures.fetch_add(1, std::memory_order_relaxed);
}

StoreMeters::Reading StoreMeters::Read(StoreOperation operation) const {
  const OfOperation& of = operations_[static_cast<size_t>(operation)];
  Reading reading;
  for (size_t i = 0; i < reading.times.size(); ++i) {
    reading.times[i] = of.times[i].load(std::memory_order_relaxed);
  }
  reading.total = absl::Nanoseconds(of.total_ns.load(std::memory_order_relaxed));
  reading.failures = of.failures.load(std::memory_order_relaxed);
  return reading;
}

}  // namespace hypermap::storage
