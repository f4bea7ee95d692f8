#include "server/services/map_files.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "storage/interchange/geojson.h"
#include "storage/interchange/hmap.h"
#include "storage/interchange/nav2.h"
#include "wire/file_format.h"

namespace hypermap::server {
namespace {

constexpr char kDefaultNav2Layer[] = "occupancy";

absl::StatusOr<const storage::NamedFile*> OnlyFile(const std::vector<storage::NamedFile>& files) {
  if (files.size() == 1) return &files.front();
  return absl::InvalidArgumentError(
      absl::StrCat("the format takes one file, there are ", files.size()));
}

// The snapshot with the named layers only; without names, with all layers. NOT_FOUND.
absl::StatusOr<Snapshot> WithLayers(const Snapshot& snapshot,
                                    const std::vector<std::string>& names) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<LayerPtr> layers, snapshot.SelectLayers(names));
  Snapshot selected = snapshot;
  selected.layers.clear();
  for (const LayerPtr& layer : layers) selected.layers[layer->spec().name] = layer;
  return selected;
}

// The layer that a nav2 export writes: the named one, or the map's only occupancy layer.
absl::StatusOr<std::string> Nav2Layer(const Snapshot& snapshot,
                                      const std::vector<std::string>& names) {
  if (names.size() == 1) return names.front();
  if (names.size() > 1) return absl::InvalidArgumentError("layers: nav2 files hold one layer");
  std::vector<std::string> grids;
  for (const auto& [name, layer] : snapshot.layers) {
    if (layer->spec().kind == LayerKind::kOccupancy) grids.push_back(name);
  }
  if (grids.size() == 1) return grids.front();
  return absl::InvalidArgumentError(
      absl::StrCat("layers must name one layer, the map has ", grids.size(), " occupancy layers"));
}

absl::StatusOr<storage::Nav2Image> ImageFormat(const std::string& name) {
  if (name.empty() || name == "pgm") return storage::Nav2Image::kPgm;
  if (name == "png") return storage::Nav2Image::kPng;
  return absl::InvalidArgumentError("image_format must be pgm or png");
}

absl::StatusOr<storage::ExportedFiles> EncodeNav2Files(const Snapshot& snapshot,
                                                       const std::vector<std::string>& layers,
                                                       const std::string& image_format) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string layer, Nav2Layer(snapshot, layers));
  HYPERMAP_ASSIGN_OR_RETURN(const storage::Nav2Image image, ImageFormat(image_format));
  return storage::EncodeNav2(snapshot, layer, image);
}

}  // namespace

absl::StatusOr<storage::ImportedMap> DecodeFiles(const v1::ImportHeader& header,
                                                 const std::vector<storage::NamedFile>& files,
                                                 const Snapshot* snapshot, const Limits& limits) {
  HYPERMAP_ASSIGN_OR_RETURN(const FileFormat format,
                            wire::DecodeFileFormat("format", header.format()));
  if (format == FileFormat::kNav2) {
    const std::string layer = header.layer().empty() ? kDefaultNav2Layer : header.layer();
    return storage::DecodeNav2(files, layer, header.frame_id(), limits);
  }
  HYPERMAP_ASSIGN_OR_RETURN(const storage::NamedFile* const file, OnlyFile(files));
  if (format == FileFormat::kHmap) return storage::DecodeHmap(file->data, limits);
  if (header.layer().empty()) return absl::InvalidArgumentError("layer is missing");
  return storage::DecodeGeoJson(file->data, header.layer(), snapshot, limits);
}

absl::StatusOr<storage::ExportedFiles> EncodeFiles(const v1::ExportMapRequest& request,
                                                   const Snapshot& snapshot) {
  HYPERMAP_ASSIGN_OR_RETURN(const FileFormat format,
                            wire::DecodeFileFormat("format", request.format()));
  const std::vector<std::string> layers(request.layers().begin(), request.layers().end());
  switch (format) {
    case FileFormat::kHmap: {
      HYPERMAP_ASSIGN_OR_RETURN(const Snapshot selected, WithLayers(snapshot, layers));
      return storage::EncodeHmap(selected);
    }
    case FileFormat::kNav2:
      return EncodeNav2Files(snapshot, layers, request.image_format());
    case FileFormat::kGeoJson:
      break;
  }
  return storage::EncodeGeoJson(snapshot, layers);
}

}  // namespace hypermap::server
