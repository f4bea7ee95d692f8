// Times on the wire.
#ifndef HYPERMAP_WIRE_TIME_H_
#define HYPERMAP_WIRE_TIME_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "google/protobuf/duration.pb.h"
#include "google/protobuf/timestamp.pb.h"

namespace hypermap::wire {

// To nanoseconds, rounded down.
void EncodeTime(absl::Time time, google::protobuf::Timestamp* message);
absl::Time DecodeTime(const google::protobuf::Timestamp& message);
// Decodes a time of a request. INVALID_ARGUMENT for times outside the years 1 to 9999.
absl::StatusOr<absl::Time> DecodeTime(absl::string_view field,
                                      const google::protobuf::Timestamp& message);

// To nanoseconds, rounded towards zero.
void EncodeDuration(absl::Duration duration, google::protobuf::Duration* message);
// INVALID_ARGUMENT for durations longer than 100 years, of either sign.
absl::StatusOr<absl::Duration> DecodeDuration(absl::string_view field,
                                              const google::protobuf::Duration& message);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_TIME_H_
