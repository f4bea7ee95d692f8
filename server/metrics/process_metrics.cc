#include "server/metrics/process_metrics.h"

#include <sys/resource.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <system_error>

#include "server/metrics/families.h"

namespace hypermap::server {
namespace {

using prometheus::MetricFamily;
using prometheus::MetricType;

double Seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

// Fields of /proc/self/stat by their numbers in proc(5).
struct ProcessStat {
  int64_t num_threads = 0;     // 20
  int64_t start_ticks = 0;     // 22, since boot
  int64_t resident_pages = 0;  // 24
};

ProcessStat ReadStat() {
  std::ifstream file("/proc/self/stat");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  // The name of the program, in parentheses, may contain blanks.
  const size_t end_of_name = text.rfind(')');
  if (end_of_name == std::string::npos) return {};
  std::istringstream rest(text.substr(end_of_name + 1));
  ProcessStat stat;
  std::string field;
  for (int number = 3; rest >> field; ++number) {
    if (number == 20) stat.num_threads = std::stoll(field);
    if (number == 22) stat.start_ticks = std::stoll(field);
    if (number == 24) stat.resident_pages = std::stoll(field);
  }
  return stat;
}

// Seconds since 1970 at which the machine was booted; 0 if unknown.
double BootTime() {
  std::ifstream file("/proc/stat");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("btime ", 0) == 0) return std::stod(line.substr(6));
  }
  return 0.0;
}

int64_t NumOpenFiles() {
  std::error_code error;
  const std::filesystem::directory_iterator files("/proc/self/fd", error);
  return error ? 0 : std::distance(begin(files), end(files));
}

}  // namespace

void AddProcess(std::vector<MetricFamily>& out) {
  const auto add = [&](const char* name, const char* help, MetricType type, double value) {
    out.push_back(std::move(Family(name, help, type).Add({}, value)));
  };
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  add("process_cpu_seconds_total", "Time of processors that was used, in seconds.",
      MetricType::Counter, Seconds(usage.ru_utime) + Seconds(usage.ru_stime));
  const ProcessStat stat = ReadStat();
  add("process_resident_memory_bytes", "Resident memory.", MetricType::Gauge,
      static_cast<double>(stat.resident_pages * sysconf(_SC_PAGESIZE)));
  add("process_threads", "Threads.", MetricType::Gauge, static_cast<double>(stat.num_threads));
  add("process_open_fds", "Open files.", MetricType::Gauge, static_cast<double>(NumOpenFiles()));
  rlimit files{};
  getrlimit(RLIMIT_NOFILE, &files);
  add("process_max_fds", "Limit of open files.", MetricType::Gauge,
      static_cast<double>(files.rlim_cur));
  add("process_start_time_seconds", "Start of the process, in seconds since 1970.",
      MetricType::Gauge,
      BootTime() +
          static_cast<double>(stat.start_ticks) / static_cast<double>(sysconf(_SC_CLK_TCK)));
}

}  // namespace hypermap::server
