#include "storage/interchange/zip_archive.h"

#include <zip.h>

#include <algorithm>
#include <array>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "base/cancellation/cancellation.h"
#include "base/limits/limits.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"

namespace hypermap::storage {
namespace {

struct CloseFile {
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};
struct FreeSource {
  void operator()(zip_source_t* source) const { zip_source_free(source); }
};
using SourcePtr = std::unique_ptr<zip_source_t, FreeSource>;

// The first moment that a zip can name, so that no clock and no time zone gets into the archive.
constexpr uint16_t kFixedTime = 0;
constexpr uint16_t kFixedDate = (1 << 5) | 1;

std::string Describe(zip_error_t error) {
  std::string text = zip_error_strerror(&error);
  zip_error_fini(&error);
  return text;
}

bool LeadsOut(absl::string_view name) {
  if (name.empty() || name.front() == '/' || name.find('\\') != absl::string_view::npos) {
    return true;
  }
  const std::vector<absl::string_view> steps = absl::StrSplit(name, '/');
  return std::find(steps.begin(), steps.end(), "..") != steps.end();
}

// Bytes that libzip keeps of each member while the archive is open: 308 were measured for short
// names.
constexpr int64_t kBytesPerMember = 400;

// Returns at least the number of members: the number of places that look like a member's entry in
// the directory.
int64_t CountEntries(absl::string_view data) {
  constexpr absl::string_view kEntry("PK\1\2", 4);
  int64_t count = 0;
  for (size_t at = data.find(kEntry); at != absl::string_view::npos;
       at = data.find(kEntry, at + kEntry.size())) {
    ++count;
  }
  return count;
}

absl::Status MemberError(absl::string_view member, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("member \"", member, "\": ", what));
}

}  // namespace

void ZipArchive::Discard::operator()(zip* archive) const { zip_discard(archive); }

ZipArchive::ZipArchive(zip* archive, const Limits& limits)
    : archive_(archive), max_unpacked_bytes_(limits.max_unpacked_bytes) {}

absl::StatusOr<ZipArchive> ZipArchive::Open(absl::string_view data, const Limits& limits) {
  // libzip would open an empty file as an archive without members.
  if (data.empty()) return absl::InvalidArgumentError("no zip archive: the file is empty");
  HYPERMAP_RETURN_IF_ERROR(TakeMemory(kBytesPerMember * CountEntries(data)));
  zip_error_t error;
  zip_error_init(&error);
  SourcePtr source(zip_source_buffer_create(data.data(), data.size(), /*freep=*/0, &error));
  zip_t* opened = source ? zip_open_from_source(source.get(), ZIP_RDONLY, &error) : nullptr;
  if (opened == nullptr) {
    return absl::InvalidArgumentError(absl::StrCat("no zip archive: ", Describe(error)));
  }
  static_cast<void>(source.release());  // the archive owns it now
  ZipArchive archive(opened, limits);
  const zip_int64_t num_members = zip_get_num_entries(opened, 0);
  if (num_members > limits.max_archive_members) {
    return absl::ResourceExhaustedError(absl::StrCat("archive has ", num_members,
                                                     " members, more than --max_archive_members (",
                                                     limits.max_archive_members, ")"));
  }
  for (zip_int64_t i = 0; i < num_members; ++i) {
    const char* name = zip_get_name(opened, i, ZIP_FL_ENC_GUESS);
    if (name == nullptr) return absl::InvalidArgumentError("archive has a member without a name");
    if (LeadsOut(name)) return MemberError(name, "the name leads out of the archive");
  }
  return archive;
}

bool ZipArchive::Contains(const std::string& member) const {
  return zip_name_locate(archive_.get(), member.c_str(), 0) >= 0;
}

