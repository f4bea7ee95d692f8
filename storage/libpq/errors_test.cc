#include "storage/libpq/errors.h"

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"

namespace hypermap::storage::postgres {
namespace {

TEST(ErrorsTest, SqlStatesBecomeTheStatusThatCallersActOn) {
  struct Case {
    const char* sqlstate;
    absl::StatusCode code;
  };
  const Case cases[] = {
      {"08006", absl::StatusCode::kUnavailable},
      {"22021", absl::StatusCode::kInvalidArgument},
      {"22P05", absl::StatusCode::kInvalidArgument},
      {"22003", absl::StatusCode::kInternal},
      {"23505", absl::StatusCode::kAlreadyExists},
      {"23503", absl::StatusCode::kInternal},
      {"25006", absl::StatusCode::kUnavailable},
      {"25P02", absl::StatusCode::kInternal},
      {"25P03", absl::StatusCode::kUnavailable},
      {"28000", absl::StatusCode::kFailedPrecondition},
      {"28P01", absl::StatusCode::kFailedPrecondition},
      {"3D000", absl::StatusCode::kFailedPrecondition},
      {"40001", absl::StatusCode::kUnavailable},
      {"40P01", absl::StatusCode::kUnavailable},
      {"42501", absl::StatusCode::kFailedPrecondition},
      {"42601", absl::StatusCode::kInternal},
      {"53100", absl::StatusCode::kResourceExhausted},
      {"53200", absl::StatusCode::kResourceExhausted},
      {"53300", absl::StatusCode::kUnavailable},
      {"54000", absl::StatusCode::kResourceExhausted},
      {"55P03", absl::StatusCode::kUnavailable},
      {"57014", absl::StatusCode::kUnavailable},
      {"57P01", absl::StatusCode::kUnavailable},
      {"57P03", absl::StatusCode::kUnavailable},
      {"57P04", absl::StatusCode::kFailedPrecondition},
      {"58030", absl::StatusCode::kUnavailable},
      {"58P01", absl::StatusCode::kDataLoss},
      {"XX000", absl::StatusCode::kInternal},
      {"XX001", absl::StatusCode::kDataLoss},
      {"XX002", absl::StatusCode::kDataLoss},
  };
  for (const Case& c : cases) {
    const absl::Status status = DatabaseError(c.sqlstate, "no luck");
    EXPECT_EQ(status.code(), c.code) << c.sqlstate;
    EXPECT_EQ(SqlStateOf(status), c.sqlstate);
    EXPECT_EQ(status.message(), absl::StrCat("no luck (SQLSTATE ", c.sqlstate, ")"));
  }
}

TEST(ErrorsTest, OtherErrorsHaveNoSqlState) {
  EXPECT_EQ(SqlStateOf(absl::OkStatus()), "");
  EXPECT_EQ(SqlStateOf(absl::UnavailableError("08006")), "");
}

}  // namespace
}  // namespace hypermap::storage::postgres
