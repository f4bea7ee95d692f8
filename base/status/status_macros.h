// Macros for early returns with absl::Status and absl::StatusOr.
//
//   HYPERMAP_RETURN_IF_ERROR(file.Write(bytes));
//   HYPERMAP_ASSIGN_OR_RETURN(const Layer* layer, snapshot.GetLayer(name));
//
// Both return the status from the enclosing function, which returns absl::Status or any StatusOr.
// The expression is evaluated once. HYPERMAP_ASSIGN_OR_RETURN moves the value into the declaration
// or variable on its left; a type with a comma needs parentheses round the template or `auto`.
#ifndef HYPERMAP_BASE_STATUS_STATUS_MACROS_H_
#define HYPERMAP_BASE_STATUS_STATUS_MACROS_H_

#include <utility>

#include "absl/base/optimization.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#define HYPERMAP_STATUS_CONCAT_INNER(a, b) a##b
#define HYPERMAP_STATUS_CONCAT(a, b) HYPERMAP_STATUS_CONCAT_INNER(a, b)

#define HYPERMAP_RETURN_IF_ERROR(expression)                                                      \
  do {                                                                                            \
    if (absl::Status hypermap_status = (expression); ABSL_PREDICT_FALSE(!hypermap_status.ok())) { \
      return hypermap_status;                                                                     \
    }                                                                                             \
  } while (false)

#define HYPERMAP_ASSIGN_OR_RETURN(left, expression)                                          \
  HYPERMAP_ASSIGN_OR_RETURN_IMPL(HYPERMAP_STATUS_CONCAT(hypermap_statusor_, __LINE__), left, \
                                 expression)

// A declaration can't stand in parentheses. NOLINTBEGIN(bugprone-macro-parentheses)
#define HYPERMAP_ASSIGN_OR_RETURN_IMPL(statusor, left, expression)             \
  auto statusor = (expression);                                                \
  if (ABSL_PREDICT_FALSE(!statusor.ok())) return std::move(statusor).status(); \
  left = *std::move(statusor)
// NOLINTEND(bugprone-macro-parentheses)

#endif  // HYPERMAP_BASE_STATUS_STATUS_MACROS_H_