absl::StatusOr<std::string> ZipArchive::Read(const std::string& member) {
  if (LeadsOut(member)) return MemberError(member, "the name leads out of the archive");
  const zip_int64_t index = zip_name_locate(archive_.get(), member.c_str(), 0);
  if (index < 0) return MemberError(member, "missing");
  const std::unique_ptr<zip_file_t, CloseFile> file(zip_fopen_index(archive_.get(), index, 0));
  if (file == nullptr) return MemberError(member, zip_strerror(archive_.get()));

  std::string content;
  std::array<char, 1 << 16> chunk;
  while (true) {
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    const zip_int64_t n = zip_fread(file.get(), chunk.data(), chunk.size());
    if (n < 0) return MemberError(member, zip_file_strerror(file.get()));
    if (n == 0) return content;
    unpacked_bytes_ += n;
    if (unpacked_bytes_ > max_unpacked_bytes_) {
      return absl::ResourceExhaustedError(
          absl::StrCat("member \"", member, "\": the archive unpacks to more than ",
                       "--max_unpacked_bytes (", max_unpacked_bytes_, ")"));
    }
    content.append(chunk.data(), n);
  }
}

namespace {

absl::Status ArchiveError(zip_t* archive) {
  return absl::InternalError(absl::StrCat("writing a zip archive: ", zip_strerror(archive)));
}

absl::Status AddMember(zip_t* archive, const NamedFile& member) {
  zip_source_t* content =
      zip_source_buffer(archive, member.data.data(), member.data.size(), /*freep=*/0);
  if (content == nullptr) return ArchiveError(archive);
  const zip_int64_t index = zip_file_add(archive, member.name.c_str(), content, ZIP_FL_ENC_UTF_8);
  if (index < 0) {
    zip_source_free(content);
    return ArchiveError(archive);
  }
  if (zip_file_set_dostime(archive, index, kFixedTime, kFixedDate, 0) != 0) {
    return ArchiveError(archive);
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> ReadAll(zip_source_t* source) {
  zip_stat_t stat;
  zip_stat_init(&stat);
  if (zip_source_stat(source, &stat) != 0 || zip_source_open(source) != 0) {
    return absl::InternalError("reading back a zip archive");
  }
  HYPERMAP_RETURN_IF_ERROR(TakeMemory(static_cast<int64_t>(stat.size)));
  std::string bytes(stat.size, '\0');
  const zip_int64_t n = zip_source_read(source, bytes.data(), bytes.size());
  zip_source_close(source);
  if (n != static_cast<zip_int64_t>(bytes.size())) {
    return absl::InternalError("reading back a zip archive");
  }
  return bytes;
}

}  // namespace

absl::StatusOr<std::string> MakeZip(const std::vector<NamedFile>& members) {
  // libzip keeps the packed members until all are read back. Packing makes none noticeably larger.
  int64_t most_bytes = 0;
  for (const NamedFile& member : members) most_bytes += static_cast<int64_t>(member.data.size());
  HYPERMAP_RETURN_IF_ERROR(TakeMemory(most_bytes));
  zip_error_t error;
  zip_error_init(&error);
  // Held twice: by the archive that writes into it, and here to read it afterwards.
  SourcePtr bytes(zip_source_buffer_create(nullptr, 0, /*freep=*/0, &error));
  if (bytes == nullptr) return absl::InternalError(Describe(error));
  zip_t* archive = zip_open_from_source(bytes.get(), ZIP_CREATE | ZIP_TRUNCATE, &error);
  if (archive == nullptr) return absl::InternalError(Describe(error));
  zip_source_keep(bytes.get());
  for (const NamedFile& member : members) {
    if (absl::Status status = AddMember(archive, member); !status.ok()) {
      zip_discard(archive);
      return status;
    }
  }
  // Closing packs the members.
  zip_register_cancel_callback_with_state(
      archive, [](zip_t* /*archive*/, void* /*unused*/) { return IsCancelled() ? 1 : 0; }, nullptr,
      nullptr);
  if (zip_close(archive) != 0) {
    absl::Status status = CheckCancelled();
    if (status.ok()) status = ArchiveError(archive);
    zip_discard(archive);
    return status;
  }
  return ReadAll(bytes.get());
}

}  // namespace hypermap::storage
