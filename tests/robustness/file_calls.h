// The system calls by which a process works with files.
#ifndef HYPERMAP_TESTS_ROBUSTNESS_FILE_CALLS_H_
#define HYPERMAP_TESTS_ROBUSTNESS_FILE_CALLS_H_

#include <linux/filter.h>

#include <cstdint>
#include <string>
#include <vector>

#include "absl/types/span.h"

namespace hypermap::robustness {

enum class FileCall {
  kOpen,
  kRead,
  kWrite,
  kTruncate,
  kAllocate,  // space for a file
  kSync,
  kCopy,  // from one file to another within the kernel
  kRename,
  kLink,
  kRemove,
  kMakeFolder,
  kList,  // the names in a folder
  kStat,
  kLock,
  kMap,  // into memory
};
inline constexpr int kNumFileCalls = 15;

std::string NameOf(FileCall call);

// Where a system call names its file. Indexes of arguments; -1: it has none.
struct CallSpec {
  int64_t number;
  FileCall call;
  int fd = -1;            // of the file, or of the folder that `path` is relative to
  int path = -1;          // the address of a name
  int other_folder = -1;  // a second name, of renamings and links
  int other_path = -1;
};

// All calls that are seen. Closing is not: it fails for nobody who waits for the disk.
absl::Span<const CallSpec> SeenCalls();
// Null if the call is not seen.
const CallSpec* FindCall(int64_t number);

// Errors that a call may meet on a disk that fails, is full or read-only, or in a process without
// free descriptors.
std::vector<int> ErrorsOf(FileCall call);
// Such as "EIO".
std::string ErrorName(int error);
// Whether a call changes what is on the disk; `for_writing`: of kOpen, whether it may write.
bool ChangesDisk(FileCall call, bool for_writing);
// Whether a call may take space on the disk.
bool TakesSpace(FileCall call, bool for_writing);

// A program for seccomp that hands the seen calls to a supervisor, and lets all others pass.
std::vector<sock_filter> MakeFilter();

}  // namespace hypermap::robustness

#endif  // HYPERMAP_TESTS_ROBUSTNESS_FILE_CALLS_H_
