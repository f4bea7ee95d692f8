// Validators of option values for the parser. A value that fails is an error of usage.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_VALIDATORS_H_
#define HYPERMAP_CLIENT_LIBS_CLI_VALIDATORS_H_

#include <CLI/CLI.hpp>

namespace hypermap::cli {

CLI::Validator IsNumber();     // a finite decimal number
CLI::Validator IsPoint();      // X,Y
CLI::Validator IsPose();       // X,Y,YAW
CLI::Validator IsLayerKind();  // the names of map/layers
CLI::Validator IsCellRule();   // the names of map/layers
CLI::Validator IsShapeKind();  // the names of map/geometry/shape.h
CLI::Validator IsAlias();      // ALIAS=LABELS
CLI::Validator IsTimeout();    // "1.5s", "2m", or "0" for none
CLI::Validator IsAsOf();       // a revision, or an RFC 3339 time

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_VALIDATORS_H_
