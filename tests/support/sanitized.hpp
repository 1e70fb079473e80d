// Whether a sanitizer watches this build: everything takes several times as long then, and memory,
// threads and signals are its own to handle.
#pragma once

#if defined(__has_feature)
#define THRONG_HAS(feature) __has_feature(feature)
#else
#define THRONG_HAS(feature) 0
#endif

#if defined(__SANITIZE_THREAD__) || THRONG_HAS(thread_sanitizer)
#define THRONG_WATCHES_THREADS 1
#else
#define THRONG_WATCHES_THREADS 0
#endif
#if THRONG_WATCHES_THREADS || defined(__SANITIZE_ADDRESS__) || THRONG_HAS(address_sanitizer)
#define THRONG_SANITIZED 1
#else
#define THRONG_SANITIZED 0
#endif

namespace throng::tests {
constexpr bool watches_threads = THRONG_WATCHES_THREADS, sanitized = THRONG_SANITIZED;
}  // namespace throng::tests
