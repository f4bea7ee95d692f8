// Tells ThreadSanitizer of an order between threads that it can't see.
#ifndef HYPERMAP_BASE_SYNC_HANDED_OVER_H_
#define HYPERMAP_BASE_SYNC_HANDED_OVER_H_

#if defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define HYPERMAP_THREAD_SANITIZER
// These are functions of the sanitizer's runtime (sanitizer/tsan_interface.h).
extern "C" {
void __tsan_acquire(void* address);
void __tsan_release(void* address);
}
#endif
#endif

namespace hypermap {

// A library that is not instrumented, such as gRPC, may pass an object from one thread to another:
// the first thread starts an operation, and the library calls back on the second when it has ended.
// The first calls HandOver(object) before it starts the operation, and the second
// TakeOver(object) before it touches the object. Without these calls, ThreadSanitizer would report
// every access of the second thread as a race. They do nothing in other builds, and order nothing
// themselves.
inline void HandOver([[maybe_unused]] void* object) {
#ifdef HYPERMAP_THREAD_SANITIZER
  __tsan_release(object);
#endif
}

inline void TakeOver([[maybe_unused]] void* object) {
#ifdef HYPERMAP_THREAD_SANITIZER
  __tsan_acquire(object);
#endif
}

}  // namespace hypermap

#undef HYPERMAP_THREAD_SANITIZER

#endif  // HYPERMAP_BASE_SYNC_HANDED_OVER_H_
