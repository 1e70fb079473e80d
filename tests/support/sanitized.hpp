// Whether a sanitizer watches this build: everything takes several times as long then, and memory,
// threads and signals are its own to handle.
#pragma once

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define THRONG_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define THRONG_SANITIZED 1
#endif
#endif
#ifndef THRONG_SANITIZED
#define THRONG_SANITIZED 0
#endif

namespace throng::tests {
constexpr bool sanitized = THRONG_SANITIZED;
}  // namespace throng::tests
