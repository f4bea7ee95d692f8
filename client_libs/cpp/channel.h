// The channel that a client's calls go over. Only for the sources of this folder.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_CHANNEL_H_
#define HYPERMAP_CLIENT_LIBS_CPP_CHANNEL_H_

#include <grpcpp/channel.h>

#include <memory>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/time/time.h"
#include "client_libs/cpp/client.h"

namespace hypermap::client {

// With the security that the options ask for. Where they can't be fulfilled each call fails with
// UNAUTHENTICATED and says why.
std::shared_ptr<grpc::Channel> MakeChannel(const std::string& target, const ClientOptions& options);

// Waits before a call is tried again; for less when the channel gets connected meanwhile, or when
// `given_up`, which is asked every now and then, says so. gRPC notices that a server is back while
// somebody waits for it, otherwise seconds later.
void Pause(
    grpc::Channel& channel, absl::Duration duration,
    absl::FunctionRef<bool()> given_up = [] { return false; });

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_CHANNEL_H_
