// Serves the metrics, and whether the server lives and is ready, by HTTP.
#ifndef HYPERMAP_SERVER_METRICS_METRICS_LISTENER_H_
#define HYPERMAP_SERVER_METRICS_METRICS_LISTENER_H_

#include <prometheus/collectable.h>

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "absl/status/statusor.h"

struct mg_connection;
struct mg_context;

namespace hypermap::server {

// Answers GET and HEAD until it is destroyed, on threads of its own:
//
//   /metrics  the metrics, as Prometheus reads them
//   /livez    200: the process answers
//   /readyz   200, or 503 from SetStopping on: calls are accepted; then a line for each map that is
//             not served as it should be
//
// SetStopping may be called by any thread.
class MetricsListener {
 public:
  // Lines about what is not well although the server is ready. Called by several threads.
  using Notes = std::function<std::string()>;

  // `address` is HOST:PORT; port 0 takes a free port. UNAVAILABLE if it can't listen there.
  static absl::StatusOr<std::unique_ptr<MetricsListener>> Start(
      const std::string& address, std::unique_ptr<prometheus::Collectable> metrics, Notes notes);
  ~MetricsListener();
  MetricsListener(const MetricsListener&) = delete;
  MetricsListener& operator=(const MetricsListener&) = delete;

  // HOST:PORT with the actual port.
  const std::string& address() const { return address_; }

  void SetStopping() { is_stopping_ = true; }

 private:
  MetricsListener(std::unique_ptr<prometheus::Collectable> metrics, Notes notes);

  // Handlers of civetweb, whose `self` is a MetricsListener. They return the HTTP status.
  static int AnswerMetrics(mg_connection* connection, void* self);
  static int AnswerLive(mg_connection* connection, void* self);
  static int AnswerReady(mg_connection* connection, void* self);

  std::string address_;
  const std::unique_ptr<prometheus::Collectable> metrics_;
  const Notes notes_;
  std::atomic<bool> is_stopping_ = false;
  mg_context* http_ = nullptr;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_METRICS_METRICS_LISTENER_H_
