// Damages an SQLite file as the bytes of an input choose.
#ifndef HYPERMAP_TESTS_FUZZ_DAMAGE_FILE_H_
#define HYPERMAP_TESTS_FUZZ_DAMAGE_FILE_H_

#include <fuzzer/FuzzedDataProvider.h>

#include <string>

namespace hypermap::fuzz {

// Overwrites a few bytes at random places, or cuts the file. Most such files are refused by
// SQLite's own checks.
std::string PatchBytes(std::string file, FuzzedDataProvider& choices);

// Changes or deletes a few rows through SQLite, so that pages and indexes stay whole and damage is
// found by the readers of rows only. A value becomes NULL, a number, a text or a blob, or some of
// its bytes change. Statements that SQLite refuses are left out.
void ChangeRows(const std::string& path, FuzzedDataProvider& choices);

}  // namespace hypermap::fuzz

#endif  // HYPERMAP_TESTS_FUZZ_DAMAGE_FILE_H_
