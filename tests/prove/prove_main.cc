// hypermap_prove PROOF: loads a real server and checks its answers against a model in memory. The
// last line is one JSON object with the counts and "holds". The exit code is 0 if the proof holds.
#include <CLI/CLI.hpp>
#include <exception>
#include <functional>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "tests/prove/outbox_holder.h"
#include "tests/prove/proofs.h"

namespace hypermap::prove {
namespace {

int Main(int argc, char** argv) {
  if (const std::optional<int> code = HoldOutbox(argc, argv)) return *code;
  const std::map<std::string, std::function<absl::StatusOr<Verdict>(Site&, const Sizes&)>> proofs =
      {{"feed", ProveFeed},       {"asof", ProveAsOf},       {"kill", ProveKill},
       {"replica", ProveReplica}, {"restore", ProveRestore}, {"slow-reader", ProveSlowReader},
       {"once", ProveOnce}};
  std::string proof, server;
  Sizes sizes;
  CLI::App app("Checks the guarantees of a Hypermap server under load against a model in memory.",
               "hypermap_prove");
  app.add_option("proof", proof,
                 "Proof to run: feed, asof, kill, replica, restore, slow-reader or once")
      ->required()
      ->check(CLI::IsMember(proofs));
  app.add_option("--server", server, "Path of hypermapd")->required()->check(CLI::ExistingFile);
  app.add_option("--seed", sizes.seed, "Random seed")->capture_default_str();
  app.add_option("--writers", sizes.writers, "Number of clients that edit")->capture_default_str();
  app.add_option("--edits", sizes.edits, "Number of edits of each writer")->capture_default_str();
  app.add_option("--watchers", sizes.watchers, "Number of watches")->capture_default_str();
  app.add_option("--queries", sizes.queries, "Number of queries")->capture_default_str();
  app.add_option("--kills", sizes.kills, "Number of times that the server is killed")
      ->capture_default_str();
  app.add_option("--history", sizes.history,
                 "History of the server in revisions, so that it compacts during the proof; 0 for "
                 "its default")
      ->capture_default_str();
  app.add_option("--pairs", sizes.pairs,
                 "Number of pairs of runs, one without and one with a slow reader")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--seconds", sizes.seconds, "Length of a run in seconds")->capture_default_str();
  app.add_option("--outage", sizes.outage, "Time without a server in seconds")
      ->capture_default_str();
  app.add_option("--queued", sizes.queued,
                 "Number of edits and observations that are queued during the outage")
      ->check(CLI::Range(12, 100'000))
      ->capture_default_str();
  app.add_flag(
      "!--tell_speed", sizes.judge_speed,
      "Report the measured speed without judging it, because other programs use the machine");
  CLI11_PARSE(app, argc, argv);

  std::vector<std::string> flags;
  if (sizes.history > 0) flags.push_back("--history_revisions=" + std::to_string(sizes.history));
  Site site(server, flags);
  const absl::StatusOr<Verdict> verdict = proofs.at(proof)(site, sizes);
  if (!verdict.ok()) {
    std::cerr << "hypermap_prove: " << verdict.status() << '\n';
    std::cout << Verdict{{"proof", proof}, {"error", verdict.status().ToString()}, {"holds", false}}
              << std::endl;
    return 1;
  }
  std::cout << *verdict << std::endl;
  return verdict->at("holds").get<bool>() ? 0 : 1;
}

}  // namespace
}  // namespace hypermap::prove

int main(int argc, char** argv) {
  try {
    return hypermap::prove::Main(argc, argv);
  } catch (const std::exception& error) {  // of CLI11 and the JSON library
    std::cerr << "hypermap_prove: " << error.what() << '\n';
    return 1;
  }
}
