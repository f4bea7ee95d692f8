// Estimates how much memory a message takes, before it is parsed.
#ifndef HYPERMAP_WIRE_MESSAGE_MEMORY_H_
#define HYPERMAP_WIRE_MESSAGE_MEMORY_H_

#include <google/protobuf/message.h>
#include <grpcpp/support/byte_buffer.h>

#include <cstdint>

namespace hypermap::wire {

// Returns about how many bytes a message of the prototype's type takes when it is parsed from
// `bytes`. A message in memory can be tens of times larger than on the wire, because each empty
// string, message or unknown field takes two bytes there. Reads the tags and lengths only, in one
// pass, and allocates nothing. Of malformed bytes, it counts those before the fault.
int64_t MemoryOfMessage(const google::protobuf::Message& prototype, const grpc::ByteBuffer& bytes);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_MESSAGE_MEMORY_H_
