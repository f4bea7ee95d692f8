// Charges the memory that work reads for a call, however deep the code is that reads it.
//
// While a thread works for a call, it has the call's MemoryMeter:
//
//   MemoryMeter meter(&account);
//   const ScopedMeter here(&meter);
//   HYPERMAP_ASSIGN_OR_RETURN(SnapshotPtr snapshot, ReadPast(past, scope, area));
//
// Code that keeps an amount of data which a request or a file decides calls TakeMemory for each
// part of it, before it reads the next one, and passes the error on. The meter's owner knows when
// the data is gone, and gives the memory back.
#ifndef HYPERMAP_BASE_METERING_MEMORY_METER_H_
#define HYPERMAP_BASE_METERING_MEMORY_METER_H_

#include <cstdint>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace hypermap {

// Where memory is charged.
class MemoryAccount {
 public:
  virtual ~MemoryAccount() = default;
  // Returns OK, or the error with which the work must end; then nothing is charged.
  virtual absl::Status ChargeMemory(int64_t bytes) = 0;
  virtual void FreeMemory(int64_t bytes) = 0;
};

// The memory that one piece of work may take, whatever others take. Not thread-safe.
class MemoryCap final : public MemoryAccount {
 public:
  // `flag` is the name by which a refusal, RESOURCE_EXHAUSTED, calls the limit. 0 bounds nothing.
  MemoryCap(absl::string_view flag, int64_t most_bytes) : flag_(flag), most_bytes_(most_bytes) {}

  absl::Status ChargeMemory(int64_t bytes) override;
  void FreeMemory(int64_t bytes) override { charged_ -= bytes; }

 private:
  const absl::string_view flag_;
  const int64_t most_bytes_;
  int64_t charged_ = 0;
};

// Used by one thread at a time; may be handed from thread to thread.
class MemoryMeter {
 public:
  // Memory that is not charged, because most work reads little: the account's lock costs more.
  static constexpr int64_t kFreeBytes = 64 << 10;

  // The account must outlive this.
  explicit MemoryMeter(MemoryAccount* account) : account_(account) {}
  ~MemoryMeter() { GiveBack(); }
  MemoryMeter(const MemoryMeter&) = delete;
  MemoryMeter& operator=(const MemoryMeter&) = delete;

  // Adds `bytes`, and charges the account for them and a few more. An error of the account leaves
  // the meter as it was.
  absl::Status Take(int64_t bytes);
  // REQUIRES: 0 <= bytes <= taken().
  void GiveBack(int64_t bytes);
  void GiveBack() { GiveBack(taken_); }
  int64_t taken() const { return taken_; }

  // The meter of the work of this thread; null if there is none.
  static MemoryMeter* Current();

 private:
  MemoryAccount* const account_;
  int64_t taken_ = 0;
  int64_t charged_ = 0;
};

// Sets the meter of this thread until it is destroyed, then restores the one before.
class ScopedMeter {
 public:
  explicit ScopedMeter(MemoryMeter* meter);
  ~ScopedMeter();
  ScopedMeter(const ScopedMeter&) = delete;
  ScopedMeter& operator=(const ScopedMeter&) = delete;

 private:
  MemoryMeter* const before_;
};

// Gives back, when it is destroyed, what the meter of this thread took since it was made.
class TemporaryMemory {
 public:
  TemporaryMemory();
  ~TemporaryMemory();
  TemporaryMemory(const TemporaryMemory&) = delete;
  TemporaryMemory& operator=(const TemporaryMemory&) = delete;

 private:
  MemoryMeter* const meter_;
  const int64_t before_;
};

// Takes `bytes` from the meter of this thread. OK without one.
absl::Status TakeMemory(int64_t bytes);

}  // namespace hypermap

#endif  // HYPERMAP_BASE_METERING_MEMORY_METER_H_
