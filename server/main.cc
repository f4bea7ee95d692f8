// hypermapd: serves the maps of a folder over gRPC.
#include <grpc/support/log.h>
#include <grpcpp/security/credentials.h>
#include <malloc.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/flags/flag.h"
#include "absl/flags/parse.h"
#include "absl/flags/usage.h"
#include "absl/flags/usage_config.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "base/admission/file_limit.h"
#include "base/admission/listening_socket.h"
#include "base/admission/memory.h"
#include "base/admission/thread_limit.h"
#include "base/limits/limits.h"
#include "base/logging/log.h"
#include "base/status/status_macros.h"
#include "base/tls/channel_credentials.h"
#include "base/tls/server_credentials.h"
#include "server/auth/access_control.h"
#include "server/backup_schedule.h"
#include "server/capacity.h"
#include "server/config_file.h"
#include "server/forward/forwarder.h"
#include "server/limit_flags.h"
#include "server/map_storage.h"
#include "server/metrics/metrics_listener.h"
#include "server/metrics/server_metrics.h"
#include "server/rpc/budgets.h"
#include "server/rpc/facilities.h"
#include "server/rpc/scratch_file.h"
#include "server/rpc/worker_pools.h"
#include "server/service_manager.h"
#include "server/services/evidence_codec.h"
#include "server/services/grpc_server.h"
#include "server/session/comparison_schedule.h"
#include "server/session/history_pool.h"
#include "server/session/site.h"
#include "storage/decorators/metered_store.h"
#include "storage/map_store.h"

ABSL_FLAG(std::string, config, "",
          "File of flags (YAML, their names without dashes); the command line wins over it");
ABSL_FLAG(bool, check_config, false, "Check the flags and the files that they name, and end");
ABSL_FLAG(std::string, data_dir, "", "Folder of the maps, one GeoPackage each; created if missing");
ABSL_FLAG(
    std::string, store, "",
    "Database of the maps, postgresql://USER@HOST/DATABASE; empty: GeoPackages in --data_dir");
ABSL_FLAG(
    std::string, store_readers, "",
    "The database of --store for connections that only read, perhaps through a pooler such as "
    "pgbouncer in transaction mode; empty: that of --store");
ABSL_FLAG(std::string, server_id, "",
          "Name of this server among those that share --store; empty: a random one");
ABSL_FLAG(
    std::string, advertise, "",
    "Address at which the servers that share --store reach this one, HOST:PORT; empty: the one "
    "that it listens on");
ABSL_FLAG(std::string, listen, "127.0.0.1:50051",
          "Address to listen on, HOST:PORT; port 0 takes a free port");
ABSL_FLAG(std::string, tls_cert, "", "The server's certificate chain (PEM); empty: no TLS");
ABSL_FLAG(std::string, tls_key, "", "Private key of --tls_cert (PEM, not encrypted)");
ABSL_FLAG(
    std::string, tls_client_ca, "",
    "Certificate authorities of client certificates (PEM); empty: clients are not asked for one");
ABSL_FLAG(
    std::string, tls_client_certificates, "required",
    "Whether clients must have a certificate if --tls_client_ca is set: required or optional");
ABSL_FLAG(
    std::string, peer_ca, "",
    "Certificate authorities of the other servers that share --store (PEM); empty: those that "
    "the system trusts");
ABSL_FLAG(
    std::vector<std::string>, peer_certificates, {},
    "Names in certificates of the other servers, which may then pass on calls of clients that "
    "they know by certificates");
ABSL_FLAG(std::string, access_file, "",
          "Who may do what (YAML, see `hypermap token`); empty: everybody everything");
ABSL_FLAG(std::string, metrics_listen, "",
          "Address of /metrics for Prometheus, /livez and /readyz, HOST:PORT; empty: none");
ABSL_FLAG(bool, insecure, false,
          "Listen on other addresses than loopback even without TLS or --access_file");
ABSL_FLAG(std::string, log_level, "info", "trace, debug, info, warn, error or off");
ABSL_FLAG(std::string, log_format, "text", "text, or json: an object on each line");
ABSL_FLAG(absl::Duration, grace, absl::Seconds(10),
          "Time for requests in flight to finish after SIGTERM or SIGINT");
ABSL_FLAG(absl::Duration, trash_age, absl::Hours(7 * 24),
          "How long deleted maps stay in DATA_DIR/trash, unless the disk gets full; 0: not at all");
