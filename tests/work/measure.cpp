#include "work/measure.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "broad_phase/query_reference.hpp"
#include "support/hard_boxes.hpp"
#include "support/random.hpp"
#include "support/reference.hpp"

namespace throng::tests {
namespace {

// Scenes up to this size are compared with a double loop.
constexpr std::size_t checked_boxes = 700;
// The emulated device takes some 50 times as long as the CPU search.
constexpr std::size_t emulated_boxes = 100000;
constexpr int build_frames = 40, build_rounds = 24, few_frames = 24, many_frames = 4,
              changed_frames = 8;
constexpr std::size_t queries_per_kind = 16;

const char* const names[] = {
    "find",          "find_two",      "find_emulated", "find_two_emulated",
    "build",         "unpack",        "remove_most",   "build_moves",
    "move_few",      "build_queries", "overlap",       "overlap_empty",
    "overlap_large", "ray_first",     "ray_all",       "ray_long_first",
    "ray_long_all",  "sweep_first",   "sweep_all",     "query_between",
    "move_many",     "query_moved",   "add",           "remove",
};
static_assert(std::size(names) == work_count);

float sum(float a, float b) noexcept { return a + b; }
float size_of(const Box& b, std::uint32_t k) noexcept {
  const float size = (&b.upper.x)[k] - (&b.lower.x)[k];
  return std::isfinite(size) ? size : 1;
}
Box moved(const Box& b, const Vec3& by) noexcept {
  return {{sum(b.lower.x, by.x), sum(b.lower.y, by.y), sum(b.lower.z, by.z)},
          {sum(b.upper.x, by.x), sum(b.upper.y, by.y), sum(b.upper.z, by.z)}};
}

class Measure {
 public:
  explicit Measure(const WorkScene& scene) : scene_(scene), random_(scene.seed ^ 0x776f726bu) {}

  WorkReport run() {
    try {
      find(Backend::cpu);
      if (scene_.boxes.size() <= emulated_boxes) find(Backend::emulated);
      live();
    } catch (const std::runtime_error& e) {
      report_.wrong = e.what();
    }
    return std::move(report_);
  }

 private:
  static void require(const Result& r) {
    if (!r.ok()) throw std::runtime_error(r.message);
  }
  static void require(bool right, const char* what) {
    if (!right) throw std::runtime_error(std::string(what) + " differs from the double loop");
  }
  void add(Work work, double cost, double budget) {
    if (budget > 0) report_.samples.push_back({work, cost, budget});
  }
  static double cost_of(const Result& r) noexcept {
    return static_cast<double>(r.comparisons) + static_cast<double>(r.visited);
  }
  static Options options(Backend backend) {
    Options o;
    o.threads = 1;
    o.backend = backend;
    // Up to 4,096 boxes the device tests all pairs, by design.
    if (backend == Backend::emulated) o.algorithm = Algorithm::grid;
    return o;
  }

  // Pairs that count as results; if forbidden pairs are paid for, these too.
  static std::uint64_t pairs_without_filters(Boxes a, const Boxes* b) {
    a.filters = {};
    Finder finder(options(Backend::cpu));
    Boxes other = b ? *b : a;
    other.filters = {};
    return (b ? finder.find(a, other, nullptr, 0) : finder.find(a, nullptr, 0)).found;
  }
  void find(Backend backend) {
    const bool cpu = backend == Backend::cpu;
    const Boxes all = scene_.view();
    const auto n = static_cast<double>(all.size());
    const bool check = all.size() <= checked_boxes;
    {
      Finder finder(options(backend));
      const Result r = finder.find(all);
      require(r);
      const auto pairs = static_cast<double>(
          scene_.pays_for_forbidden ? pairs_without_filters(all, nullptr) : r.found);
      add(cpu ? Work::find : Work::find_emulated, cost_of(r), n + pairs);
      if (check)
        require(bool(same_pairs(to_vector(finder.pairs()), reference_pairs(all).pairs)), "find");
    }
    // Two halves, or a few against the rest.
    WorkScene side[2];
    Random random(scene_.seed);
    const std::uint32_t one_in = random.one_in(2) ? 2 : 50;
    for (std::size_t i = 0; i < scene_.boxes.size(); ++i) {
      WorkScene& to = side[random.one_in(one_in)];
      to.boxes.push_back(scene_.boxes[i]);
      if (!scene_.group.empty()) to.group.push_back(scene_.group[i]);
      if (!scene_.mask.empty()) to.mask.push_back(scene_.mask[i]);
      if (!scene_.owner.empty()) to.owner.push_back(scene_.owner[i]);
      if (!scene_.world.empty()) to.world.push_back(scene_.world[i]);
      if (!scene_.is_static.empty()) to.is_static.push_back(scene_.is_static[i]);
    }
    const Boxes a = side[0].view(), b = side[1].view();
    Finder finder(options(backend));
    const Result r = finder.find(a, b);
    require(r);
    const auto pairs =
        static_cast<double>(scene_.pays_for_forbidden ? pairs_without_filters(a, &b) : r.found);
    add(cpu ? Work::find_two : Work::find_two_emulated, cost_of(r), n + pairs);
    if (check)
      require(bool(same_pairs(to_vector(finder.pairs()), reference_pairs(a, b).pairs)),
              "find of two sets");
  }

