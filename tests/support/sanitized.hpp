// Whether this is a sanitizer build: everything is several times slower then, and the sanitizer
// owns memory, threads and signals.
#pragma once

#include <cstdint>

#if defined(__has_feature)
#define THRONG_HAS(feature) __has_feature(feature)
#else
#define THRONG_HAS(feature) 0
#endif

#if defined(__SANITIZE_THREAD__) || THRONG_HAS(thread_sanitizer)
#define THRONG_THREAD_SANITIZED 1
#else
#define THRONG_THREAD_SANITIZED 0
#endif
#if THRONG_THREAD_SANITIZED || defined(__SANITIZE_ADDRESS__) || THRONG_HAS(address_sanitizer)
#define THRONG_SANITIZED 1
#else
#define THRONG_SANITIZED 0
#endif

// For simple loops of the tests: a sanitizer finds nothing in them and would spend most time there.
#if defined(__GNUC__)
#define THRONG_NO_SANITIZE __attribute__((no_sanitize("address", "undefined", "thread")))
#else
#define THRONG_NO_SANITIZE
#endif

namespace throng::tests {
constexpr bool thread_sanitized = THRONG_THREAD_SANITIZED, sanitized = THRONG_SANITIZED;
// Reason to skip a test under ThreadSanitizer: it uses one thread, and is slow.
constexpr const char* one_thread = "single-threaded test";

// Number of seeds of a random test. Three under a sanitizer, because tests vary with the seed only
// by remainders of two or three.
constexpr std::uint64_t seeds(std::uint64_t usual) { return sanitized && usual > 3 ? 3 : usual; }
}  // namespace throng::tests