ABSL_FLAG(
    std::string, backup_folder, "",
    "Folder in which the server keeps backups of all maps that it makes by itself; empty: none");
ABSL_FLAG(
    absl::Duration, compare_every, absl::Hours(1),
    "With --store: time between two comparisons of what this server shows of the maps with what "
    "is stored; 0: none");
ABSL_FLAG(absl::Duration, backup_every, absl::Hours(24), "Time between two backups of a map");
ABSL_FLAG(int, backup_keep, 7,
          "Number of verified backups of a map that are kept; older ones are removed");
ABSL_FLAG(int, threads, 0, "Threads for each class of short work; 0: one per core, at least two");

namespace hypermap::server {
namespace {

// Free memory that the allocator keeps at the end of a heap.
constexpr int kKeptBytes = 16 << 20;

// INVALID_ARGUMENT if others than programs of this machine could do what they like.
absl::Status CheckExposure() {
  const std::string listen = absl::GetFlag(FLAGS_listen);
  HYPERMAP_ASSIGN_OR_RETURN(const bool is_loopback, admission::IsLoopback(listen));
  if (absl::GetFlag(FLAGS_insecure) || is_loopback) return absl::OkStatus();
  const auto missing = [&](absl::string_view flags) {
    return absl::InvalidArgumentError(absl::StrCat("--listen=", listen,
                                                   " can be reached from other machines: set ",
                                                   flags, ", or --insecure"));
  };
  if (absl::GetFlag(FLAGS_tls_cert).empty()) return missing("--tls_cert and --tls_key");
  if (absl::GetFlag(FLAGS_access_file).empty()) return missing("--access_file");
  return absl::OkStatus();
}

absl::Status CheckFlags(const std::vector<char*>& positional) {
  if (positional.size() > 1) {
    return absl::InvalidArgumentError(absl::StrCat("unexpected argument ", positional[1]));
  }
  if (absl::GetFlag(FLAGS_data_dir).empty()) {
    return absl::InvalidArgumentError("--data_dir is missing");
  }
  HYPERMAP_RETURN_IF_ERROR(CheckStore(absl::GetFlag(FLAGS_store)));
  if (!absl::GetFlag(FLAGS_store_readers).empty() && absl::GetFlag(FLAGS_store).empty()) {
    return absl::InvalidArgumentError("--store_readers needs --store");
  }
  HYPERMAP_RETURN_IF_ERROR(tls::CheckAuthorities("--peer_ca", absl::GetFlag(FLAGS_peer_ca)));
  if (!absl::GetFlag(FLAGS_peer_certificates).empty() &&
      absl::GetFlag(FLAGS_tls_client_ca).empty()) {
    return absl::InvalidArgumentError("--peer_certificates needs --tls_client_ca");
  }
  const std::string certificates = absl::GetFlag(FLAGS_tls_client_certificates);
  if (certificates != "required" && certificates != "optional") {
    return absl::InvalidArgumentError(absl::StrCat("--tls_client_certificates=", certificates,
                                                   " is neither required nor optional"));
  }
  if (absl::GetFlag(FLAGS_trash_age) < absl::ZeroDuration()) {
    return absl::InvalidArgumentError("--trash_age is negative");
  }
  if (absl::GetFlag(FLAGS_backup_every) < absl::Seconds(1)) {
    return absl::InvalidArgumentError("--backup_every must be at least 1s");
  }
  const absl::Duration compare_every = absl::GetFlag(FLAGS_compare_every);
  if (compare_every != absl::ZeroDuration() && compare_every < absl::Seconds(1)) {
    return absl::InvalidArgumentError("--compare_every must be 0 or at least 1s");
  }
  if (absl::GetFlag(FLAGS_backup_keep) < 1) {
    return absl::InvalidArgumentError("--backup_keep must be positive");
  }
  HYPERMAP_RETURN_IF_ERROR(CheckExposure());
  return CheckLimitFlags();
}

// Passes gRPC's log lines to the server's log.
void LogOfGrpc(gpr_log_func_args* line) {
  logging::Log(logging::Level::kDebug, "grpc", {{"text", line->message}}, line->file, line->line);
}

absl::Status StartLog() {
  const std::string level = absl::GetFlag(FLAGS_log_level);
  const std::optional<logging::Level> least = logging::ParseLevel(level);
  if (!least) {
    return absl::InvalidArgumentError(absl::StrCat("--log_level=", level, " is not known"));
  }
  const std::string format = absl::GetFlag(FLAGS_log_format);
  const std::optional<logging::Format> parsed = logging::ParseFormat(format);
  if (!parsed) {
    return absl::InvalidArgumentError(
        absl::StrCat("--log_format=", format, " is neither text nor json"));
  }
  logging::Start(*least, *parsed);
  gpr_set_log_function(LogOfGrpc);
  return absl::OkStatus();
}

SessionOptions MakeSessionOptions(const Limits& limits, const Budgets& budgets, Answers* answers) {
  SessionOptions options;
  options.answers = answers;
  options.content = budgets.content;
  options.feed.of_all = budgets.feeds;
  options.limits = limits;
  options.fusion.codec = WireEvidenceCodec();
  options.fusion.max_lateness = limits.max_lateness;
  options.fusion.observation_age = limits.observation_age;
  return options;
}

tls::ServerFiles ServerFilesOfFlags() {
  return {absl::GetFlag(FLAGS_tls_cert), absl::GetFlag(FLAGS_tls_key),
          absl::GetFlag(FLAGS_tls_client_ca),
          absl::GetFlag(FLAGS_tls_client_certificates) == "required"};
}

int NumThreads() {
  const int threads = absl::GetFlag(FLAGS_threads);
  if (threads > 0) return threads;
  return std::max(2, static_cast<int>(std::thread::hardware_concurrency()));
}

void LogCapacity(const Capacity& capacity, int64_t file_limit) {
  logging::Log(logging::Level::kInfo, "capacity",
               {{"max_maps", capacity.max_maps},
                {"max_connections", capacity.connections.max_connections},
                {"open_files", file_limit}});
}

void LogProblems(const Site& site, const Capacity& capacity) {
  const std::vector<Site::Entry> maps = site.List();
  if (maps.size() > static_cast<size_t>(capacity.max_maps)) {
    logging::Log(logging::Level::kError,
                 "not all maps are open, because there are more than --max_maps",
                 {{"maps", maps.size()}, {"max_maps", capacity.max_maps}});
  }
  for (const Site::Entry& entry : maps) {
    if (entry.problem.ok()) continue;
    logging::Log(logging::Level::kWarning, "map can't be opened",
                 {{"map", entry.name}, {"problem", entry.problem.ToString()}});
  }
}

// Blocks SIGINT and SIGTERM in this thread and in all that it starts, so that only Wait gets them.
class ShutdownSignals {
 public:
  ShutdownSignals() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  }

