// Included first by every C++ header, so that a compiler set to an older standard reports one error
// and stops.
#pragma once

#if (defined(_MSVC_LANG) ? _MSVC_LANG : __cplusplus) < 201703L
#error "Throng's headers need C++17 or newer: compile with -std=c++17 (MSVC: /std:c++17)"
#include <throng/needs-std-c++17>  // there is no such file: the compiler stops here
#endif