  double count() const noexcept { return static_cast<double>(alive_.size()); }
  double log_n() const noexcept { return 1 + std::log2(count() + 1); }
  // The budget of a query without results.
  double query() const noexcept { return scene_.queries_test_all ? count() : log_n(); }
  double grant() const noexcept { return count() + static_cast<double>(broad_.pair_count()); }

  // Changes since the last update, which add to its budget.
  struct Change {
    double budget = 0, objects = 0;
  };
  double forbidden_of(ObjectId id) const {
    double met = 0;
    if (!scene_.pays_for_forbidden) return met;
    for (const ObjectId other : alive_) met += overlap(now_[id], now_[other]);
    return met;
  }
  static bool overlap(const Box& a, const Box& b) noexcept {
    return a.lower.x <= b.upper.x && b.lower.x <= a.upper.x && a.lower.y <= b.upper.y &&
           b.lower.y <= a.upper.y && a.lower.z <= b.upper.z && b.lower.z <= a.upper.z;
  }
  void changes(ObjectId id) {
    change_.budget += log_n() + degree_[id] + forbidden_of(id);
    ++change_.objects;
  }
  void move(ObjectId id, const Box& to) {
    now_[id] = to;
    changes(id);
    if (broad_.move(id, to) != Status::ok) throw std::runtime_error("move failed");
  }
  // Adds to `sample`.
  void update(WorkSample& sample) {
    const Result r = broad_.update();
    require(r);
    for (const LivePair& p : broad_.begun()) ++degree_[p.first], ++degree_[p.second];
    for (const LivePair& p : broad_.ended()) --degree_[p.first], --degree_[p.second];
    sample.cost += cost_of(r);
    sample.budget += change_.budget + static_cast<double>(broad_.begun().size());
    changed_ += change_.objects;
    change_ = {};
  }
  void done(const WorkSample& sample) { add(sample.work, sample.cost, sample.budget); }

  Box next_place(ObjectId id) {
    const Box& rest_box = rest_boxes_[id];
    const auto by = [&](std::uint32_t k) {
      return random_.in(-1, 1) * scene_.step * size_of(rest_box, k);
    };
    const Vec3 step{by(0), by(1), by(2)};
    if (!scene_.teleport) return moved(rest_box, step);
    // With its own size, at the place of another one.
    const Box& other =
        rest_boxes_[alive_[random_.below(static_cast<std::uint32_t>(alive_.size()))]];
    Box to = moved(other, step);
    for (std::uint32_t k = 0; k < 3; ++k) {
      if (std::isfinite((&to.lower.x)[k]) &&
          std::isfinite((&rest_box.upper.x)[k] - (&rest_box.lower.x)[k]))
        (&to.upper.x)[k] = (&to.lower.x)[k] + size_of(rest_box, k);
    }
    return to;
  }
  void move_few() {
    for (const ObjectId id : scene_.movers) move(id, next_place(id));
  }