  // Waits for a signal, and unblocks them: a second one ends the program at once.
  int Wait() {
    int signal = 0;
    sigwait(&signals_, &signal);
    pthread_sigmask(SIG_UNBLOCK, &signals_, nullptr);
    return signal;
  }

 private:
  sigset_t signals_;
};

// The part of the limit of memory that readers of past revisions may use to keep what they have
// read.
constexpr int64_t kCacheShare = 32;

Resources ResourcesOfProcess() {
  return {admission::RaiseFileLimit(), admission::ThreadLimit(),       NumThreads(),
          admission::UsableMemory(),   admission::AddressSpaceLimit(), admission::StackBytes()};
}

// Sets the memory limit, and derives the other limits from it that the flags leave to it. Imports
// get a sixteenth, because two are decoded at a time, each with up to three times the bytes of its
// files. docs/limits.md adds up the parts.
Limits BoundByMemory(Limits limits, int64_t memory_limit) {
  limits.memory_limit = memory_limit;
  const int64_t part = std::max<int64_t>(2, limits.memory_limit / 8);
  limits.max_import_bytes = std::min(limits.max_import_bytes, part / 2);
  limits.max_unpacked_bytes = std::min(limits.max_unpacked_bytes, part / 2);
  if (limits.max_request_bytes == 0) limits.max_request_bytes = part;
  if (limits.max_exploration_bytes == 0) limits.max_exploration_bytes = part;
  if (limits.max_content_bytes == 0) limits.max_content_bytes = 4 * part;
  return limits;
}

absl::StatusOr<std::unique_ptr<AccessControl>> OpenAccess(ServerClock* clock) {
  const std::string path = absl::GetFlag(FLAGS_access_file);
  if (path.empty()) return std::make_unique<AccessControl>();
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<AccessControl> access,
                            AccessControl::OfFile(path, kExpiryAuthor, clock));
  access->TrustPeers(absl::GetFlag(FLAGS_peer_certificates));
  return access;
}

