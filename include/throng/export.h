/* THRONG_API marks the exported symbols of a shared library; all others are hidden. A program that
 * links the shared library on Windows must define THRONG_SHARED; the CMake target does so. */
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
