// The lines of an import's report about its repairs.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_REPAIR_LOG_H_
#define HYPERMAP_STORAGE_INTERCHANGE_REPAIR_LOG_H_

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

namespace hypermap::storage {

// Keeps the first kMaxLines lines and counts the others, so that a faulty file can't make a report
// larger than itself.
class RepairLog {
 public:
  static constexpr size_t kMaxLines = 1000;

  void Add(std::string line) {
    if (lines_.size() < kMaxLines) {
      lines_.push_back(std::move(line));
    } else {
      ++num_dropped_;
    }
  }

  std::vector<std::string> Take() && {
    if (num_dropped_ > 0) lines_.push_back(absl::StrCat("and ", num_dropped_, " repairs more"));
    return std::move(lines_);
  }

 private:
  std::vector<std::string> lines_;
  int64_t num_dropped_ = 0;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_REPAIR_LOG_H_
