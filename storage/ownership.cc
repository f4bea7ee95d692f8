#include "storage/ownership.h"

#include "absl/strings/cord.h"

namespace hypermap::storage {
namespace {

constexpr char kPayload[] = "hypermap/lost_ownership";

}  // namespace

absl::Status LostOwnershipError(absl::string_view message) {
  absl::Status status = absl::DataLossError(message);
  status.SetPayload(kPayload, absl::Cord());
  return status;
}

bool IsLostOwnership(const absl::Status& status) { return status.GetPayload(kPayload).has_value(); }

}  // namespace hypermap::storage
