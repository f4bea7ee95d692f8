// hypermap_prove PROOF: loads a real server and checks its answers against a model in memory. The
// last line is one JSON object with the counts and "holds". The exit code is 0 if the proof holds.
#include <CLI/CLI.hpp>
#include <functional>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "tests/prove/outbox_holder.h"
#include "tests/prove/proofs.h"

int main(int argc, char** argv) {
  using namespace hypermap::prove;
  if (const std::optional<int> code = HoldOutbox(argc, argv)) return *code;
  const std::map<std::string, std::function<absl::StatusOr<Verdict>(Site&, const Sizes&)>> proofs =
      {{"feed", ProveFeed},
       {"asof", ProveAsOf},
       {"kill", ProveKill},
       {"replica", ProveReplica},
       {"slow-reader", ProveSlowReader},
       {"once", ProveOnce}};
  std::string proof, server;
  Sizes sizes;
  CLI::App app("Proves what a Hypermap server promises of its revisions.", "hypermap_prove");
  app.add_option("proof", proof, "feed, asof, kill, replica, slow-reader or once")
      ->required()
      ->check(CLI::IsMember(proofs));
  app.add_option("--server", server, "The program hypermapd")->required()->check(CLI::ExistingFile);
  app.add_option("--seed", sizes.seed, "Of all that is random")->capture_default_str();
  app.add_option("--writers", sizes.writers)->capture_default_str();
  app.add_option("--edits", sizes.edits, "Of each writer")->capture_default_str();
  app.add_option("--watchers", sizes.watchers)->capture_default_str();
  app.add_option("--queries", sizes.queries)->capture_default_str();
  app.add_option("--kills", sizes.kills)->capture_default_str();
  app.add_option("--history", sizes.history,
                 "Revisions that the server keeps, so that it compacts meanwhile (0: its default)")
      ->capture_default_str();
  app.add_option("--pairs", sizes.pairs, "Of runs without and with a slow reader")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--seconds", sizes.seconds, "Of one run of a pair")->capture_default_str();
  app.add_option("--outage", sizes.outage, "Seconds for which the server is away")
      ->capture_default_str();
  app.add_option("--queued", sizes.queued, "Edits and observations that are put meanwhile")
      ->check(CLI::Range(12, 100'000))
      ->capture_default_str();
  app.add_flag("!--tell_speed", sizes.judge_speed,
               "Speed is told and not judged: other programs run beside this");
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
