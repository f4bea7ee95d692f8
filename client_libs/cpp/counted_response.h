// Messages of watches whose changes are counted and not decoded. Only for the sources of this
// folder.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_COUNTED_RESPONSE_H_
#define HYPERMAP_CLIENT_LIBS_CPP_COUNTED_RESPONSE_H_

#include <google/protobuf/io/coded_stream.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/status.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "hypermap/v1/watch_service.pb.h"

namespace hypermap::client {

// A WatchResponse, or a ReplicateResponse without its map: their fields have the same numbers and
// types. The accessors are named like those of the messages. Nearly all bytes and objects of a
// message are in its changes, so that this takes a small part of the time to parse it.
class CountedResponse {
 public:
  // Reads a message that ends at the limit of `input`. Returns false if it is not valid.
  bool Parse(google::protobuf::io::CodedInputStream& input) { return Parse(input, true); }

  int64_t revision() const { return rest_.revision(); }
  bool has_time() const { return rest_.has_time(); }
  const google::protobuf::Timestamp& time() const { return rest_.time(); }
  const std::string& author() const { return rest_.author(); }
  int64_t num_changes() const { return num_changes_; }
  bool more() const { return rest_.more(); }
  bool snapshot() const { return rest_.snapshot(); }
  bool reset() const { return rest_.reset(); }
  uint64_t incarnation() const { return rest_.incarnation(); }

  int coalesced_size() const { return static_cast<int>(coalesced_.size()); }
  CountedResponse* mutable_coalesced(int index) { return &coalesced_[index]; }
  void Swap(CountedResponse* other) { std::swap(*this, *other); }

 private:
  // `may_coalesce`: whether the message may have others in it, which must not have any themselves.
  bool Parse(google::protobuf::io::CodedInputStream& input, bool may_coalesce);
  // Reads the field with this tag. Appends it to `rest` if it is one of rest_.
  bool ParseField(uint32_t tag, google::protobuf::io::CodedInputStream& input, bool may_coalesce,
                  std::string* rest);

  v1::WatchResponse rest_;  // without changes and coalesced messages
  int64_t num_changes_ = 0;
  std::vector<CountedResponse> coalesced_;
};

}  // namespace hypermap::client

namespace grpc {

// Lets gRPC's readers return CountedResponse.
template <>
class SerializationTraits<hypermap::client::CountedResponse> {
 public:
  static Status Deserialize(ByteBuffer* buffer, hypermap::client::CountedResponse* response);
};

}  // namespace grpc

#endif  // HYPERMAP_CLIENT_LIBS_CPP_COUNTED_RESPONSE_H_
