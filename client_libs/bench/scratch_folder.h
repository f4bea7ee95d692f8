// Temporary files of a load.
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_SCRATCH_FOLDER_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_SCRATCH_FOLDER_H_

#include <string>

#include "absl/status/statusor.h"

namespace hypermap::bench {

// A new folder, which is removed with its content by the destructor. A process that is killed
// leaves it behind.
class ScratchFolder {
 public:
  // Makes hypermap-bench-XXXXXX below `parent`. Empty `parent`: makes none.
  static absl::StatusOr<ScratchFolder> Make(const std::string& parent);
  ~ScratchFolder();
  ScratchFolder(ScratchFolder&& other) noexcept;
  ScratchFolder& operator=(ScratchFolder&&) = delete;

  // A folder for a replica; empty if nothing is stored.
  std::string OfReplica(int number) const;

 private:
  explicit ScratchFolder(std::string path);

  std::string path_;
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_SCRATCH_FOLDER_H_
