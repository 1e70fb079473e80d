// Bullet's broad phases. Proxies persist; each frame sets every box, then computes the pairs.
//
// Bullet enlarges moving boxes and removes old pairs lazily, so its pair array also holds pairs
// that do not overlap. They are removed outside the measured time, which favours Bullet.
#include <algorithm>

#include <BulletCollision/BroadphaseCollision/btAxisSweep3.h>
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>

#include "competitors.hpp"

namespace throng::bench {
namespace {

btVector3 lower(const Box& b) { return btVector3(b.lower.x, b.lower.y, b.lower.z); }
btVector3 upper(const Box& b) { return btVector3(b.upper.x, b.upper.y, b.upper.z); }

class Bullet : public Method {
 public:
  void prepare(const Input& in) override {
    proxies_.clear();
    broad_phase_ = create(in);
    for (std::size_t i = 0; i < in.count; ++i)
      proxies_.push_back(broad_phase_->createProxy(
          lower(in.boxes[i]), upper(in.boxes[i]), 0, reinterpret_cast<void*>(i),
          btBroadphaseProxy::DefaultFilter, btBroadphaseProxy::AllFilter, nullptr));
  }
  void run(const Input& in) override {
    for (std::size_t i = 0; i < in.count; ++i)
      broad_phase_->setAabb(proxies_[i], lower(in.boxes[i]), upper(in.boxes[i]), nullptr);
    broad_phase_->calculateOverlappingPairs(nullptr);
  }
  void collect(const Input& in, std::vector<Pair>& out) const override {
    const auto& cache = *broad_phase_->getOverlappingPairCache();
    const btBroadphasePair* pairs = cache.getOverlappingPairArrayPtr();
    for (int k = 0; k < cache.getNumOverlappingPairs(); ++k) {
      const auto a = reinterpret_cast<std::size_t>(pairs[k].m_pProxy0->m_clientObject);
      const auto b = reinterpret_cast<std::size_t>(pairs[k].m_pProxy1->m_clientObject);
      if (overlap(in.boxes[a], in.boxes[b]))
        out.push_back(ordered(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b)));
    }
  }

 protected:
  virtual std::unique_ptr<btBroadphaseInterface> create(const Input& in) = 0;

 private:
  std::unique_ptr<btBroadphaseInterface> broad_phase_;
  std::vector<btBroadphaseProxy*> proxies_;
};

class Dbvt : public Bullet {
 public:
  explicit Dbvt(bool deferred) : deferred_(deferred) {}

 protected:
  std::unique_ptr<btBroadphaseInterface> create(const Input&) override {
    auto dbvt = std::make_unique<btDbvtBroadphase>();
    dbvt->m_deferedcollide = deferred_;
    return dbvt;
  }

 private:
  bool deferred_;
};

class AxisSweep : public Bullet {
 protected:
  std::unique_ptr<btBroadphaseInterface> create(const Input& in) override {
    btVector3 low = lower(in.boxes[0]), high = upper(in.boxes[0]);
    for (std::size_t i = 1; i < in.count; ++i) {
      low.setMin(lower(in.boxes[i]));
      high.setMax(upper(in.boxes[i]));
    }
    const btVector3 margin =
        (high - low) * btScalar(0.05) + btVector3(1, 1, 1);  // boxes move a little per frame
    return std::make_unique<bt32BitAxisSweep3>(low - margin, high + margin,
                                               static_cast<unsigned>(in.count) + 2, nullptr, true);
  }
};

}  // namespace

std::vector<MethodInfo> bullet_methods() {
  const std::string note =
      "objects persist; pairs of enlarged boxes that do not overlap are removed outside the time";
  return {{"Bullet btDbvt, default", note, "Bullet btDbvt", Origin::other_library, false,
           [](unsigned) { return std::make_unique<Dbvt>(false); }},
          {"Bullet btDbvt, deferred", note, "Bullet btDbvt", Origin::other_library, false,
           [](unsigned) { return std::make_unique<Dbvt>(true); }},
          {"Bullet bt32BitAxisSweep3", note + "; insertion is outside the time", "",
           Origin::other_library, false, [](unsigned) { return std::make_unique<AxisSweep>(); }}};
}

}  // namespace throng::bench
