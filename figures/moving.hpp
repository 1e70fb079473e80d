// The picture at the top of README.md: boxes that move, drawn by SVG's own animation.
#pragma once

#include <string>

namespace throng::figures {

// An SVG of half a minute that begins anew, without a seam. Where nothing moves it shows the first
// moment. Throws Error.
std::string moving();

}  // namespace throng::figures
