// The rpc EstimateTransform, which compares two maps.
#ifndef HYPERMAP_SERVER_SERVICES_ESTIMATE_TRANSFORM_H_
#define HYPERMAP_SERVER_SERVICES_ESTIMATE_TRANSFORM_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include "server/rpc/facilities.h"
#include "server/rpc/unary_call.h"

namespace hypermap::server {

// Waits for the revisions that the request asks for, then computes on a worker for estimates.
// Calls with the same target are answered one at a time, because each takes a thread for seconds.
// `facilities` must outlive the call.
grpc::ServerUnaryReactor* EstimateTransform(const Facilities& facilities,
                                            grpc::CallbackServerContext* context,
                                            const RawMessages& raw);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_ESTIMATE_TRANSFORM_H_
