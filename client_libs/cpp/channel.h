// The gRPC channel of a client. Only for the sources of this folder.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_CHANNEL_H_
#define HYPERMAP_CLIENT_LIBS_CPP_CHANNEL_H_

#include <grpc/support/time.h>
#include <grpcpp/channel.h>

#include <memory>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/time/time.h"
#include "base/sync/deadline.h"
#include "client_libs/cpp/client.h"

namespace hypermap::client {

// Makes a channel for each of `targets`, which commas separate, with the security that the options
// ask for. If they are not valid for one of them, each call fails with UNAUTHENTICATED and the
// reason.
std::vector<std::shared_ptr<grpc::Channel>> MakeChannels(const std::string& targets,
                                                         const ClientOptions& options);

// Returns the deadline as gRPC's functions take it.
gpr_timespec GrpcTime(const Deadline& deadline);

// Waits before a retry. Returns early if the channel becomes connected, or if `given_up`, which is
// polled, returns true. gRPC reconnects at once while a caller waits on the channel, otherwise only
// seconds after the server is back.
void Pause(
    grpc::Channel& channel, absl::Duration duration,
    absl::FunctionRef<bool()> given_up = [] { return false; });

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_CHANNEL_H_
