#include "tests/bench/server/report.h"

#include <sys/utsname.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace hypermap::bench {
namespace {

std::string Number(const std::optional<double>& value, const std::string& unit) {
  return value ? absl::StrFormat("%.4g %s", *value, unit) : "-";
}

void Print(const Row& row) {
  const std::string ratio = row.ratio ? absl::StrFormat("%.3g", *row.ratio) : "-";
  const char* const holds = row.target.kind == Target::Kind::kNone ? ""
                            : row.holds()                          ? "holds"
                                                                   : "MISSED";
  absl::PrintF("%-46s %18s %18s %9s  %-9s %-7s %s\n", row.name, Number(row.ours, row.unit),
               Number(row.floor, row.unit), ratio, row.target.Text(), holds, row.note);
  std::fflush(stdout);
}

template <typename T>
nlohmann::json OrNull(const std::optional<T>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json();
}

std::string CpuName() {
  std::ifstream cpuinfo("/proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown CPU";
}

}  // namespace

Target AtMost(double bound) { return {Target::Kind::kAtMost, bound}; }
Target AtLeast(double bound) { return {Target::Kind::kAtLeast, bound}; }

std::string Target::Text() const {
  switch (kind) {
    case Kind::kAtMost:
      return absl::StrFormat("<= %g", bound);
    case Kind::kAtLeast:
      return absl::StrFormat(">= %g", bound);
    case Kind::kNone:
      break;
  }
  return "none";
}

bool Target::IsMetBy(double ratio) const {
  switch (kind) {
    case Kind::kAtMost:
      return ratio <= bound;
    case Kind::kAtLeast:
      return ratio >= bound;
    case Kind::kNone:
      break;
  }
  return true;
}

void Report::Add(Row row) {
  Print(row);
  rows_.push_back(std::move(row));
}

void Report::AddMissing(const std::string& name, const Target& target, const std::string& why) {
  Row row;
  row.name = name;
  row.target = target;
  row.note = why;
  Add(std::move(row));
}

void Report::PrintTable() const {
  absl::PrintF("\n%s\n%-46s %18s %18s %9s  %-9s\n", MachineDescription(), "what", "ours",
               "floor or peer", "ratio", "goal");
  for (const Row& row : rows_) Print(row);
}

absl::Status Report::WriteJson(const std::string& path) const {
  nlohmann::json list = nlohmann::json::array();
  for (const Row& row : rows_) {
    nlohmann::json json{{"name", row.name},           {"ours", OrNull(row.ours)},
                        {"floor", OrNull(row.floor)}, {"unit", row.unit},
                        {"ratio", OrNull(row.ratio)}, {"goal", row.target.Text()},
                        {"holds", row.holds()}};
    if (!row.note.empty()) json["note"] = row.note;
    list.push_back(std::move(json));
  }
  std::error_code ignored;
  std::filesystem::create_directories(std::filesystem::path(path).parent_path(), ignored);
  std::ofstream file(path);
  file << list.dump(2) << "\n";
  return file.flush() ? absl::OkStatus()
                      : absl::UnavailableError(absl::StrCat("cannot write ", path));
}

std::string MachineDescription() {
  utsname system{};
  uname(&system);
  return absl::StrCat(CpuName(), ", ", std::thread::hardware_concurrency(), " cores, ",
                      system.sysname, " ", system.release, ", ", __VERSION__);
}

}  // namespace hypermap::bench
