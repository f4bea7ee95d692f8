// Server reflection: tells clients such as grpcurl the services and messages of a server.
#ifndef HYPERMAP_WIRE_REFLECTION_REFLECTION_SERVICE_H_
#define HYPERMAP_WIRE_REFLECTION_REFLECTION_SERVICE_H_

#include <grpcpp/server_builder.h>

#include <memory>
#include <string>
#include <vector>

#include "wire/reflection/ticket.h"

namespace hypermap::reflection {

// Serves grpc.reflection.v1.ServerReflection and grpc.reflection.v1alpha.ServerReflection, which
// differ in their names only. Takes the place of gRPC's own plugin, each of whose streams takes a
// thread for as long as it is open. Must not be linked together with that plugin
// (libgrpc++_reflection), which defines the same messages. Thread safe.
//
//   ReflectionService reflection({"hypermap.v1.QueryService"}, admit);
//   reflection.RegisterWith(&builder);
class ReflectionService {
 public:
  // `services` are the full names of the server's other services. A service whose .proto file is
  // not linked into the program is listed, but not described.
  ReflectionService(std::vector<std::string> services, Admit admit);
  ~ReflectionService();
  ReflectionService(const ReflectionService&) = delete;
  ReflectionService& operator=(const ReflectionService&) = delete;

  // To be called once. This must outlive the server that is built.
  void RegisterWith(grpc::ServerBuilder* builder);

  // Ends all streams with UNAVAILABLE, and refuses new ones. One whose client does not read ends
  // when its answer has been written.
  void Stop();

 private:
  struct Impl;

  const std::unique_ptr<Impl> impl_;
};

}  // namespace hypermap::reflection

#endif  // HYPERMAP_WIRE_REFLECTION_REFLECTION_SERVICE_H_
