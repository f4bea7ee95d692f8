// Calls of any rpc through gRPC's generic stub.
#ifndef HYPERMAP_TESTS_FUZZ_GENERIC_CALLS_H_
#define HYPERMAP_TESTS_FUZZ_GENERIC_CALLS_H_

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <grpcpp/channel.h>
#include <grpcpp/generic/generic_stub.h>

#include <map>
#include <memory>
#include <vector>

#include "tests/fuzz/calls.pb.h"

namespace hypermap::fuzz {

// Makes calls one after the other. Not thread safe.
class GenericCalls {
 public:
  explicit GenericCalls(const std::shared_ptr<grpc::Channel>& channel) : stub_(channel) {}

  // Makes the call, reads its first answers, and cancels it if no more come. Returns its status:
  // OK if it was cancelled for that reason. A call without a request is OK, too.
  grpc::Status Make(const Call& call);

 private:
  using Messages = std::vector<const google::protobuf::Message*>;

  grpc::Status Run(const google::protobuf::MethodDescriptor& method, const Messages& messages);

  grpc::GenericStub stub_;
};

// The rpc of a call; null without a request.
const google::protobuf::MethodDescriptor* MethodOf(const Call& call);

}  // namespace hypermap::fuzz

#endif  // HYPERMAP_TESTS_FUZZ_GENERIC_CALLS_H_
