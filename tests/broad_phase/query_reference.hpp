// Expected results of BroadPhase queries, by a loop over the model's objects: overlaps by the
// reference comparison, sweeps by the formula in the header.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include <throng/cuda_broad_phase.hpp>

#include "broad_phase/model.hpp"

namespace throng::tests {

inline Item item_of(const Box& box, const Filter& f) {
  Boxes one(&box, 1);
  one.filters = {{&f.group, 1}, {&f.mask, 1}, {&f.owner, 1}, {&f.world, 1}, {&f.is_static, 1}};
  return read_items(one, 0)[0];
}

// One value of each filter per element.
inline Filters view_of(const std::vector<Filter>& f) {
  const std::size_t n = f.size(), stride = sizeof(Filter);
  if (n == 0) return {};
  return {{&f[0].group, n, stride},
          {&f[0].mask, n, stride},
          {&f[0].owner, n, stride},
          {&f[0].world, n, stride},
          {&f[0].is_static, n, stride}};
}

// A BroadPhaseQuery with the query interface of a BroadPhase.
struct QueryClient {
  const BroadPhase& objects;
  BroadPhaseQuery& query;

  Result find_overlaps(const Boxes& boxes) { return query.find_overlaps(objects, boxes); }
  Pairs overlaps() const { return query.overlaps(); }
  Result find_hits(const Sweep* sweeps, std::size_t count, SweepHits which, const Filters& filters,
                   const SweepTest& test = {}) {
    return query.find_hits(objects, sweeps, count, which, filters, test);
  }
  SweepHitList hits() const { return query.hits(); }
};

template <class Queryable>
testing::AssertionResult same_overlaps(Queryable& b, const Model& model,
                                       const std::vector<Box>& boxes,
                                       const std::vector<Filter>& filters, bool filtered) {
  Boxes view = boxes;
  if (filtered) view.filters = view_of(filters);
  std::vector<Pair> want;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Item a = item_of(boxes[i], filtered ? filters[i] : Filter{});
    for (const ObjectId id : model.ids()) {
      const Item o = item_of(model.at(id).box, model.at(id).filter);
      if (a.active && o.active && !disjoint(a, o) && wanted(a, o))
        want.push_back({static_cast<std::uint32_t>(i), id});
    }
  }
  const Result r = b.find_overlaps(view);
  if (!r.ok()) return testing::AssertionFailure() << r.message;
  const std::vector<Pair> got = to_vector(b.overlaps());
  if (testing::AssertionResult checked = Model::check_query(r, got.size()); !checked)
    return checked;
  if (!std::is_sorted(got.begin(), got.end())) return testing::AssertionFailure() << "not sorted";
  return same_pairs(got, want);
}

// As the header defines it.
inline bool meets(const Sweep& s, const Box& b, double& time) {
  const float sl[3] = {s.box.lower.x, s.box.lower.y, s.box.lower.z};
  const float su[3] = {s.box.upper.x, s.box.upper.y, s.box.upper.z};
  const float bl[3] = {b.lower.x, b.lower.y, b.lower.z}, bu[3] = {b.upper.x, b.upper.y, b.upper.z};
  const float by[3] = {s.by.x, s.by.y, s.by.z};
  double from = 0, to = 1;
  for (int k = 0; k < 3; ++k) {
    if (!(sl[k] <= su[k] && bl[k] <= bu[k])) return false;
    if (by[k] == 0) {
      if (su[k] < bl[k] || bu[k] < sl[k]) return false;
      continue;
    }
    const double d = by[k], p = (double(bl[k]) - double(su[k])) / d,
                 q = (double(bu[k]) - double(sl[k])) / d;
    from = std::fmax(from, d > 0 ? p : q);  // fmax, fmin: a NaN is no bound
    to = std::fmin(to, d > 0 ? q : p);
  }
  time = from;
  return from <= to;
}

template <class Queryable>
testing::AssertionResult same_hits(Queryable& b, const Model& model,
                                   const std::vector<Sweep>& sweeps,
                                   const std::vector<Filter>& filters, const SweepTest& test = {}) {
  std::vector<SweepHit> all, first;
  for (std::size_t i = 0; i < sweeps.size(); ++i) {
    SweepHit best{0, 0, 2};
    for (const ObjectId id : model.ids()) {
      const Model::Object& o = model.at(id);
      double time = 0;
      if (!meets(sweeps[i], o.box, time)) continue;
      if (!wanted(item_of(sweeps[i].box, filters[i]), item_of(o.box, o.filter))) continue;
      const auto number = static_cast<std::uint32_t>(i);
      if (test.when) {
        const double exact_time = test.when(test.context, number, id, time);
        if (std::isnan(exact_time) || exact_time > 1) continue;
        time = std::fmax(time, exact_time);
      }
      all.push_back({number, id, time});
      if (time < best.time) best = all.back();
    }
    if (best.time < 2) first.push_back(best);
  }
  const auto same = [](const SweepHitList& got, const std::vector<SweepHit>& want) {
    return std::equal(got.begin(), got.end(), want.begin(), want.end(),
                      [](const SweepHit& x, const SweepHit& y) {
                        return x.sweep == y.sweep && x.object == y.object && x.time == y.time;
                      });
  };
  for (const SweepHits which : {SweepHits::all, SweepHits::first}) {
    const Result r = b.find_hits(sweeps.data(), sweeps.size(), which, view_of(filters), test);
    if (!r.ok()) return testing::AssertionFailure() << r.message;
    const std::vector<SweepHit>& want = which == SweepHits::all ? all : first;
    if (testing::AssertionResult checked = Model::check_query(r, b.hits().size()); !checked)
      return checked;
    if (!same(b.hits(), want))
      return testing::AssertionFailure() << (which == SweepHits::all ? "all: " : "first: ")
                                         << b.hits().size() << " hits instead of " << want.size();
  }
  return testing::AssertionSuccess();
}

// Random queries from an actor.
struct RandomQueries {
  std::vector<Box> boxes;
  std::vector<Sweep> sweeps;
  std::vector<Filter> filters;

  template <class Actor>
  RandomQueries(Actor& actor, std::size_t count, bool filtered) {
    for (std::size_t i = 0; i < count; ++i) {
      boxes.push_back(actor.any_box());
      sweeps.push_back(actor.any_sweep());
      filters.push_back(filtered ? actor.any_filter() : Filter{});
    }
  }
};

template <class Queryable>
testing::AssertionResult same_answers(Queryable& queried, const Model& model,
                                      const RandomQueries& q, const SweepTest& test = {}) {
  if (auto r = same_overlaps(queried, model, q.boxes, q.filters, true); !r) return r;
  return same_hits(queried, model, q.sweeps, q.filters, test);
}

// First hits at the index of their sweep, in the layout of the GPU.
inline std::vector<SweepHit> gpu_layout(const SweepHitList& firsts, std::size_t count) {
  std::vector<SweepHit> hits;
  for (std::uint32_t i = 0; i < count; ++i)
    hits.push_back({i, cuda::no_object, std::numeric_limits<double>::infinity()});
  for (const SweepHit& hit : firsts) hits[hit.sweep] = hit;
  return hits;
}

}  // namespace throng::tests
