// The lines of an import's report about its repairs.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_REPAIR_LOG_H_
#define HYPERMAP_STORAGE_INTERCHANGE_REPAIR_LOG_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "storage/interchange/names.h"

namespace hypermap::storage {

// Keeps the beginnings of the first kMaxLines lines and counts the others, so that a faulty file
// can't make a report larger than itself.
class RepairLog {
 public:
  static constexpr size_t kMaxLines = 1000;
  // Bytes of a line; a longer one is cut.
  static constexpr size_t kMaxLineBytes = 300;

  // Adds a line that `describe` returns, which is called only if the line is kept.
  void Add(absl::FunctionRef<std::string()> describe) {
    if (lines_.size() < kMaxLines) {
      lines_.push_back(CutText(describe(), kMaxLineBytes));
    } else {
      ++num_dropped_;
    }
  }
  void Add(absl::string_view line) {
    Add([line] { return std::string(line); });
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
