#include "tests/prove/site.h"

#include <stdlib.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"

namespace hypermap::prove {
namespace {

absl::Status FirstError(const std::vector<absl::Status>& statuses) {
  for (const absl::Status& status : statuses) {
    HYPERMAP_RETURN_IF_ERROR(status);
  }
  return absl::OkStatus();
}

void JoinAll(std::vector<std::thread>& threads) {
  for (std::thread& thread : threads) {
    if (thread.joinable()) thread.join();
  }
}

// Cycles with `i` through everything, an area, classes, and both.
Selection RandomSelection(int i, Rng& rng) {
  Selection selection;
  if (i % 4 == 1 || i % 4 == 3) selection.area = RandomArea(rng, 5.0, 40.0);
  if (i % 4 >= 2) {
    selection.classes.insert(Labels()[rng() % Labels().size()]);
    selection.classes.insert(Labels()[rng() % Labels().size()]);
  }
  return selection;
}

// Every second one, and for each kind of selection both.
bool Coalesces(int i) { return (i + i / 4) % 2 == 0; }

}  // namespace

Site::Site(const std::string& server_binary, const std::vector<std::string>& flags)
    : server_binary_(server_binary), flags_(flags) {
  std::vector<std::string> command = {server_binary, "--data_dir=" + folder_ / "data",
                                      "--log_level=warn", "--watch_progress=200ms"};
  command.insert(command.end(), flags.begin(), flags.end());
  server_ = std::make_unique<testing::ServerProcess>(std::move(command), folder_ / "data.log");
}

Site::~Site() { server_.reset(); }

absl::Status Site::Start() {
  HYPERMAP_RETURN_IF_ERROR(server_->Start());
  client::Client client = NewClient();
  return MakeSite(client, *model_);
}

std::unique_ptr<Site> Site::Elsewhere() const {
  return std::make_unique<Site>(server_binary_, flags_);
}

std::unique_ptr<Model> Site::Exchange(std::unique_ptr<Model> model) {
  return std::exchange(model_, std::move(model));
}

client::Client Site::NewClient() const {
  return client::Client(server_->address(),
                        {.timeout = absl::Seconds(120), .retry_for = absl::Seconds(120)});
}

std::string Site::map_file() const { return folder_ / absl::StrCat("data/", kMap, ".gpkg"); }

WriterGroup::WriterGroup(Site& site, int writers, const WriterLoad& load, uint64_t seed) {
  for (int i = 0; i < writers; ++i) {
    writers_.push_back(
        std::make_unique<Writer>(site.NewClient(), seed * 1000 + i, load, site.model()));
  }
  statuses_.resize(writers);
  running_ = writers;
  for (int i = 0; i < writers; ++i) {
    threads_.emplace_back([this, i] {
      statuses_[i] = writers_[i]->Run(stop_);
      if (!statuses_[i].ok()) failed_ = true;
      --running_;
    });
  }
}

absl::Status WriterGroup::Wait() {
  JoinAll(threads_);
  return FirstError(statuses_);
}

absl::Status WriterGroup::Stop() {
  stop_ = true;
  return Wait();
}

WatcherGroup::WatcherGroup(Site& site, int watchers, uint64_t seed) {
  Rng rng(seed);
  for (int i = 0; i < watchers; ++i) {
    followers_.push_back(
        std::make_unique<Follower>(site.NewClient(), RandomSelection(i, rng), Coalesces(i)));
  }
  statuses_.resize(watchers);
  for (int i = 0; i < watchers; ++i) {
    threads_.emplace_back([this, i] { statuses_[i] = followers_[i]->Run(last_); });
  }
}

WatcherGroup::~WatcherGroup() {
  last_ = 0;
  for (const auto& follower : followers_) follower->Cut();
  JoinAll(threads_);
}

absl::Status WatcherGroup::WaitUntilAll(absl::FunctionRef<bool(const Follower&)> condition) const {
  const absl::Time deadline = absl::Now() + kPatience;
  while (!std::all_of(followers_.begin(), followers_.end(),
                      [&](const auto& follower) { return condition(*follower); })) {
    if (absl::Now() > deadline) return absl::DeadlineExceededError("a watch does not begin");
    absl::SleepFor(absl::Milliseconds(5));
  }
  return absl::OkStatus();
}

absl::Status WatcherGroup::WaitUntilBegun() {
  return WaitUntilAll([](const Follower& follower) { return follower.has_begun(); });
}

absl::Status WatcherGroup::WaitUntilFollowing(uint64_t incarnation) {
  return WaitUntilAll(
      [=](const Follower& follower) { return follower.incarnation() == incarnation; });
}

void WatcherGroup::CutHalf() {
  for (size_t i = 0; i < followers_.size() / 2; ++i) followers_[i]->Cut();
}

absl::Status WatcherGroup::WaitUntil(Revision last) {
  last_ = last;
  JoinAll(threads_);
  return FirstError(statuses_);
}

}  // namespace hypermap::prove
