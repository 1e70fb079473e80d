/* THRONG_API: what a shared library shows. Everything else in it is hidden. A program that links
 * the shared library on Windows defines THRONG_SHARED, as the CMake target does by itself. */
#ifndef THRONG_EXPORT_H
#define THRONG_EXPORT_H

#if defined(_WIN32) && defined(THRONG_SHARED)
#ifdef THRONG_BUILDING
#define THRONG_API __declspec(dllexport)
#else
#define THRONG_API __declspec(dllimport)
#endif
#elif defined(__GNUC__)
#define THRONG_API __attribute__((visibility("default")))
#else
#define THRONG_API
#endif

#endif
