#include "storage/geopackage/testing/simulated_disk.h"

#include <algorithm>
#include <utility>

namespace hypermap::storage {

using ::hypermap::testing::UniformInt;

namespace {

std::string FolderOfName(const std::string& name) {
  const size_t slash = name.rfind('/');
  return slash == std::string::npos ? "" : name.substr(0, slash);
}

// Whether the name is that of the folder or of something in it.
bool IsWithin(const std::string& name, const std::string& folder) {
  return name == folder || name.starts_with(folder + "/");
}

}  // namespace

void SimulatedDisk::Apply(const FileEvent& event) {
  switch (event.kind) {
    case FileEvent::Kind::kAppear:
      if (event.file >= 0) files_[event.file].durable = event.bytes;
      durable_names_[event.name] = event.file;
      break;
    case FileEvent::Kind::kCreate:
    case FileEvent::Kind::kMakeFolder:
    case FileEvent::Kind::kLink:
    case FileEvent::Kind::kRemove:
    case FileEvent::Kind::kMove:
    case FileEvent::Kind::kExchange:
      pending_names_.push_back(&event);
      break;
    case FileEvent::Kind::kRename:
    case FileEvent::Kind::kVanish:
      SyncAllNames();
      ChangeNames(event, &durable_names_);
      break;
    case FileEvent::Kind::kWrite:
    case FileEvent::Kind::kTruncate:
      files_[event.file].pending.push_back(&event);
      break;
    case FileEvent::Kind::kSync: {
      File& file = files_[event.file];
      for (const FileEvent* change : file.pending) CarryOut(*change, &file.durable);
      file.pending.clear();
      break;
    }
    case FileEvent::Kind::kSyncFailed: {
      // Linux marks the pages as clean, so that the next sync does not write them either
      // (https://wiki.postgresql.org/wiki/Fsync_Errors).
      File& file = files_[event.file];
      file.durable = SomeOf(file);
      file.pending.clear();
      break;
    }
    case FileEvent::Kind::kSyncFolder:
      SyncNames(event.name);
      break;
    case FileEvent::Kind::kNote:
      break;
  }
}

std::map<std::string, std::string> SimulatedDisk::LosePower() {
  const Names names = NamesAfterLoss();
  std::map<std::string, std::string> result;
  // Two names of one file have the same content.
  std::map<int, std::string> contents;
  for (const auto& [name, file] : names) {
    bool is_reachable = true;
    for (std::string folder = FolderOfName(name); !folder.empty(); folder = FolderOfName(folder)) {
      is_reachable = is_reachable && names.contains(folder);
    }
    if (!is_reachable) continue;
    if (file < 0) {
      result[name + "/"] = "";
      continue;
    }
    if (!contents.contains(file)) contents[file] = SomeOf(files_[file]);
    result[name] = contents[file];
  }
  return result;
}

SimulatedDisk::Names SimulatedDisk::NamesAfterLoss() {
  Names names = durable_names_;
  if (order_ == NameOrder::kJournal) {
    const int kept = UniformInt(rng_, 0, static_cast<int>(pending_names_.size()));
    for (int i = 0; i < kept; ++i) ChangeNames(*pending_names_[i], &names);
    return names;
  }
  // Folders of which a change is lost, so that all later ones are.
  std::set<std::string> lost;
  for (const FileEvent* event : pending_names_) {
    const std::set<std::string> folders = FoldersOf(*event);
    const bool is_after_loss = std::any_of(
        folders.begin(), folders.end(), [&](const auto& folder) { return lost.contains(folder); });
    if (is_after_loss || UniformInt(rng_, 0, 2) == 0) {
      lost.insert(folders.begin(), folders.end());
    } else {
      ChangeNames(*event, &names);
    }
  }
  return names;
}

std::string SimulatedDisk::SomeOf(const File& file) {
  std::string bytes = file.durable;
  if (file.pending.empty()) return bytes;
  enum Outcome { kNothing, kEverything, kBeginning, kAnySubset, kAnySectors };
  const int outcome = UniformInt(rng_, kNothing, kAnySectors);
  const int size = static_cast<int>(file.pending.size());
  // The number of a change before which all are kept.
  int end = 0;
  if (outcome == kEverything) end = size;
  if (outcome == kBeginning) end = UniformInt(rng_, 0, size);
  for (int i = 0; i < size; ++i) {
    const FileEvent& change = *file.pending[i];
    bool is_kept = i < end;
    if (outcome == kAnySubset) is_kept = UniformInt(rng_, 0, 1) == 0;
    if (outcome == kAnySectors) is_kept = UniformInt(rng_, 0, 2) == 0;
    const bool is_torn = !is_kept && (i == end || outcome == kAnySectors) && outcome != kNothing;
    if (is_kept) {
      CarryOut(change, &bytes);
    } else if (is_torn && change.kind == FileEvent::Kind::kWrite) {
      WriteSectors(change, &bytes);
    }
  }
  return bytes;
}

void SimulatedDisk::WriteSectors(const FileEvent& write, std::string* bytes) {
  constexpr int64_t kSector = 512;
  const auto end = write.offset + static_cast<int64_t>(write.bytes.size());
  const auto size = static_cast<int64_t>(bytes->size());
  // A file that has grown may have got its new size before its content.
  const bool is_garbage = UniformInt(rng_, 0, 1) == 0;
  if (end > size) bytes->resize(end);
  for (int64_t at = write.offset; at < end;) {
    const int64_t next = std::min(end, (at / kSector + 1) * kSector);
    if (UniformInt(rng_, 0, 1) == 0) {
      bytes->replace(at, next - at, write.bytes, at - write.offset, next - at);
    } else if (is_garbage) {
      for (int64_t i = std::max(at, size); i < next; ++i) (*bytes)[i] = static_cast<char>(rng_());
    }
    at = next;
  }
}

void SimulatedDisk::CarryOut(const FileEvent& event, std::string* bytes) {
  if (event.kind == FileEvent::Kind::kTruncate) {
    bytes->resize(event.offset);
    return;
  }
  const size_t end = event.offset + event.bytes.size();
  if (end > bytes->size()) bytes->resize(end);
  std::copy(event.bytes.begin(), event.bytes.end(), bytes->begin() + event.offset);
}

void SimulatedDisk::ChangeNames(const FileEvent& event, Names* names) {
  switch (event.kind) {
    case FileEvent::Kind::kCreate:
    case FileEvent::Kind::kMakeFolder:
    case FileEvent::Kind::kLink:
    case FileEvent::Kind::kRename:
      (*names)[event.name] = event.file;
      break;
    case FileEvent::Kind::kMove: {
      Names moved;
      for (auto it = names->begin(); it != names->end();) {
        if (!IsWithin(it->first, event.from)) {
          ++it;
          continue;
        }
        moved[event.name + it->first.substr(event.from.size())] = it->second;
        it = names->erase(it);
      }
      for (auto& [name, file] : moved) (*names)[name] = file;
      break;
    }
    case FileEvent::Kind::kExchange:
      std::swap((*names)[event.from], (*names)[event.name]);
      break;
    default:
      names->erase(event.name);
  }
}

std::set<std::string> SimulatedDisk::FoldersOf(const FileEvent& event) {
  std::set<std::string> folders = {FolderOfName(event.name)};
  if (!event.from.empty()) folders.insert(FolderOfName(event.from));
  return folders;
}

void SimulatedDisk::SyncNames(const std::string& folder) {
  if (order_ == NameOrder::kJournal) {
    SyncAllNames();
    return;
  }
  // A renaming between folders takes the earlier changes of both along.
  std::set<std::string> synced = {folder};
  std::set<const FileEvent*> durable;
  for (auto it = pending_names_.rbegin(); it != pending_names_.rend(); ++it) {
    const std::set<std::string> folders = FoldersOf(**it);
    const bool is_synced = std::any_of(folders.begin(), folders.end(), [&](const auto& changed) {
      return synced.contains(changed);
    });
    if (!is_synced) continue;
    durable.insert(*it);
    synced.insert(folders.begin(), folders.end());
  }
  for (const FileEvent* event : pending_names_) {
    if (durable.contains(event)) ChangeNames(*event, &durable_names_);
  }
  std::erase_if(pending_names_, [&](const FileEvent* event) { return durable.contains(event); });
}

void SimulatedDisk::SyncAllNames() {
  for (const FileEvent* event : pending_names_) ChangeNames(*event, &durable_names_);
  pending_names_.clear();
}

}  // namespace hypermap::storage
