// Whether a sanitizer watches this build: everything takes several times as long then, and memory,
// threads and signals are its own to handle.
#pragma once

#include <cstdint>

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

// For a plain loop of a test's own: nothing is seen in it, and most of the time would go there.
#if defined(__GNUC__)
#define THRONG_UNWATCHED __attribute__((no_sanitize("address", "undefined", "thread")))
#else
#define THRONG_UNWATCHED
#endif

namespace throng::tests {
constexpr bool watches_threads = THRONG_WATCHES_THREADS, sanitized = THRONG_SANITIZED;
// Why a test is skipped where threads are watched: it runs on one, and slowly.
constexpr const char* one_thread = "one thread alone";

// So many seeds of one random test; under a sanitizer, for which they go the same ways, the first
// three: what a test varies with its seed goes by remainders by two or three.
constexpr std::uint64_t seeds(std::uint64_t usual) { return sanitized && usual > 3 ? 3 : usual; }
}  // namespace throng::tests
