// Describes parts of answers in one line, for people.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_DESCRIBE_H_
#define HYPERMAP_CLIENT_LIBS_CLI_DESCRIBE_H_

#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "client_libs/cli/cell_values.h"
#include "client_libs/cpp/answers.h"
#include "client_libs/cpp/points_stream.h"
#include "client_libs/cpp/watch.h"
#include "map/frames/planar_transform.h"
#include "map/geometry/point.h"
#include "map/geometry/shape.h"
#include "map/layers/layer_spec.h"
#include "map/objects/semantic_object.h"
#include "storage/transfer/migration.h"

namespace hypermap::cli {

std::string DescribePoint(const Point& p);
std::string DescribePose(const PlanarTransform& pose);
// UTC with milliseconds.
std::string DescribeTime(absl::Time time);
// Returns "1 cell", "2 cells".
std::string Counted(int64_t count, absl::string_view noun);
// The kind of a layer; for an exploration layer also its rule.
std::string DescribeKind(const LayerSpec& spec);
// Empty for AnswerStatus::kValue.
std::string DescribeStatus(AnswerStatus status);
// Returns "all" or the names of the kinds, such as "line_string, point".
std::string DescribeShapeKinds(const ShapeKinds& kinds);
// The area of a polygon ("0.5 m²") or the length of a line string ("8 m"); empty for a point.
std::string DescribeExtent(const Shape& shape);
std::string DescribeObject(const SemanticObject& object);
// The layer's content at the point with index `point`. `values` must be made for the layer's kind.
// `next_hit` is the index of the next hit; it must be 0 for the first point, and points must be
// described in order.
std::string DescribeContent(const client::LayerPoints& layer, const CellValues& values,
                            size_t point, size_t* next_hit);
// Whether the digests of a map and its copy are equal, or which parts are not; empty if there is no
// copy.
std::string DescribeDigests(const storage::Migration& migration);
// How far the map is.
std::string DescribeState(storage::Migration::State state);
std::string DescribeChange(const client::MapChange& change);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_DESCRIBE_H_