// Null if no other server shares the maps.
std::unique_ptr<Forwarder> MakeForwarder(const Limits& limits) {
  if (absl::GetFlag(FLAGS_store).empty()) return nullptr;
  const tls::ServerFiles own = ServerFilesOfFlags();
  return std::make_unique<Forwarder>(
      own.certificate.empty()
          ? grpc::InsecureChannelCredentials()
          : tls::MakeChannelCredentials({absl::GetFlag(FLAGS_peer_ca), own.certificate, own.key}),
      limits.max_message_bytes);
}

// Serves until a signal arrives.
absl::Status Serve(ShutdownSignals& signals) {
  const std::string data_dir = absl::GetFlag(FLAGS_data_dir);
  const Resources resources = ResourcesOfProcess();
  const Limits asked = LimitsOfFlags();
  HYPERMAP_ASSIGN_OR_RETURN(const int64_t memory_limit, MemoryLimit(asked.memory_limit, resources));
  if (const int arenas = MostArenas(resources); arenas > 0) mallopt(M_ARENA_MAX, arenas);
  Limits limits = BoundByMemory(asked, memory_limit);
  HYPERMAP_ASSIGN_OR_RETURN(
      OpenedStorage storage,
      OpenStorage({data_dir, absl::GetFlag(FLAGS_store), absl::GetFlag(FLAGS_store_readers),
                   absl::GetFlag(FLAGS_server_id), absl::GetFlag(FLAGS_trash_age),
                   limits.memory_limit / kCacheShare}));
  for (const std::string& note : storage.store->notes()) {
    logging::Log(logging::Level::kWarning, "what the store promises is limited", {{"note", note}});
  }
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<std::string> maps, storage.store->List());
  HYPERMAP_ASSIGN_OR_RETURN(const Capacity capacity,
                            DivideResources(limits, resources, static_cast<int64_t>(maps.size())));
  limits.max_maps = capacity.max_maps;
  HistoryPool::LimitExtraReaders(capacity.max_extra_readers);
  ScratchFile::RemoveLeftOver(data_dir);
  // Calls that wait for a map's writer hold parts of the budgets, so that these outlive the maps.
  Budgets budgets(limits);
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<Answers> answers, Answers::Start());
  storage::StoreMeters store_meters;
  HYPERMAP_ASSIGN_OR_RETURN(
      std::unique_ptr<Site> site,
      Site::Open(storage::MakeMeteredStore(std::move(storage.store), &store_meters),
                 MakeSessionOptions(limits, budgets, answers.get())));
  // Returns the memory that loading the maps needed for a while to the system.
  admission::ReturnFreedMemory();
  // From here on the allocator keeps freed memory: returning it and requesting it again would cost
  // a page fault in every few requests. Both thresholds are set, because setting only one disables
  // the dynamic adjustment of the other and leaves it at its low default (mallopt(3)).
  mallopt(M_TRIM_THRESHOLD, kKeptBytes);
  mallopt(M_MMAP_THRESHOLD, kKeptBytes);

  // Destroyed in the reverse order: first the server with its requests, then the workers, then the
  // maps.
  WorkerPools workers(NumThreads());
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<AccessControl> access,
                            OpenAccess(&site->clock()));
  RpcMeters meters;
  TimerQueue timers;
  const std::unique_ptr<Forwarder> forwarder = MakeForwarder(limits);
  const Facilities facilities{site.get(),   limits,  &workers, data_dir,       &budgets,
                              access.get(), &meters, &timers,  forwarder.get()};
  GrpcServerOptions options{absl::GetFlag(FLAGS_listen), limits.max_message_bytes,
                            ServerFilesOfFlags(), capacity.connections};
  options.max_resident_bytes = limits.memory_limit;
  options.max_calls_per_connection = limits.max_calls_per_connection;
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<GrpcServer> server,
                            GrpcServer::Start(options, facilities));
  const std::string advertised = absl::GetFlag(FLAGS_advertise);
  site->Advertise(advertised.empty() ? server->address() : advertised);
  std::unique_ptr<BackupSchedule> backups;
  if (const std::string folder = absl::GetFlag(FLAGS_backup_folder); !folder.empty()) {
    HYPERMAP_ASSIGN_OR_RETURN(
        backups, BackupSchedule::Start(site.get(), {folder, absl::GetFlag(FLAGS_backup_every),
                                                    absl::GetFlag(FLAGS_backup_keep)}));
  }
  std::unique_ptr<ComparisonSchedule> comparisons;
  const absl::Duration compare_every = absl::GetFlag(FLAGS_compare_every);
  if (!site->server_id().empty() && compare_every > absl::ZeroDuration()) {
    HYPERMAP_ASSIGN_OR_RETURN(comparisons, ComparisonSchedule::Start(site.get(), compare_every));
  }
  // Destroyed before what it reads.
  std::unique_ptr<MetricsListener> metrics;
  if (const std::string address = absl::GetFlag(FLAGS_metrics_listen); !address.empty()) {
    HYPERMAP_ASSIGN_OR_RETURN(
        metrics,
        MetricsListener::Start(
            address,
            std::make_unique<ServerMetrics>(
                facilities, ServerMetrics::Optional{backups ? &backups->meters() : nullptr,
                                                    comparisons ? &comparisons->meters() : nullptr,
                                                    &store_meters}),
            [site = site.get()] { return NotesAboutMaps(*site); }));
    logging::Log(logging::Level::kInfo, "metrics are served", {{"address", metrics->address()}});
  }
  LogCapacity(capacity, resources.files);
  LogProblems(*site, capacity);
  std::printf("hypermapd ready on %s\n", server->address().c_str());
  std::fflush(stdout);
  NotifyServiceManager("READY=1");

  const int signal = signals.Wait();
  logging::Log(logging::Level::kInfo, "shutting down", {{"signal", signal}});
  NotifyServiceManager("STOPPING=1");
  if (metrics) metrics->SetStopping();
  server->Shutdown(absl::GetFlag(FLAGS_grace));
  return absl::OkStatus();
}