  void live() {
    now_ = rest_boxes_ = scene_.boxes;
    degree_.assign(now_.size(), 0);
    alive_.resize(now_.size());
    std::iota(alive_.begin(), alive_.end(), ObjectId{0});
    {
      WorkSample s{Work::build};
      require(broad_.add(scene_.view(), nullptr));
      for (const ObjectId id : alive_) changes(id);
      update(s);
      s.budget += grant();
      done(s);
    }
    if (!scene_.unpacked.empty()) unpack();
    if (!scene_.removed.empty()) remove_most();
    {
      WorkSample s{Work::build_moves};
      for (int frame = 0; frame < build_frames; ++frame) {
        move_few();
        update(s);
      }
      s.budget += grant();
      done(s);
    }
    {
      WorkSample s{Work::move_few};
      for (int frame = 0; frame < few_frames; ++frame) {
        move_few();
        update(s);
      }
      done(s);
    }
    check_pairs("pairs after few moves");
    {
      WorkSample s{Work::build_queries};
      for (int round = 0; round < build_rounds; ++round) query_all(&s);
      s.budget += grant();
      done(s);
    }
    query_all(nullptr);
    {
      WorkSample s{Work::query_between};
      for (int frame = 0; frame < changed_frames; ++frame) {
        move_few();
        query_few(s);
        // The update or the query may insert them.
        s.budget += change_.budget;
        change_ = {};
      }
      update(s);
      done(s);
    }
    {
      WorkSample s{Work::move_many};
      changed_ = 0;
      for (int frame = 0; frame < many_frames; ++frame) {
        const std::uint32_t one_in = frame % 2 == 0 ? 1 : 4;
        for (const ObjectId id : alive_)
          if (random_.one_in(one_in)) move(id, next_place(id));
        update(s);
        if (changed_ >= count()) {
          s.budget += grant();
          changed_ = 0;
        }
      }
      done(s);
    }
    check_pairs("pairs after many moves");
    {
      WorkSample s{Work::query_moved};
      query_few(s);
      s.budget += grant();
      done(s);
    }
    add_and_remove();
    check_pairs("pairs after adding and removing objects");
  }

  void unpack() {
    WorkSample s{Work::unpack};
    std::vector<ObjectId> order = alive_;
    shuffle(order, random_);
    const std::size_t each = order.size() / 100 + 1;
    double pairs = 0;
    for (std::size_t i = 0; i < order.size(); i += each) {
      pairs = std::max(pairs, static_cast<double>(broad_.pair_count()));
      for (std::size_t k = i; k < std::min(i + each, order.size()); ++k) {
        move(order[k], scene_.unpacked[order[k]]);
        rest_boxes_[order[k]] = now_[order[k]];
      }
      update(s);
    }
    s.budget += 2 * (count() + pairs);  // of the first updates with few moves, and of n changes
    done(s);
  }
  void remove_most() {
    WorkSample s{Work::remove_most};
    const double before = grant();
    for (const ObjectId id : scene_.removed) {
      changes(id);
      if (broad_.remove(id) != Status::ok) throw std::runtime_error("remove failed");
    }
    erase_alive(scene_.removed);
    update(s);
    s.budget += before;
    done(s);
  }
  void erase_alive(const std::vector<ObjectId>& ids) {  // sorted
    std::vector<ObjectId> left;
    std::set_difference(alive_.begin(), alive_.end(), ids.begin(), ids.end(),
                        std::back_inserter(left));
    alive_ = std::move(left);
  }

  // Adds copies of objects, one step away, and removes them again: a hundredth each time.
  void add_and_remove() {
    WorkSample warm{Work::build_moves}, added{Work::add}, removed{Work::remove};
    const std::size_t each = alive_.size() / 100 + 1;
    for (int frame = 0; frame < build_frames / 2; ++frame) {  // for a new index, after many moved
      move_few();
      update(warm);
    }
    warm.budget += grant();
    done(warm);
    for (int frame = 0; frame < changed_frames; ++frame) {
      std::vector<ObjectId> added_ids;
      for (std::size_t k = 0; k < each; ++k) {
        const ObjectId like = alive_[random_.below(static_cast<std::uint32_t>(alive_.size()))];
        const Box box = next_place(like);
        ObjectId id;
        if (broad_.add(box, broad_.filter(like), id) != Status::ok)
          throw std::runtime_error("add failed");
        if (id >= now_.size()) {
          now_.resize(id + 1);
          rest_boxes_.resize(id + 1);
          degree_.resize(id + 1);
        }
        now_[id] = rest_boxes_[id] = box;
        degree_[id] = 0;
        added_ids.push_back(id);
        changes(id);
      }
      alive_.insert(alive_.end(), added_ids.begin(), added_ids.end());
      std::sort(alive_.begin(), alive_.end());
      std::sort(added_ids.begin(), added_ids.end());
      update(added);
      for (const ObjectId id : added_ids) {
        changes(id);
        if (broad_.remove(id) != Status::ok) throw std::runtime_error("remove failed");
      }
      erase_alive(added_ids);
      update(removed);
    }
    done(added);
    done(removed);
  }

