// Whether a sanitizer watches this build: everything takes several times as long then, and memory,
// threads and signals are its own to handle.
#pragma once

#if defined(__SANITIZE_THREAD__)
#define THRONG_WATCHES_THREADS 1
#elif defined(__SANITIZE_ADDRESS__)
#define THRONG_WATCHES_MEMORY 1
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define THRONG_WATCHES_THREADS 1
#elif __has_feature(address_sanitizer)
#define THRONG_WATCHES_MEMORY 1
#endif
#endif
#ifndef THRONG_WATCHES_THREADS
#define THRONG_WATCHES_THREADS 0
#endif
#ifndef THRONG_WATCHES_MEMORY
#define THRONG_WATCHES_MEMORY 0
#endif
#define THRONG_SANITIZED (THRONG_WATCHES_THREADS || THRONG_WATCHES_MEMORY)

namespace throng::tests {
constexpr bool watches_memory = THRONG_WATCHES_MEMORY, watches_threads = THRONG_WATCHES_THREADS;
constexpr bool sanitized = THRONG_SANITIZED;
}  // namespace throng::tests
