// Reads pairs of points from a file.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_POINT_PAIRS_FILE_H_
#define HYPERMAP_CLIENT_LIBS_CLI_POINT_PAIRS_FILE_H_

#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client_libs/cpp/answers.h"

namespace hypermap::cli {

// Reads one pair per line, "NAME,SOURCE_X,SOURCE_Y,TARGET_X,TARGET_Y", in metres, with a standard
// deviation in metres as an optional sixth field. The name may be empty. Empty lines and a header
// line that begins with "name," are skipped. INVALID_ARGUMENT naming a line that has another form.
absl::StatusOr<std::vector<client::NamedPair>> ReadPointPairs(absl::string_view text);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_POINT_PAIRS_FILE_H_