  void check_pairs(const char* what) {
    if (now_.size() > checked_boxes) return;
    WorkScene live = scene_;
    live.boxes.assign(now_.size(), Box{{1, 1, 1}, {0, 0, 0}});  // lower > upper: inactive
    for (const ObjectId id : alive_) live.boxes[id] = now_[id];
    // Added objects have the filters of an existing one.
    if (live.boxes.size() != scene_.boxes.size()) {
      const auto add_filters = [&](auto& values, const auto& of) {
        if (values.empty()) return;
        for (std::size_t i = values.size(); i < live.boxes.size(); ++i)
          values.push_back(of(static_cast<ObjectId>(i)));
      };
      const auto filter = [&](ObjectId id) {
        return broad_.is_alive(id) ? broad_.filter(id) : Filter{};
      };
      add_filters(live.group, [&](ObjectId id) { return filter(id).group; });
      add_filters(live.mask, [&](ObjectId id) { return filter(id).mask; });
      add_filters(live.owner, [&](ObjectId id) { return filter(id).owner; });
      add_filters(live.world, [&](ObjectId id) { return filter(id).world; });
      add_filters(live.is_static,
                  [&](ObjectId id) { return static_cast<std::uint8_t>(filter(id).is_static); });
    }
    std::vector<Pair> got;
    for (const LivePair& p : broad_.pairs()) got.push_back({p.first, p.second});
    require(bool(same_pairs(got, reference_pairs(live.view()).pairs)), what);
  }

  // Where queries are: near an object, or in empty space.
  enum class Way { any, axis, grazing, empty };
  const Box& some() {
    return now_[alive_[random_.below(static_cast<std::uint32_t>(alive_.size()))]];
  }
  // The finite range of the scene along an axis.
  void range(std::uint32_t k, float& low, float& high) const {
    low = infinity, high = -infinity;
    for (const ObjectId id : alive_) {
      const float a = (&now_[id].lower.x)[k], b = (&now_[id].upper.x)[k];
      if (std::isfinite(a)) low = std::min(low, a);
      if (std::isfinite(b)) high = std::max(high, b);
    }
    if (!(low <= high)) low = 0, high = 1;
  }
  // Outside of the scene on one axis, by some object sizes or far away; inside on the others.
  Vec3 empty_place() {
    Vec3 at = some().lower;
    const std::uint32_t k = random_.below(3);
    float low, high;
    range(k, low, high);
    const float away = size_of(some(), k) * random_.magnitude(0, 12);
    (&at.x)[k] = random_.one_in(2) ? high + away : low - 2 * away;
    for (std::uint32_t j = 0; j < 3; ++j)
      if (!std::isfinite((&at.x)[j])) (&at.x)[j] = 0;
    return at;
  }
  Box like_an_object(const Vec3& at) {
    const Box& like = some();
    Box box{at, at};
    for (std::uint32_t k = 0; k < 3; ++k)
      (&box.upper.x)[k] += size_of(like, k) * random_.in(0.1f, 1);
    return box;
  }
  Vec3 inside() {
    const Box& b = some();
    Vec3 at = b.lower;
    for (std::uint32_t k = 0; k < 3; ++k) {
      if (!std::isfinite((&at.x)[k])) (&at.x)[k] = 0;
      (&at.x)[k] += size_of(b, k) * random_.in(-1, 2);
    }
    return at;
  }
  std::vector<Box> overlap_boxes(Work kind) {
    std::vector<Box> boxes;
    for (std::size_t i = 0; i < queries_per_kind; ++i) {
      Box box = like_an_object(kind == Work::overlap ? inside() : empty_place());
      if (kind == Work::overlap_large) {
        for (std::uint32_t k = 0; k < 3; ++k) {
          float low, high;
          range(k, low, high);
          (&box.upper.x)[k] += (high - low) * random_.magnitude(-8, 2);
        }
      }
      boxes.push_back(box);
    }
    return boxes;
  }
  // `length` in object sizes, or in units.
  std::vector<Sweep> sweeps(Way way, bool is_long, bool of_boxes) {
    std::vector<Sweep> made;
    while (made.size() < queries_per_kind) {
      const Box& like = some();
      Vec3 from = way == Way::empty ? empty_place() : inside();
      float by[3] = {random_.in(-1, 1), random_.in(-1, 1), random_.in(-1, 1)};
      const std::uint32_t along = random_.below(3);
      if (way == Way::grazing) {  // along a face
        from = like.upper;
        for (std::uint32_t k = 0; k < 3; ++k)
          if (!std::isfinite((&from.x)[k])) (&from.x)[k] = 0;
      }
      if (way == Way::axis || way == Way::grazing) {
        for (std::uint32_t k = 0; k < 3; ++k)
          if (k != along) by[k] = 0;
        by[along] = random_.one_in(2) ? 1 : -1;
      }
      const float units = random_.magnitude(7, 127);  // 128 .. FLT_MAX
      for (std::uint32_t k = 0; k < 3; ++k) {
        by[k] *= is_long ? units : size_of(like, k) * random_.magnitude(0, 3);
        if (!std::isfinite(by[k])) by[k] = float_max;
      }
      made.push_back({of_boxes ? like_an_object(from) : Box{from, from}, {by[0], by[1], by[2]}});
    }
    return made;
  }

