// The standard health service, by which clients learn whether a server and its services work.
#ifndef HYPERMAP_WIRE_HEALTH_HEALTH_SERVICE_H_
#define HYPERMAP_WIRE_HEALTH_HEALTH_SERVICE_H_

#include <grpcpp/server_builder.h>

#include <memory>
#include <string>

#include "wire/reflection/ticket.h"

namespace hypermap::health {

// Serves grpc.health.v1.Health (https://github.com/grpc/grpc/blob/master/doc/health-checking.md).
// Takes the place of gRPC's own health service, which bounds neither the number of its calls nor
// the size of their requests. Must not be used together with it. Thread safe.
//
//   HealthService health(admit);
//   health.RegisterWith(&builder);
//   health.SetServingStatus("hypermap.v1.QueryService", true);
class HealthService {
 public:
  // For reflection.
  static constexpr char kName[] = "grpc.health.v1.Health";

  // The whole server, whose name is empty, is SERVING at first; all other services are unknown.
  explicit HealthService(reflection::Admit admit);
  ~HealthService();
  HealthService(const HealthService&) = delete;
  HealthService& operator=(const HealthService&) = delete;

  // To be called once. This must outlive the server that is built.
  void RegisterWith(grpc::ServerBuilder* builder);

  // Tells those who watch the service, if its status changes. Nothing is SERVING after Stop.
  void SetServingStatus(const std::string& service, bool serving);
  // Makes a service unknown again that there is no more. Does nothing after Stop.
  void Forget(const std::string& service);

  // Makes all services NOT_SERVING, and ends all watches with UNAVAILABLE after they have told it.
  // The watch of a client that does not read ends when it was cancelled. Later calls learn
  // NOT_SERVING, too.
  void Stop();

 private:
  struct Impl;

  const std::unique_ptr<Impl> impl_;
};

}  // namespace hypermap::health

#endif  // HYPERMAP_WIRE_HEALTH_HEALTH_SERVICE_H_
