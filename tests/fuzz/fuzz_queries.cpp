// Queries of a BroadPhase of hard boxes: overlap queries against the double loop of two sets, shape
// casts against the formula of the header.
#include "broad_phase/query_reference.hpp"
#include "fuzz/target.hpp"
#include "support/cases.hpp"
#include "support/vectorized_reference.hpp"

namespace throng::tests {
namespace {

void must(bool good, const std::string& what) {
  if (!good) throw Difference(what);
}

Filter filter_of(const Set& set, unsigned filters, std::size_t i) {
  Filter f;
  if (filters & with_group) f.group = set.group[i];
  if (filters & with_mask) f.mask = set.mask[i];
  if (filters & with_owner) f.owner = set.owner[i];
  if (filters & with_world) f.world = set.world[i];
  if (filters & with_static) f.is_static = set.is_static[i];
  return f;
}

float speed(Bytes& bytes) {
  const std::uint32_t b = bytes.next();
  constexpr float values[] = {0, 1, -1, 0.1f, 1e-30f, -1e30f, denormal, 1e6f};
  return b < 160 ? (static_cast<float>(b) - 80) * 0.25f : values[b % 8];
}

}  // namespace

void run(Bytes& bytes) {
  Case c = make_case(bytes, 300);
  c.nan = NanPolicy::inactive;
  Options options;
  options.threads = 1;
  options.nan = NanPolicy::inactive;
  BroadPhase phase(options);
  Model model;
  std::vector<ObjectId> ids(c.a.size());
  must(phase.add(c.first(), ids.data()).ok(), "the objects were refused");
  for (std::size_t i = 0; i < ids.size(); ++i)
    must(bool(model.add(ids[i], c.a.boxes[i], filter_of(c.a, c.filters_a, i))), "a wrong id");
  // With cells and without: an update that finds few changes builds them.
  if (bytes.next() & 1) must(phase.update().ok(), "an update failed");
  const Set& queries = c.two_sets ? c.b : c.a;
  const unsigned filters = c.two_sets ? c.filters_b : c.filters_a;
  VectorizedReference loop;
  loop.run(queries.view(filters), c.first(), true, 0);
  const Result r = phase.find_overlaps(queries.view(filters));
  must(r.ok() && r.found == loop.pairs().size(), "wrong number of overlaps");
  const std::string wrong = loop.compare(phase.overlaps().data(), phase.overlaps().size(), true);
  must(wrong.empty(), wrong);

  std::vector<Sweep> sweeps;
  std::vector<Filter> sweep_filters;
  for (std::size_t i = 0; i < queries.size() && sweeps.size() < 16; ++i) {
    const Box& box = queries.boxes[i];
    Sweep s{box, {speed(bytes), speed(bytes), speed(bytes)}};
    bool nan = false;
    for (int k = 0; k < 6; ++k) nan = nan || std::isnan((&s.box.lower.x)[k]);
    if (nan) continue;
    sweeps.push_back(s);
    sweep_filters.push_back(filter_of(queries, filters, i));
  }
  if (sweeps.empty()) return;
  const testing::AssertionResult same = same_hits(phase, model, sweeps, sweep_filters);
  must(bool(same), same.message());
}

}  // namespace throng::tests
