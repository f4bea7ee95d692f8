#include "base/digest/set_digest.h"

#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/digest/sha256.h"

namespace hypermap {
namespace {

std::string Sha256Of(absl::string_view text) {
  Sha256 digest;
  digest.Add(text);
  return std::move(digest).Finish();
}

SetDigest Element(absl::string_view text) { return SetDigest::OfElement(Sha256Of(text)); }

TEST(SetDigestTest, BytesOfAnElementAreItsDigest) {
  EXPECT_EQ(Element("chair").Bytes(), Sha256Of("chair"));
}

TEST(SetDigestTest, OrderDoesNotCount) {
  SetDigest one;
  SetDigest other;
  for (int i = 0; i < 100; ++i) one.Add(Element(absl::StrCat(i)));
  for (int i = 100; i-- > 0;) other.Add(Element(absl::StrCat(i)));
  EXPECT_EQ(one, other);
  other.Remove(Element("7"));
  EXPECT_NE(one, other);
}

TEST(SetDigestTest, WhatIsRemovedLeavesNothingBehind) {
  SetDigest digest = Element("kept");
  for (int i = 0; i < 100; ++i) digest.Add(Element(absl::StrCat(i)));
  for (int i = 0; i < 100; ++i) digest.Remove(Element(absl::StrCat(i)));
  EXPECT_EQ(digest, Element("kept"));
}

TEST(SetDigestTest, CarriesGoThroughAllParts) {
  const SetDigest greatest = SetDigest::OfElement(std::string(32, '\xff'));
  const SetDigest one = SetDigest::OfElement(std::string(1, '\x01') + std::string(31, '\0'));
  SetDigest digest = greatest;
  digest.Add(one);
  EXPECT_EQ(digest, SetDigest());
  digest.Remove(one);
  EXPECT_EQ(digest, greatest);
}

TEST(KeptDigestTest, IsComputedOnceByOneThread) {
  const KeptDigest kept;
  int times = 0;
  const auto compute = [&times] {
    ++times;
    return Element("chair");
  };
  EXPECT_EQ(kept.Get(compute), Element("chair"));
  EXPECT_EQ(kept.Get(compute), Element("chair"));
  EXPECT_EQ(times, 1);
}

TEST(KeptDigestTest, ManyThreadsGetTheSame) {
  const KeptDigest kept;
  std::vector<SetDigest> got(8);
  std::vector<std::thread> threads;
  for (SetDigest& digest : got) {
    threads.emplace_back([&] { digest = kept.Get([] { return Element("chair"); }); });
  }
  for (std::thread& thread : threads) thread.join();
  for (const SetDigest& digest : got) EXPECT_EQ(digest, Element("chair"));
}

}  // namespace
}  // namespace hypermap
