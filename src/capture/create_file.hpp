// Creates a file, never opens one that exists.
#pragma once

#include <cstdio>

#ifdef _WIN32
#include <fcntl.h>
#include <io.h>
#include <sys/stat.h>
#endif

namespace throng::capture {

// For writing bytes. Null: errno says why; EEXIST if the file exists.
inline std::FILE* create_file(const char* path) noexcept {
#ifdef _WIN32
  // Not "wbx": msvcrt.dll, which mingw-w64 can link, does not know the x; Wine's truncates the
  // file.
  const int descriptor =
      _open(path, _O_CREAT | _O_EXCL | _O_WRONLY | _O_BINARY, _S_IREAD | _S_IWRITE);
  if (descriptor < 0) return nullptr;
  std::FILE* const file = _fdopen(descriptor, "wb");
  if (!file) _close(descriptor);
  return file;
#else
  return std::fopen(path, "wbx");
#endif
}

}  // namespace throng::capture