int Fail(const absl::Status& status) {
  std::fprintf(stderr, "hypermapd: %s\n", std::string(status.message()).c_str());
  return EXIT_FAILURE;
}

// Checks the files that flags name, without serving.
absl::Status CheckFiles() {
  HYPERMAP_RETURN_IF_ERROR(tls::CheckServerFiles(ServerFilesOfFlags()));
  ServerClock clock;
  return OpenAccess(&clock).status();
}

// Makes --help show the flags of hypermapd only, and --version its version.
void DescribeProgram() {
  absl::SetProgramUsageMessage(
      "Serves the maps of a folder.\n\n  hypermapd --data_dir=DIR [--listen=HOST:PORT]");
  absl::FlagsUsageConfig usage;
  const auto is_own = [](absl::string_view file) { return absl::StrContains(file, "server/"); };
  usage.contains_help_flags = is_own;
  usage.contains_helpshort_flags = is_own;
  usage.contains_helppackage_flags = is_own;
  usage.version_string = [] { return "hypermapd " HYPERMAP_VERSION "\n"; };
  absl::SetFlagsUsageConfig(usage);
}

int Main(int argc, char** argv) {
  DescribeProgram();
  if (const std::string config = ConfigOnCommandLine({argv + 1, argv + argc}); !config.empty()) {
    if (const absl::Status status = ReadConfigFile(config); !status.ok()) return Fail(status);
  }
  const std::vector<char*> positional = absl::ParseCommandLine(argc, argv);
  // The server must not end when a reader of its output goes away.
  std::signal(SIGPIPE, SIG_IGN);
  // Abseil, as some distributions build it, searches for deadlocks at every lock, also at gRPC's.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  absl::Status status = CheckFlags(positional);
  if (status.ok()) status = StartLog();
  if (status.ok() && absl::GetFlag(FLAGS_check_config)) {
    status = CheckFiles();
    if (!status.ok()) return Fail(status);
    std::puts("hypermapd: the configuration is valid");
    return EXIT_SUCCESS;
  }
  if (status.ok()) {
    ShutdownSignals signals;
    status = Serve(signals);
  }
  return status.ok() ? EXIT_SUCCESS : Fail(status);
}

}  // namespace
}  // namespace hypermap::server

int main(int argc, char** argv) { return hypermap::server::Main(argc, argv); }
