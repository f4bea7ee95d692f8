// Which revision a question is asked of, on the wire.
#ifndef HYPERMAP_WIRE_AS_OF_H_
#define HYPERMAP_WIRE_AS_OF_H_

#include "absl/status/statusor.h"
#include "map/query/as_of.h"
#include "wire/field.h"
#include "wire/time.h"

namespace hypermap::wire {

// Of any of the queries' requests. INVALID_ARGUMENT for a negative revision or a time that is none.
template <typename Request>
absl::StatusOr<AsOf> DecodeAsOf(const Request& request) {
  AsOf as_of;
  if (request.has_at_revision()) {
    if (request.at_revision() < 0) return InvalidField("at_revision", "is negative");
    as_of.revision = request.at_revision();
  } else if (request.has_at_time()) {
    const absl::StatusOr<absl::Time> time = DecodeTime("at_time", request.at_time());
    if (!time.ok()) return time.status();
    as_of.time = *time;
  }
  if (request.min_revision() < 0) return InvalidField("min_revision", "is negative");
  as_of.min_revision = request.min_revision();
  return as_of;
}

template <typename Request>
void EncodeAsOf(const AsOf& as_of, Request* request) {
  if (as_of.revision) {
    request->set_at_revision(*as_of.revision);
  } else if (as_of.time) {
    EncodeTime(*as_of.time, request->mutable_at_time());
  }
  request->set_min_revision(as_of.min_revision);
}

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_AS_OF_H_
