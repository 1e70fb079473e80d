#include "support/oracle.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <map>

namespace throng::tests {
namespace {

constexpr Pair guard{0x12345678, 0x9abcdef0};

Result find(Finder& finder, const Case& c) {
  return c.two_sets ? finder.find(c.first(), c.second()) : finder.find(c.first());
}

}  // namespace

std::string describe(const Case& c) {
  std::ostringstream out;
  out << c.shape << ", " << c.a.size() << (c.two_sets ? " and " : "");
  if (c.two_sets) out << c.b.size();
  out << " boxes, filters " << c.filters_a << '/' << c.filters_b << ", margin " << c.margin
      << ", cell_scale " << c.cell_scale;
  return out.str();
}

Oracle::Oracle() : configs_(all_configs()), finders_(configs_.size()), reached_(configs_.size()) {}

void Oracle::begin(const Case& c) {
  drop_large();
  ++totals.cases;
  refused_ = c.is_refused();
  nan_ = {};
  for (const Boxes& boxes : {c.first(), c.two_sets ? c.second() : Boxes()}) {
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const Box box = boxes[i];
      const float* const x = &box.lower.x;
      if (std::none_of(x, x + 6, [](float f) { return std::isnan(f); })) continue;
      if (nan_.count++ == 0) nan_.first = i;
    }
  }
  if (!refused_) expected_.run(c.first(), c.second(), c.two_sets, c.margin);
}

void Oracle::drop_large() {
  constexpr std::size_t kept_pairs = std::size_t{1} << 20;
  if (expected_.pairs().capacity() > kept_pairs) expected_ = VectorizedReference();
  if (out_.capacity() > kept_pairs) out_ = std::vector<Pair>();
}

void Oracle::require(bool good, const Config& config, const std::string& what) const {
  if (!good) throw Difference(config.name() + ": " + what);
}

// Checks all result fields of a call that wanted all pairs.
void Oracle::check(const Result& r, const Config& config) const {
  require(r.ok(), config, r.message);
  require(r.found == expected_.pairs().size() && r.written == r.found, config,
          "found " + std::to_string(r.found) + " of " + std::to_string(expected_.pairs().size()) +
              ", wrote " + std::to_string(r.written));
  require(r.inactive == expected_.inactive(), config, "inactive boxes miscounted");
  require(r.first_invalid == 0 && r.invalid_count == 0 && r.bytes_needed == 0, config,
          "a successful search reported invalid boxes or missing memory");
  require(r.message[0] == 0, config, r.message);
}

void Oracle::compare(const Case& c, const Config& config, const Pair* got, std::size_t count) {
  const std::string wrong = expected_.compare(got, count, config.order == Order::canonical);
  require(wrong.empty(), config, wrong);
  ++totals.searches;
  totals.boxes += c.size();
  totals.pairs += count;
}

void Oracle::search(const Case& c, std::size_t at, std::uint32_t choice) {
  const Config& config = configs_[at];
  Finder& finder = finders_[at];
  Options options = config.options();
  options.nan = c.nan;
  options.margin = c.margin;
  options.cell_scale = c.cell_scale;
  finder.set_options(options);
  if (refused_) {
    const Result r = find(finder, c);
    require(r.status == Status::nan_box, config, "a NaN was not refused");
    require(r.found == 0 && r.written == 0 && finder.pairs().empty(), config,
            "pairs despite a NaN");
    require(r.first_invalid == nan_.first && r.invalid_count == nan_.count, config,
            std::to_string(r.invalid_count) + " boxes with a NaN, the first " +
                std::to_string(r.first_invalid) + ", not " + std::to_string(nan_.count) + " and " +
                std::to_string(nan_.first));
    return;
  }
  switch (choice % 4) {
    case 0:
      buffer(c, finder, config, choice / 4);
      break;
    case 1: {
      out_.clear();
      const auto take = [&](const Pair* pairs, std::size_t count) {
        out_.insert(out_.end(), pairs, pairs + count);
        return true;
      };
      const Result r = c.two_sets ? finder.consume(c.first(), c.second(), take)
                                  : finder.consume(c.first(), take);
      check(r, config);
      compare(c, config, out_.data(), out_.size());
      break;
    }
    default: {
      const Result r = find(finder, c);
      check(r, config);
      compare(c, config, finder.pairs().data(), finder.pairs().size());
      break;
    }
  }
  if (finder.memory_bytes() > std::size_t{4} << 20) finder = Finder();
  const unsigned filters = c.filters_a | (c.two_sets ? c.filters_b : 0);
  ++reached_[at][0];
  if (c.two_sets) ++reached_[at][1];
  for (unsigned k = 0; k < 5; ++k)
    if (filters >> k & 1) ++reached_[at][2 + k];
  if (c.margin > 0) ++reached_[at][7];
  if (c.cell_scale != 1) ++reached_[at][8];
}

std::string Oracle::table() const {
  std::map<std::string, std::array<std::uint64_t, 9>> rows;
  for (std::size_t k = 0; k < configs_.size(); ++k) {
    const Config& c = configs_[k];
    Config plain = c;
    plain.threads = c.threads > 1 ? 2 : c.threads;
    std::string name = plain.name();
    name = name.substr(0, name.rfind('_'));  // either order
    if (name.back() == '2') name.back() = 'n';
    for (std::size_t i = 0; i < 9; ++i) rows[name][i] += reached_[k][i];
  }
  std::ostringstream out;
  out << "algorithm_set_threads       searches  two sets     group      mask     owner     world"
         "    static    margin     cells\n";
  for (const auto& [name, counts] : rows) {
    out << std::left << std::setw(26) << name << std::right;
    for (const std::uint64_t count : counts) out << std::setw(10) << count;
    out << '\n';
  }
  return out.str();
}

// Buffer capacities from none to slightly too large, with a guard after the end.
void Oracle::buffer(const Case& c, Finder& finder, const Config& config,
                    std::uint32_t capacity_choice) {
  const std::size_t total = expected_.pairs().size();
  const std::size_t capacity = capacity_choice % 4 == 0   ? total
                               : capacity_choice % 4 == 1 ? total + 1
                                                          : capacity_choice / 4 % (total + 1);
  out_.assign(capacity + 8, guard);
  const Result r = c.two_sets ? finder.find(c.first(), c.second(), out_.data(), capacity)
                              : finder.find(c.first(), out_.data(), capacity);
  require(r.found == total, config,
          "found " + std::to_string(r.found) + " of " + std::to_string(total));
  require(r.inactive == expected_.inactive(), config, "inactive boxes miscounted");
  require(r.status == (capacity >= total ? Status::ok : Status::buffer_too_small), config,
          std::string("status ") + to_string(r.status));
  const std::size_t written = r.ok() ? total : config.order == Order::canonical ? 0 : capacity;
  require(r.written == written, config,
          "wrote " + std::to_string(r.written) + " with capacity " + std::to_string(capacity));
  for (std::size_t i = capacity; i < out_.size(); ++i)
    require(out_[i] == guard, config, "wrote past the end");
  if (r.ok()) {
    compare(c, config, out_.data(), r.written);
    return;
  }
  // A partial result holds correct pairs, each once.
  out_.resize(r.written);
  std::sort(out_.begin(), out_.end());
  require(std::adjacent_find(out_.begin(), out_.end()) == out_.end(), config, "a duplicate pair");
  require(
      std::includes(expected_.pairs().begin(), expected_.pairs().end(), out_.begin(), out_.end()),
      config, "wrote an extra pair");
}

}  // namespace throng::tests
