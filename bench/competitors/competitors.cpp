#include "competitors.hpp"

#include "doubles.hpp"

#if defined(THRONG_BULLET)
#include <LinearMath/btScalar.h>
#endif
#if THRONG_EMBREE == 4
#include <embree4/rtcore_config.h>
#elif THRONG_EMBREE == 3
#include <embree3/rtcore_config.h>
#endif
#if defined(THRONG_CGAL)
#include <CGAL/version.h>
#endif
#if defined(THRONG_FCL)
#include <fcl/config.h>
#endif

#define THRONG_TEXT_(x) #x
#define THRONG_TEXT(x) THRONG_TEXT_(x)

namespace throng::bench {

std::vector<MethodInfo> competitor_methods() {
  std::vector<MethodInfo> all = {baseline_box_by_box(), baseline_ranges()};
  [[maybe_unused]] const auto add = [&](const std::vector<MethodInfo>& more) {
    all.insert(all.end(), more.begin(), more.end());
  };
#if defined(THRONG_EMBREE)
  add(embree_methods());
#endif
#if defined(THRONG_FCL)
  add(fcl_methods());
#endif
#if defined(THRONG_CGAL)
  add(cgal_methods());
#endif
#if defined(THRONG_BULLET)
  add(bullet_methods());
#endif
  return all;
}

std::vector<std::unique_ptr<DoubleMethod>> double_competitors() {
#if defined(THRONG_CGAL)
  return cgal_double_methods();
#else
  return {};
#endif
}

std::vector<std::string> competitor_versions() {
  std::vector<std::string> v;
#if defined(THRONG_EMBREE)
  v.emplace_back("Embree " RTC_VERSION_STRING);
#endif
#if defined(THRONG_FCL)
  v.emplace_back("FCL " FCL_VERSION);
#endif
#if defined(THRONG_CGAL)
  v.emplace_back("CGAL " CGAL_VERSION_STR);
#endif
#if defined(THRONG_BULLET)
  v.emplace_back("Bullet " + std::to_string(BT_BULLET_VERSION / 100) + "." +
                 std::to_string(BT_BULLET_VERSION % 100));
#endif
  return v;
}

std::vector<std::string> missing_competitors() {
  std::vector<std::string> v;
#if !defined(THRONG_EMBREE)
  v.emplace_back("Embree (libembree-dev)");
#endif
#if !defined(THRONG_FCL)
  v.emplace_back("FCL (libfcl-dev)");
#endif
#if !defined(THRONG_CGAL)
  v.emplace_back("CGAL (libcgal-dev)");
#endif
#if !defined(THRONG_BULLET)
  v.emplace_back("Bullet (libbullet-dev)");
#endif
  return v;
}

}  // namespace throng::bench
