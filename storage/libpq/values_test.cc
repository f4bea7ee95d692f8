// Parameters and rows: values go to the database and come back.
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/libpq/connection.h"
#include "storage/libpq/testing/database_test.h"

namespace hypermap::storage::postgres {
namespace {

using ::testing::HasSubstr;

class ValuesTest : public DatabaseTest {
 protected:
  // The answer, whose first row is the current one.
  template <typename... Values>
  Rows Row(const std::string& sql, const Values&... values) {
    absl::StatusOr<Rows> rows = connection_->Query(sql, values...);
    EXPECT_TRUE(rows.ok()) << rows.status();
    if (!rows.ok()) return Rows();
    EXPECT_TRUE(rows->Next());
    return *std::move(rows);
  }
};

TEST_F(ValuesTest, IntegersComeBack) {
  for (const int64_t value : {std::numeric_limits<int64_t>::min(), int64_t{-1}, int64_t{0},
                              int64_t{1} << 40, std::numeric_limits<int64_t>::max()}) {
    Rows row = Row("SELECT $1, $1::text", value);
    EXPECT_EQ(row.Int64(0), value);
    EXPECT_EQ(row.Text(1), absl::StrCat(value));
    EXPECT_EQ(row.row_status(), absl::OkStatus());
  }
  Rows row = Row("SELECT (-7)::int2, (-2147483648)::int4, $1", -7);
  EXPECT_EQ(row.Int64(0), -7);
  EXPECT_EQ(row.Int64(1), std::numeric_limits<int32_t>::min());
  EXPECT_EQ(row.Int64(2), -7);
}

TEST_F(ValuesTest, NumbersComeBackBitForBit) {
  using Limits = std::numeric_limits<double>;
  for (const double value : {0.0, -0.0, 0.1, -1e300, Limits::min(), Limits::denorm_min(),
                             Limits::max(), Limits::lowest(), Limits::infinity(),
                             -Limits::infinity(), Limits::quiet_NaN(), -Limits::quiet_NaN()}) {
    Rows row = Row("SELECT $1", value);
    EXPECT_EQ(std::bit_cast<int64_t>(row.Double(0)), std::bit_cast<int64_t>(value)) << value;
    EXPECT_EQ(row.row_status(), absl::OkStatus());
  }
  EXPECT_EQ(Row("SELECT 0.5::float4").Double(0), 0.5);
}

TEST_F(ValuesTest, TextsAndBlobsComeBack) {
  std::string all_bytes;
  for (int byte = 0; byte < 256; ++byte) all_bytes.push_back(static_cast<char>(byte));
  for (const std::string& bytes : {std::string(), all_bytes, std::string(3000000, 'x')}) {
    Rows row = Row("SELECT $1, length($1)", BlobView{bytes});
    EXPECT_EQ(row.Blob(0), bytes);
    EXPECT_EQ(row.Int64(1), static_cast<int64_t>(bytes.size()));
  }
  for (const std::string& text :
       {std::string(), std::string("äöü €\t\n\\'\" 🤖"), std::string("null")}) {
    Rows row = Row("SELECT $1, $1::varchar", text);
    EXPECT_EQ(row.Text(0), text);
    EXPECT_EQ(row.Text(1), text);
  }
}

TEST_F(ValuesTest, BooleansComeBack) {
  Rows row = Row("SELECT $1, $2", true, false);
  EXPECT_TRUE(row.Bool(0));
  EXPECT_FALSE(row.Bool(1));
  EXPECT_EQ(row.row_status(), absl::OkStatus());
}

TEST_F(ValuesTest, NullsComeBack) {
  Rows row = Row("SELECT $1, $2, $3, $4, $5, $6", std::optional<int64_t>(), std::optional<double>(),
                 std::optional<std::string>(), std::optional<BlobView>(), std::optional<bool>(),
                 std::optional<int>());
  for (int column = 0; column < 6; ++column) EXPECT_TRUE(row.IsNull(column));
  EXPECT_EQ(row.OptionalInt64(0), std::nullopt);
  EXPECT_EQ(row.OptionalDouble(1), std::nullopt);
  EXPECT_EQ(row.row_status(), absl::OkStatus());
  Rows present = Row("SELECT $1, $2, $3", std::optional<int64_t>(5), std::optional<double>(0.5),
                     std::optional<std::string>(""));
  EXPECT_EQ(present.OptionalInt64(0), 5);
  EXPECT_EQ(present.OptionalDouble(1), 0.5);
  EXPECT_FALSE(present.IsNull(2));
  EXPECT_EQ(present.Text(2), "");
}

TEST_F(ValuesTest, ArraysArrive) {
  const std::vector<int64_t> integers = {std::numeric_limits<int64_t>::min(), 0, 7};
  const std::vector<double> numbers = {0.5, -std::numeric_limits<double>::infinity()};
  const std::vector<absl::string_view> texts = {"", "ä,{}\"", "null"};
  const std::string bytes("\0\xff", 2);
  const std::vector<BlobView> blobs = {{bytes}, {""}};
  Rows row =
      Row("SELECT $1::text, $2::text, array_to_string($3, '|'), encode($4[1], 'hex'), "
          "length($4[2]), cardinality($4)",
          absl::MakeConstSpan(integers), absl::MakeConstSpan(numbers), absl::MakeConstSpan(texts),
          absl::MakeConstSpan(blobs));
  EXPECT_EQ(row.Text(0), "{-9223372036854775808,0,7}");
  EXPECT_EQ(row.Text(1), "{0.5,-Infinity}");
  EXPECT_EQ(row.Text(2), "|ä,{}\"|null");
  EXPECT_EQ(row.Text(3), "00ff");
  EXPECT_EQ(row.Int64(4), 0);
  EXPECT_EQ(row.Int64(5), 2);
  EXPECT_EQ(row.row_status(), absl::OkStatus());
}

TEST_F(ValuesTest, ArraysMayBeEmptyAndHoldNulls) {
  const std::vector<std::optional<int64_t>> integers = {std::nullopt, 1, std::nullopt};
  const std::vector<std::optional<double>> numbers = {2.5, std::nullopt};
  Rows row =
      Row("SELECT $1::text, $2::text", absl::MakeConstSpan(integers), absl::MakeConstSpan(numbers));
  EXPECT_EQ(row.Text(0), "{NULL,1,NULL}");
  EXPECT_EQ(row.Text(1), "{2.5,NULL}");
  Rows empty =
      Row("SELECT $1 = '{}', $2 = '{}', $3 = '{}', $4 = '{}', $5 = '{}', $6 = '{}'",
          absl::Span<const int64_t>(), absl::Span<const double>(),
          absl::Span<const absl::string_view>(), absl::Span<const BlobView>(),
          absl::Span<const std::optional<int64_t>>(), absl::Span<const std::optional<double>>());
  for (int column = 0; column < 6; ++column) EXPECT_TRUE(empty.Bool(column)) << column;
}

TEST_F(ValuesTest, RowsOfColumnsAreSentAsArrays) {
  const std::vector<int64_t> ids = {3, 1, 2};
  const std::vector<absl::string_view> labels = {"c", "a", "b"};
  auto rows = connection_->Query(
      "SELECT * FROM unnest($1::bigint[], $2::text[]) AS t (id, label) ORDER BY id",
      absl::MakeConstSpan(ids), absl::MakeConstSpan(labels));
  ASSERT_TRUE(rows.ok()) << rows.status();
  std::string all;
  while (rows->Next()) absl::StrAppend(&all, rows->Int64(0), rows->Text(1), " ");
  EXPECT_EQ(all, "1a 2b 3c ");
}

TEST_F(ValuesTest, AColumnOfAnotherTypeIsDamage) {
  Rows row = Row("SELECT 'text' AS a, 1::numeric AS b, NULL::bigint AS c, 2::bigint AS d");
  EXPECT_EQ(row.Int64(3), 2);
  EXPECT_EQ(row.row_status(), absl::OkStatus());
  EXPECT_EQ(row.Int64(0), 0);
  EXPECT_EQ(row.row_status(), absl::DataLossError("column a holds text, not an integer"));
  EXPECT_EQ(row.Double(1), 0);
  EXPECT_EQ(row.Text(2), "");
  // The first one is told.
  EXPECT_EQ(row.row_status(), absl::DataLossError("column a holds text, not an integer"));

  Rows numeric = Row("SELECT 1::numeric AS b");
  EXPECT_EQ(numeric.Double(0), 0);
  EXPECT_EQ(numeric.row_status(),
            absl::DataLossError("column b holds a value of the type 1700, not a number"));
  Rows null = Row("SELECT NULL::bigint AS c");
  EXPECT_EQ(null.Int64(0), 0);
  EXPECT_EQ(null.row_status(), absl::DataLossError("column c holds NULL, not an integer"));
  Rows blob = Row("SELECT 'x'::bytea AS d");
  EXPECT_EQ(blob.Text(0), "");
  EXPECT_EQ(blob.row_status(), absl::DataLossError("column d holds a blob, not text"));
  Rows few = Row("SELECT true AS e");
  EXPECT_EQ(few.Int64(5), 0);
  EXPECT_FALSE(few.Bool(-1));
  EXPECT_EQ(few.row_status().code(), absl::StatusCode::kDataLoss);
}

TEST_F(ValuesTest, RowsAreReadOneByOneAndMoved) {
  auto rows = connection_->Query("SELECT generate_series(1, 3)::bigint");
  ASSERT_TRUE(rows.ok());
  EXPECT_EQ(rows->Int64(0), 0);  // no row yet
  EXPECT_EQ(rows->row_status().code(), absl::StatusCode::kDataLoss);
  rows = connection_->Query("SELECT generate_series(1, 3)::bigint");
  ASSERT_TRUE(rows->Next());
  Rows moved = *std::move(rows);
  EXPECT_EQ(moved.Int64(0), 1);
  ASSERT_TRUE(moved.Next());
  ASSERT_TRUE(moved.Next());
  EXPECT_EQ(moved.Int64(0), 3);
  EXPECT_FALSE(moved.Next());
  EXPECT_EQ(moved.size(), 3);
  Rows none;
  EXPECT_FALSE(none.Next());
  EXPECT_EQ(none.size(), 0);
  EXPECT_EQ(none.changed_rows(), 0);
}

TEST_F(ValuesTest, TextThatCanNotBeStoredIsRefused) {
  const std::string nul("a\0b", 3);
  const absl::Status with_nul = connection_->Query("SELECT $1", nul).status();
  EXPECT_EQ(with_nul, absl::InvalidArgumentError("the text $1 contains a NUL"));
  const absl::Status no_utf8 = connection_->Query("SELECT $1, $2", "a", "\xff").status();
  EXPECT_EQ(no_utf8, absl::InvalidArgumentError("the text $2 is not UTF-8"));
  const std::vector<absl::string_view> texts = {"a", nul};
  const absl::Status array = connection_->Query("SELECT $1", absl::MakeConstSpan(texts)).status();
  EXPECT_THAT(std::string(array.message()), HasSubstr("contains a NUL"));
  EXPECT_EQ(**connection_->QueryInt64("SELECT 1::bigint"), 1);
}

}  // namespace
}  // namespace hypermap::storage::postgres
