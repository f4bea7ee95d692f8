// The end of gRPC at the end of a program.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_SCOPED_GRPC_H_
#define HYPERMAP_CLIENT_LIBS_CPP_SCOPED_GRPC_H_

namespace hypermap::client {

// To be made in main() of a program with clients, before them, but after signals are blocked: it
// starts gRPC's threads. When it is destroyed, after all clients, these threads end, and it waits
// for that. Without it, a thread that has set up a connection may still use OpenSSL when exit()
// takes OpenSSL down, which loses what OpenSSL keeps for the thread.
class ScopedGrpc {
 public:
  ScopedGrpc();
  // Waits for a second at most, in case that a client is never destroyed.
  ~ScopedGrpc();
  ScopedGrpc(const ScopedGrpc&) = delete;
  ScopedGrpc& operator=(const ScopedGrpc&) = delete;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_SCOPED_GRPC_H_
