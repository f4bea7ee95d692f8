// The request of the rpc Replicate. Only for code that makes this call.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_REPLICATE_REQUEST_H_
#define HYPERMAP_CLIENT_LIBS_CPP_REPLICATE_REQUEST_H_

#include <string>

#include "client_libs/cpp/watch.h"
#include "hypermap/v1/watch_service.pb.h"

namespace hypermap::client {

v1::ReplicateRequest EncodeReplicate(const std::string& map, const ReplicateOptions& options);

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_REPLICATE_REQUEST_H_
