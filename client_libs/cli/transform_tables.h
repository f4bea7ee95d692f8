// Estimated transforms as text for people.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_TRANSFORM_TABLES_H_
#define HYPERMAP_CLIENT_LIBS_CLI_TRANSFORM_TABLES_H_

#include <ostream>
#include <string>

#include "client_libs/cli/output.h"
#include "map/registration/transform_estimate.h"

namespace hypermap::cli {

// Prints the transform with its standard deviations and the runner-up, the pairs of points if it
// was estimated from these, and what to think of it.
void PrintTransform(const TransformReport& report, std::ostream& out);

// Whether the estimate is ambiguous, and why, in one line.
std::string DescribeAmbiguity(registration::Ambiguity ambiguity);

// The side in one line: "attic/occupancy in map, revision 3".
std::string DescribeSide(const registration::ReadSide& side);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_TRANSFORM_TABLES_H_
