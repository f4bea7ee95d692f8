// Times on the wire.
#ifndef HYPERMAP_WIRE_TIME_H_
#define HYPERMAP_WIRE_TIME_H_

#include "absl/time/time.h"
#include "google/protobuf/timestamp.pb.h"

namespace hypermap::wire {

// Nanoseconds, rounded down.
void EncodeTime(absl::Time time, google::protobuf::Timestamp* message);
absl::Time DecodeTime(const google::protobuf::Timestamp& message);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_TIME_H_
