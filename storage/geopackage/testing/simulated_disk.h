// A disk that loses power, for tests of what is kept of recorded changes of files.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_TESTING_SIMULATED_DISK_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_TESTING_SIMULATED_DISK_H_

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/support/random_map.h"

namespace hypermap::storage {

// A change of the files below a folder, as a program asked for it. Names are paths in that folder.
struct FileEvent {
  enum class Kind {
    kAppear,      // a file that has `bytes` and was there before; a folder, if `file` is -1
    kCreate,      // a new empty file called `name`
    kMakeFolder,  // a new folder called `name`
    kLink,        // the file is called `name`, too
    kRemove,      // the name, of a file or a folder, is removed
    kMove,        // the file or folder `from` is called `name` from now on
    kExchange,    // the file `from` is called `name` from now on, and what was called so, `from`
    kRename,      // as kMove, already durable: the file is called `name`
    kVanish,      // as kRemove, already durable
    kWrite,       // `bytes` at `offset`
    kTruncate,    // to `offset` bytes; a file that grows gets zeros
    kSync,        // of the file
    kSyncFailed,  // of the file: what was not on the disk may never be
    kSyncFolder,  // of the folder `name`, the empty name being that of the folder of all files
    kNote,        // of the recorder, with its number in `offset`
  };
  Kind kind = Kind::kNote;
  int file = -1;  // the same for all names that the file has had
  std::string name;
  int64_t offset = 0;
  std::string bytes;
  std::string witness;  // content of FaultyFiles::witness_name at that moment
  std::string from;     // of kMove and kExchange
};

// What the file system promises about changes of names that were not synced.
enum class NameOrder {
  // All are kept up to some moment, and a sync of any folder is one of all, as in a file system
  // with one journal (ext4, XFS).
  kJournal,
  // Those of each folder are kept up to some moment, and only a sync of the folder makes them
  // durable, which is all that POSIX promises. A renaming from one folder to another belongs to
  // both, and is done whole or not at all.
  kFolders,
};

// A disk on which recorded events happen, and which may lose power after any of them. Until a file
// is synced, any of its writes and truncations may be lost, also when later ones are kept, and of a
// write any sectors.
class SimulatedDisk {
 public:
  explicit SimulatedDisk(uint64_t seed, NameOrder order = NameOrder::kJournal)
      : rng_(seed), order_(order) {}

  // The event must live as long as this object.
  void Apply(const FileEvent& event);

  // The names and contents of the files after a power loss now. Each call draws another outcome.
  // Names of folders end with a slash.
  std::map<std::string, std::string> LosePower();

 private:
  struct File {
    std::string durable;
    std::vector<const FileEvent*> pending;
  };
  // Names and numbers of files; those of folders are -1.
  using Names = std::map<std::string, int>;

  // Carries out those of the pending changes that reach the disk.
  std::string SomeOf(const File& file);
  void WriteSectors(const FileEvent& write, std::string* bytes);
  static void CarryOut(const FileEvent& event, std::string* bytes);
  static void ChangeNames(const FileEvent& event, Names* names);
  // The folders whose content a change of names changes.
  static std::set<std::string> FoldersOf(const FileEvent& event);
  Names NamesAfterLoss();
  // Makes the names in a folder durable.
  void SyncNames(const std::string& folder);
  void SyncAllNames();

  testing::Rng rng_;
  const NameOrder order_;
  std::map<int, File> files_;
  Names durable_names_;
  std::vector<const FileEvent*> pending_names_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_TESTING_SIMULATED_DISK_H_
