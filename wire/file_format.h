// Formats of files on the wire, as in imports and exports.
#ifndef HYPERMAP_WIRE_FILE_FORMAT_H_
#define HYPERMAP_WIRE_FILE_FORMAT_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "hypermap/v1/catalog_service.pb.h"
#include "map/file_format.h"

namespace hypermap::wire {

v1::FileFormat EncodeFileFormat(FileFormat format);
// INVALID_ARGUMENT for a format that is missing or unknown.
absl::StatusOr<FileFormat> DecodeFileFormat(absl::string_view field, v1::FileFormat format);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_FILE_FORMAT_H_
