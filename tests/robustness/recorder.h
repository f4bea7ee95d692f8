// Records the changes that a supervised process makes to the files of a folder.
#ifndef HYPERMAP_TESTS_ROBUSTNESS_RECORDER_H_
#define HYPERMAP_TESTS_ROBUSTNESS_RECORDER_H_

#include <deque>
#include <map>
#include <string>

#include "storage/geopackage/testing/simulated_disk.h"
#include "tests/robustness/supervisor.h"

namespace hypermap::robustness {

// Turns calls, before they are carried out, into events for a SimulatedDisk. Writes by memory
// mapping are not seen: SQLite maps only the index of a write-ahead log, which it makes anew after
// a crash.
class Recorder {
 public:
  // Records the files that the folder has.
  explicit Recorder(std::string folder);

  void Add(const SeenCall& call, const Answer& answer);
  void AddNote(int64_t number);

  // Grows only; references stay valid.
  const std::deque<storage::FileEvent>& events() const { return events_; }

 private:
  using Kind = storage::FileEvent::Kind;

  void AddOpen(const SeenCall& call);
  void AddWrite(const SeenCall& call, bool half);
  void AddCopy(const SeenCall& call);
  void AddResize(const SeenCall& call);
  void AddSync(const SeenCall& call, const Answer& answer);
  void AddMove(const SeenCall& call);
  void AddExchange(const SeenCall& call);
  void AddRemoval(const SeenCall& call);

  storage::FileEvent& Append(Kind kind, int file, const std::string& name);
  // -1 for a folder, or a file that has no name any more.
  int FileOf(const std::string& name) const;

  const std::string folder_;
  std::map<std::string, int> names_;  // -1 for folders
  int num_files_ = 0;
  std::deque<storage::FileEvent> events_;
};

// Files by their paths in a folder; names of folders end with a slash.
using FileTree = std::map<std::string, std::string>;

FileTree ReadTree(const std::string& folder);
// Long files with the same content become names of one file, because such are made by links only.
void WriteTree(const FileTree& files, const std::string& folder);

}  // namespace hypermap::robustness

#endif  // HYPERMAP_TESTS_ROBUSTNESS_RECORDER_H_
