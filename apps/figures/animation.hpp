// The picture at the top of README.md: moving boxes, animated by SVG itself.
#pragma once

#include <string>

namespace throng::figures {

// An SVG of half a minute that loops seamlessly. Where animation is off it shows the first frame.
// Throws Error.
std::string moving();

}  // namespace throng::figures
