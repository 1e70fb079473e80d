// What every C++ header here includes first, so that a compiler set to an older standard says one
// thing and stops: an #error alone would be followed by hundreds.
#pragma once

#if (defined(_MSVC_LANG) ? _MSVC_LANG : __cplusplus) < 201703L
#error "Throng's headers need C++17 or newer: compile with -std=c++17 (MSVC: /std:c++17)"
#include <throng/needs-std-c++17>  // there is no such file: the compiler stops here
#endif
