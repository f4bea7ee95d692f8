// Decodes messages to the client's answers, with the functions of wire/. Only for the sources of
// this folder. INVALID_ARGUMENT names the field that can't be decoded.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_DECODE_H_
#define HYPERMAP_CLIENT_LIBS_CPP_DECODE_H_

#include "absl/status/statusor.h"
#include "client_libs/cpp/answers.h"
#include "hypermap/v1/access_service.pb.h"
#include "hypermap/v1/catalog_service.pb.h"
#include "hypermap/v1/watch_service.pb.h"

namespace hypermap::client {

absl::StatusOr<CallerAnswer> DecodeCaller(const v1::GetCallerResponse& message);
absl::StatusOr<LayerEntry> DecodeLayerEntry(const v1::Layer& message);
absl::StatusOr<LayerList> DecodeLayerList(const v1::ListLayersResponse& message);
absl::StatusOr<TransformList> DecodeTransformList(const v1::ListTransformsResponse& message);
RevisionList DecodeRevisionList(const v1::ListRevisionsResponse& message);

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_DECODE_H_
