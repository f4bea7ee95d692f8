// Names of threads, which operators see in `top -H` and `ps -L`.
#ifndef HYPERMAP_BASE_SYNC_THREAD_NAME_H_
#define HYPERMAP_BASE_SYNC_THREAD_NAME_H_

#include <pthread.h>

#include <cstddef>

namespace hypermap {

// A string literal of at most 15 characters. Names begin with "hm-", so that they can be told from
// those of gRPC's threads; docs/limits.md lists them.
class ThreadName {
 public:
  template <size_t kSize>
  constexpr ThreadName(const char (&name)[kSize])  // NOLINT(google-explicit-constructor)
      : name_(name) {
    static_assert(kSize <= 16, "Linux refuses names of more than 15 characters");
  }

  const char* c_str() const { return name_; }

 private:
  const char* name_;
};

// Names the calling thread. A thread that nobody names has the name of the one that started it.
inline void NameThisThread(ThreadName name) {
  // Fails for names that are too long only.
  pthread_setname_np(pthread_self(), name.c_str());
}

}  // namespace hypermap

#endif  // HYPERMAP_BASE_SYNC_THREAD_NAME_H_
