// Standard output.
#pragma once

#include <string>

namespace throng::common {

// Writes and flushes. Throws Failure where that is not possible: a full disk, or no reader.
void print(const std::string& text);

}  // namespace throng::common
