#include "wire/file_format.h"

#include "wire/enum_names.h"

namespace hypermap::wire {
namespace {

constexpr EnumNames<FileFormat, v1::FileFormat, 3> kFormats{{
    {FileFormat::kHmap, v1::FILE_FORMAT_HMAP},
    {FileFormat::kNav2, v1::FILE_FORMAT_NAV2},
    {FileFormat::kGeoJson, v1::FILE_FORMAT_GEOJSON},
}};

}  // namespace

v1::FileFormat EncodeFileFormat(FileFormat format) { return EncodeEnum(kFormats, format); }

absl::StatusOr<FileFormat> DecodeFileFormat(absl::string_view field, v1::FileFormat format) {
  return DecodeEnum(kFormats, field, format);
}

}  // namespace hypermap::wire
