#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/slice.h>

#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "server/rpc/budgets.h"
#include "server/rpc/call_ticket.h"
#include "tests/bench/server/rows.h"

namespace hypermap::bench {
namespace {

constexpr int kCallsOfRound = 50'000;
// About the size of a QueryPoint.
constexpr int kRequestBytes = 40;

// Does the admission of calls with a small request: each is counted, its message explains
// bytes of its connection, and it is counted no longer. Returns the CPU seconds of one.
double AdmitCalls(server::Budgets* budgets, const std::vector<std::string>& peers) {
  const grpc::Slice slice(std::string(kRequestBytes, 'x'));
  const grpc::ByteBuffer request(&slice, 1);
  grpc::CallbackServerContext context;
  const double begin = ThreadCpuSeconds();
  for (int i = 0; i < kCallsOfRound; ++i) {
    server::CallTicket ticket(budgets, &context, peers[i % peers.size()]);
    ticket.Received(request);
    ticket.GiveBack();
  }
  const double seconds = (ThreadCpuSeconds() - begin) / kCallsOfRound;
  // The listener's thread does this some times a second.
  budgets->explained_bytes.Take();
  return seconds;
}

// The same for two threads that do nothing else and wait for each other's locks.
double AdmitCallsOfTwoThreads(server::Budgets* budgets, const std::vector<std::string>& peers) {
  double other = 0;
  std::thread thread([&] { other = AdmitCalls(budgets, peers); });
  const double own = AdmitCalls(budgets, peers);
  thread.join();
  return (own + other) / 2;
}

}  // namespace

absl::Status AddAdmissionRow(Bench& bench, const testing::ServerProcess& server,
                             const Channels& channels, const Calls& point_calls) {
  server::Budgets budgets((Limits()));
  std::vector<std::string> peers;
  peers.reserve(bench.options.callers);
  for (int i = 0; i < bench.options.callers; ++i) {
    peers.push_back(absl::StrCat("ipv4:127.0.0.1:", 40'000 + i));
  }
  const absl::StatusOr<Contest> contest = Alternate(
      bench.options.pace,
      [&] {
        Cost cost;
        cost.cpu_s = AdmitCalls(&budgets, peers);
        return cost;
      },
      [&] { return CostOfLoad(server, channels, point_calls, bench.options.pace.each); });
  HYPERMAP_RETURN_IF_ERROR(contest.status());
  bench.report.Add(CpuRow("admission of a call / QueryPoint", *contest, AtMost(0.02),
                          absl::StrFormat("in process; %.2f us if two threads do nothing else",
                                          AdmitCallsOfTwoThreads(&budgets, peers) * 1e6)));
  return absl::OkStatus();
}

}  // namespace hypermap::bench
