// The schema that a server tells its clients by reflection.
#ifndef HYPERMAP_WIRE_REFLECTION_SERVED_SCHEMA_H_
#define HYPERMAP_WIRE_REFLECTION_SERVED_SCHEMA_H_

#include <google/protobuf/descriptor.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/slice.h>

#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/sync/mutex.h"
#include "grpc/reflection/v1/reflection.pb.h"

namespace hypermap::reflection {

namespace v1 = grpc::reflection::v1;

// The names of the services, and the .proto files that are linked into the program. A file is sent
// together with all files that it imports. It is encoded once, and all answers with it share these
// bytes, so that an answer that waits for a slow reader takes at most twice the memory of its
// request. Thread safe.
class ServedSchema {
 public:
  explicit ServedSchema(std::vector<std::string> services) : services_(std::move(services)) {}

  // Returns the encoded response. Its error_response is NOT_FOUND for an unknown name, and
  // INVALID_ARGUMENT for a request that asks nothing.
  grpc::ByteBuffer Answer(v1::ServerReflectionRequest request);

 private:
  using File = const google::protobuf::FileDescriptor*;

  // Fills the response, or returns the file that is the answer, or the error that is. Returns
  // nullptr if it has filled the response.
  absl::StatusOr<File> Find(const v1::ServerReflectionRequest& request,
                            v1::ServerReflectionResponse* response) const;
  void ListServices(v1::ListServiceResponse* response) const;

  // The encoded response that contains the file with its imports, and nothing else.
  grpc::Slice EncodedWithImports(File file);

  const std::vector<std::string> services_;
  Mutex mutex_;
  // At most one entry for each file of the program.
  absl::flat_hash_map<File, grpc::Slice> encoded_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::reflection

#endif  // HYPERMAP_WIRE_REFLECTION_SERVED_SCHEMA_H_
