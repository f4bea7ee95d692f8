// Tells ThreadSanitizer of an order between threads that it can't see.
#ifndef HYPERMAP_BASE_SYNC_CANCEL_SCOPE_H_
#define HYPERMAP_BASE_SYNC_CANCEL_SCOPE_H_

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

// Lives as long as OnCancel of a server's reactor of gRPC runs. The beginning of the call comes
// before, and OnDone after it; but gRPC is not instrumented, so that ThreadSanitizer would report
// every access as a race. OnDone of a client's reactor begins with one, because it may run on
// another thread than the callbacks before. The other callbacks need no such scope, because
// cmake/GrpcForThreadSanitizer.cmake adds their order to gRPC's headers. Does nothing in other
// builds, and orders nothing itself.
class CancelScope {
 public:
  // `reactor` must have gRPC's class of reactors as its first base.
#ifdef HYPERMAP_THREAD_SANITIZER
  explicit CancelScope(void* reactor) : reactor_(reactor) { __tsan_acquire(reactor_); }
  ~CancelScope() { __tsan_release(reactor_); }
#else
  explicit CancelScope(void* /*reactor*/) {}
  ~CancelScope() {}
#endif
  CancelScope(const CancelScope&) = delete;
  CancelScope& operator=(const CancelScope&) = delete;

#ifdef HYPERMAP_THREAD_SANITIZER
 private:
  void* const reactor_;
#endif
};

}  // namespace hypermap

#undef HYPERMAP_THREAD_SANITIZER

#endif  // HYPERMAP_BASE_SYNC_CANCEL_SCOPE_H_
