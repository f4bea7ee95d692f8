#include "server/metrics/metrics_listener.h"

#include <civetweb.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "server/metrics/families.h"

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Pair;

class OneGauge final : public prometheus::Collectable {
 public:
  std::vector<prometheus::MetricFamily> Collect() const override {
    return {std::move(Family("a_gauge", "Help.", prometheus::MetricType::Gauge).Add({}, 7))};
  }
};

class MetricsListenerTest : public ::testing::Test {
 protected:
  MetricsListenerTest() {
    auto started = MetricsListener::Start("127.0.0.1:0", std::make_unique<OneGauge>(),
                                          [this] { return notes_; });
    EXPECT_TRUE(started.ok()) << started.status();
    listener_ = *std::move(started);
  }

  // The HTTP status and the body of the answer.
  std::pair<int, std::string> Request(const std::string& method, const std::string& path) {
    int port = 0;
    const std::string& address = listener_->address();
    EXPECT_TRUE(absl::SimpleAtoi(address.substr(address.rfind(':') + 1), &port)) << address;
    const std::string request = absl::StrCat(method, " ", path, " HTTP/1.0\r\n\r\n");
    char error[256] = "";
    mg_connection* const connection =
        mg_download("127.0.0.1", port, 0, error, sizeof error, "%s", request.c_str());
    EXPECT_NE(connection, nullptr) << error;
    if (connection == nullptr) return {};
    const int code = mg_get_response_info(connection)->status_code;
    std::string body;
    char buffer[1024];
    for (int n = mg_read(connection, buffer, sizeof buffer); n > 0;
         n = mg_read(connection, buffer, sizeof buffer)) {
      body.append(buffer, static_cast<size_t>(n));
    }
    mg_close_connection(connection);
    return {code, body};
  }
  std::pair<int, std::string> Get(const std::string& path) { return Request("GET", path); }

  std::string notes_;
  std::unique_ptr<MetricsListener> listener_;
};

TEST_F(MetricsListenerTest, ServesMetrics) {
  EXPECT_THAT(Get("/metrics"), Pair(200, HasSubstr("\na_gauge 7\n")));
}

TEST_F(MetricsListenerTest, IsAliveUntilItsEndAndReadyUntilItStops) {
  EXPECT_THAT(Get("/livez"), Pair(200, "alive\n"));
  EXPECT_THAT(Get("/readyz"), Pair(200, "ready\n"));
  listener_->SetStopping();
  EXPECT_THAT(Get("/livez"), Pair(200, "alive\n"));
  EXPECT_THAT(Get("/readyz"), Pair(503, "stopping\n"));
}

TEST_F(MetricsListenerTest, ReadinessNamesWhatIsNotWell) {
  notes_ = "map site: read_only: disk full\n";
  EXPECT_THAT(Get("/readyz"), Pair(200, "ready\nmap site: read_only: disk full\n"));
}

TEST_F(MetricsListenerTest, NothingElseIsServed) {
  EXPECT_EQ(Get("/").first, 404);
  EXPECT_EQ(Get("/etc/passwd").first, 404);
  EXPECT_EQ(Request("POST", "/metrics").first, 405);
}

TEST_F(MetricsListenerTest, UnusableAddressesAreRefused) {
  for (const std::string& address :
       {listener_->address(), std::string("127.0.0.1:x"), std::string("127.0.0.1:0,127.0.0.1:0")}) {
    const absl::Status status =
        MetricsListener::Start(address, std::make_unique<OneGauge>(), [] { return ""; }).status();
    EXPECT_TRUE(absl::IsUnavailable(status)) << address;
  }
}

}  // namespace
}  // namespace hypermap::server
