#include "server/metrics/metrics_listener.h"

#include <civetweb.h>
#include <prometheus/text_serializer.h>

#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "base/logging/log.h"
#include "base/status/unless_memory_fails.h"

namespace hypermap::server {
namespace {

// One scrape at a time is usual; more threads let probes be answered while somebody reads slowly.
constexpr char kThreads[] = "4";
// Time that a client has to send its request.
constexpr char kRequestTimeout_ms[] = "10000";
// https://prometheus.io/docs/instrumenting/exposition_formats/#text-based-format
constexpr char kMetricsType[] = "text/plain; version=0.0.4; charset=utf-8";
constexpr char kPlainType[] = "text/plain; charset=utf-8";

int LogOfCivetweb(const mg_connection* /*connection*/, const char* message) {
  logging::Log(logging::Level::kDebug, "metrics listener", {{"text", message}});
  return 1;  // Civetweb itself logs nothing.
}

int Answer(mg_connection* connection, int code, const char* type, absl::string_view body) {
  const absl::string_view method = mg_get_request_info(connection)->request_method;
  if (method != "GET" && method != "HEAD") {
    mg_send_http_error(connection, 405, "%s", "only GET and HEAD");
    return 405;
  }
  const std::string head =
      absl::StrCat("HTTP/1.1 ", code, " ", mg_get_response_code_text(connection, code),
                   "\r\nContent-Type: ", type, "\r\nContent-Length: ", body.size(),
                   "\r\nCache-Control: no-store\r\n", "Connection: close\r\n\r\n");
  mg_write(connection, head.data(), head.size());
  if (method == "GET") mg_write(connection, body.data(), body.size());
  return code;
}

// The port on which it listens; 0 if it listens nowhere, or in several places.
int PortOf(const mg_context* http) {
  mg_server_port ports[2] = {};
  return mg_get_server_ports(http, 2, ports) == 1 ? ports[0].port : 0;
}

}  // namespace

MetricsListener::MetricsListener(std::unique_ptr<prometheus::Collectable> metrics, Notes notes)
    : metrics_(std::move(metrics)), notes_(std::move(notes)) {
  mg_init_library(0);
}

absl::StatusOr<std::unique_ptr<MetricsListener>> MetricsListener::Start(
    const std::string& address, std::unique_ptr<prometheus::Collectable> metrics, Notes notes) {
  std::unique_ptr<MetricsListener> made(new MetricsListener(std::move(metrics), std::move(notes)));
  mg_callbacks callbacks = {};
  callbacks.log_message = LogOfCivetweb;
  const char* options[] = {"listening_ports",    address.c_str(),    "num_threads", kThreads,
                           "request_timeout_ms", kRequestTimeout_ms, nullptr};
  made->http_ = mg_start(&callbacks, nullptr, options);
  const int port = made->http_ == nullptr ? 0 : PortOf(made->http_);
  if (port == 0) {
    return absl::UnavailableError(absl::StrCat("--metrics_listen=", address,
                                               ": can't listen there; is it HOST:PORT, and free?"));
  }
  made->address_ = absl::StrCat(address.substr(0, address.rfind(':')), ":", port);
  mg_set_request_handler(made->http_, "/metrics", AnswerMetrics, made.get());
  mg_set_request_handler(made->http_, "/livez", AnswerLive, made.get());
  mg_set_request_handler(made->http_, "/readyz", AnswerReady, made.get());
  return made;
}

MetricsListener::~MetricsListener() {
  if (http_ != nullptr) mg_stop(http_);
  mg_exit_library();
}

int MetricsListener::AnswerMetrics(mg_connection* connection, void* self) {
  const auto& listener = *static_cast<const MetricsListener*>(self);
  const absl::StatusOr<std::string> text = UnlessMemoryFails([&]() -> absl::StatusOr<std::string> {
    return prometheus::TextSerializer().Serialize(listener.metrics_->Collect());
  });
  if (!text.ok()) return Answer(connection, 503, kPlainType, text.status().message());
  return Answer(connection, 200, kMetricsType, *text);
}

int MetricsListener::AnswerLive(mg_connection* connection, void* /*self*/) {
  return Answer(connection, 200, kPlainType, "alive\n");
}

int MetricsListener::AnswerReady(mg_connection* connection, void* self) {
  const auto& listener = *static_cast<const MetricsListener*>(self);
  if (listener.is_stopping_) return Answer(connection, 503, kPlainType, "stopping\n");
  return Answer(connection, 200, kPlainType, absl::StrCat("ready\n", listener.notes_()));
}

}  // namespace hypermap::server
