// Colours: a map of even lightness steps, linear light, and the conversion to screen values.
#pragma once

#include "apps/report/vector.hpp"

namespace throng::report {

// 0 .. 1 to linear red, green, blue: deep blue over teal and green to pale yellow. Lightness and
// hue are even in Ottosson's Oklab (2020), so equal steps look equal and grey prints keep the
// order.
Vector colour_map(float t);
// Linear light to the screen's 0 .. 1.
float to_screen(float linear);
// The screen's red, green, blue as 0xrrggbb to linear light.
Vector from_screen(unsigned rgb);

}  // namespace throng::report
