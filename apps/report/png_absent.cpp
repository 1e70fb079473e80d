// In place of write_png.cpp in a build without Cairo: a requested picture is refused.
#include "apps/report/write_png.hpp"

#include <stdexcept>

namespace throng::report {
namespace {

[[noreturn]] void refuse(const std::string& path) {
  throw std::runtime_error("cannot draw the picture '" + path +
                           "': this build has no Cairo; build with Cairo (Debian: "
                           "libcairo2-dev), or request no picture");
}

}  // namespace

bool can_write_png() noexcept { return false; }
void check_png(const std::string& path) {
  if (!path.empty()) refuse(path);
}
void write_png(const std::string& path, Image, const PictureStyle&, float, float) { refuse(path); }
void write_png(const std::string& path, Image, const PictureStyle&, const std::vector<ColourKey>&) {
  refuse(path);
}

}  // namespace throng::report