  void query_overlaps(Work kind, WorkSample* sum) {
    const std::vector<Box> boxes = overlap_boxes(kind);
    const Result r = broad_.find_overlaps(Boxes(boxes));
    require(r);
    record(kind, sum, cost_of(r),
           static_cast<double>(boxes.size()) * query() + static_cast<double>(r.found));
    if (alive_.size() > checked_boxes) return;
    std::vector<Pair> want;
    for (std::uint32_t i = 0; i < boxes.size(); ++i)
      for (const ObjectId id : alive_)
        if (overlap(boxes[i], now_[id])) want.push_back({i, id});
    require(bool(same_pairs(to_vector(broad_.overlaps()), want)), "find_overlaps");
  }
  void query_sweeps(Way way, bool is_long, bool of_boxes, WorkSample* sum) {
    const std::vector<Sweep> sweeps_made = sweeps(way, is_long, of_boxes);
    const double each =
        static_cast<double>(sweeps_made.size()) * (query() + (is_long ? scene_.path_objects : 0));
    Result r = broad_.find_hits(sweeps_made.data(), sweeps_made.size(), SweepHits::all);
    require(r);
    const std::vector<SweepHit> hits(broad_.hits().begin(), broad_.hits().end());
    record(of_boxes  ? Work::sweep_all
           : is_long ? Work::ray_long_all
                     : Work::ray_all,
           sum, cost_of(r), each + static_cast<double>(hits.size()));
    if (alive_.size() <= checked_boxes) check_hits(sweeps_made, hits);
    r = broad_.find_hits(sweeps_made.data(), sweeps_made.size(), SweepHits::first);
    require(r);
    // Hits are sorted by sweep.
    double ties = 0;
    for (std::size_t i = 0, end; i < hits.size(); i = end) {
      double first = 2;
      for (end = i; end < hits.size() && hits[end].sweep == hits[i].sweep; ++end)
        first = std::min(first, hits[end].time);
      for (std::size_t k = i; k < end; ++k) ties += hits[k].time == first;
    }
    record(of_boxes  ? Work::sweep_first
           : is_long ? Work::ray_long_first
                     : Work::ray_first,
           sum, cost_of(r), each + ties);
  }
  void check_hits(const std::vector<Sweep>& sweeps_made, const std::vector<SweepHit>& got) const {
    std::size_t at = 0;
    for (std::uint32_t i = 0; i < sweeps_made.size(); ++i) {
      for (const ObjectId id : alive_) {
        double time;
        if (!meets(sweeps_made[i], now_[id], time)) continue;
        const bool same =
            at < got.size() && got[at].sweep == i && got[at].object == id && got[at].time == time;
        require(same, "find_hits");
        ++at;
      }
    }
    require(at == got.size(), "find_hits");
  }
  // As a sample of its own, or added to `sum`.
  void record(Work kind, WorkSample* sum, double cost, double budget) {
    if (!sum) return add(kind, cost, budget);
    sum->cost += cost;
    sum->budget += budget;
  }
  void query_all(WorkSample* sum) {
    for (const Work kind : {Work::overlap, Work::overlap_empty, Work::overlap_large})
      query_overlaps(kind, sum);
    for (const bool is_long : {false, true}) {
      for (const Way way : {Way::any, Way::axis, Way::grazing, Way::empty})
        query_sweeps(way, is_long, false, sum);
      query_sweeps(Way::any, is_long, true, sum);
    }
  }
  void query_few(WorkSample& sum) {
    query_overlaps(Work::overlap, &sum);
    query_overlaps(Work::overlap_empty, &sum);
    query_sweeps(Way::any, false, false, &sum);
    query_sweeps(Way::any, true, false, &sum);
  }

  const WorkScene& scene_;
  Random random_;
  WorkReport report_;
  BroadPhase broad_{options(Backend::automatic)};
  std::vector<Box> now_, rest_boxes_;  // by id; rest_boxes_: the box around which an object moves
  std::vector<double> degree_;         // pairs of each object as of the last update
  std::vector<ObjectId> alive_;        // sorted
  Change change_;
  double changed_ = 0;
};

}  // namespace

const char* to_string(Work work) noexcept { return names[static_cast<int>(work)]; }

WorkReport measure_work(const WorkScene& scene) { return Measure(scene).run(); }

}  // namespace throng::tests
