// The memory that submissions take while they wait for a map's writer.
#ifndef HYPERMAP_SERVER_SESSION_SUBMISSION_SIZE_H_
#define HYPERMAP_SERVER_SESSION_SUBMISSION_SIZE_H_

#include <cstdint>

#include "server/session/group_commit.h"

namespace hypermap::server {

// Bytes, as in map/edits/byte_size.h. Positive.
int64_t ByteSize(const Submission& submission);
int64_t ByteSize(const FusionSubmission& submission);
int64_t ByteSize(const ObservationSubmission& submission);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_SUBMISSION_SIZE_H_
