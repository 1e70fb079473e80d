// Small worlds (environments) whose boxes are contiguous, as in simulations of many similar
// environments: every world is searched by brute force, directly in the caller's boxes. Whether the
// boxes are of this kind is determined on the device. If they are not, the grid is built; if they
// are, its launches do nothing.
#pragma once

#include <cstdint>

#include "base/bounds.hpp"
#include "device/atomic.hpp"
#include "device/binning.hpp"
#include "device/input.hpp"
#include "device/search.hpp"

namespace throng::device {

struct WorldsReport {
  std::uint32_t grid_wanted;  // not 0: the boxes are not of this kind
  std::uint32_t everywhere;   // boxes of world -1, which come before all others
};

// Resets the reports before InspectWorlds.
struct ResetWorldsReport {
  WorldsReport* worlds_report;
  Report* report;
  THRONG_HD void operator()(std::uint64_t) const noexcept {
    *worlds_report = WorldsReport{};
    *report = Report{};
  }
};

// Compares a box with later boxes of its own world and with those of all worlds.
struct WorldSearch {
  static constexpr std::uint32_t max_in_world = 512, max_everywhere = 32;

  Input in;
  const WorldsReport* worlds_report;
  FirstRange range;
  Report* report = nullptr;  // null: inactive boxes have been reported

  THRONG_HD std::uint64_t count() const noexcept {
    return worlds_report->grid_wanted ? 0 : in.count;
  }

  // If `to` is not null, a box that takes no part is reported there.
  THRONG_HD Box box(std::uint32_t i, Report* to = nullptr) const noexcept {
    Box box;
    bool nan;
    if (read_box(in, i, box, nan)) return box;
    if (to) report_inactive(*to, i, nan);
    return no_box();
  }
  // The searching box, which is read once, and so reported once.
  THRONG_HD Box own_box(std::uint32_t i) const noexcept { return box(i, report); }
  // Whether some overlapping pairs of one world, or with a box of all worlds, must not be reported.
  THRONG_HD bool selects() const noexcept {
    return in.has_pair_filters || (in.present & base::static_bit) || !range.holds_all();
  }
  // Whether such a pair is to be reported.
  THRONG_HD bool allows(std::uint32_t i, std::uint32_t j) const noexcept {
    return in.allowed(i, j) && range.holds(in.pair(i, j).first);
  }

  // For a single thread.
  class Walk {
   public:
    THRONG_HD Walk(const WorldSearch& search, std::uint64_t i) noexcept
        : s_(search),
          own_(static_cast<std::uint32_t>(i)),
          at_(own_),
          world_(s_.in.world(own_)),
          box_(s_.own_box(own_)) {
      advance();
    }
    THRONG_HD bool over() const noexcept { return over_; }
    THRONG_HD std::uint32_t comparisons() const noexcept { return comparisons_; }
    THRONG_HD bool step(Pair& pair) noexcept {
      const std::uint32_t j = at_;
      ++comparisons_;
      advance();
      if (!base::overlaps(box_, s_.box(j)) || !s_.allows(own_, j)) return false;
      pair = s_.in.pair(own_, j);
      return true;
    }

   private:
    THRONG_HD void advance() noexcept {
      ++at_;
      if (at_ > own_) {
        if (at_ < s_.in.count && s_.in.world(at_) == world_) return;
        at_ = 0;
      }
      over_ = world_ < 0 || at_ >= s_.worlds_report->everywhere;
    }

    const WorldSearch& s_;
    std::uint32_t own_, at_, comparisons_ = 0;
    std::int32_t world_;
    bool over_ = false;
    Box box_;
  };
  THRONG_HD Walk begin(std::uint64_t i) const noexcept { return Walk(*this, i); }
};

// Checks whether worlds come in ascending order with few boxes each. Reports bad worlds, and
// inactive boxes unless the search reports them.
struct InspectWorlds {
  Input in;
  WorldsReport* worlds_report;
  Report* report;
  bool report_boxes;

  THRONG_HD void operator()(std::uint64_t index) const noexcept {
    const auto i = static_cast<std::uint32_t>(index);
    const bool last = i + 1 == in.count;
    // All loads are in flight at once.
    const auto world_after = [&](std::uint32_t boxes) {
      return in.world(in.count - i > boxes ? i + boxes : in.count - 1);
    };
    constexpr std::uint32_t few = WorldSearch::max_everywhere, many = WorldSearch::max_in_world;
    const std::int32_t world = in.world(i), next = world_after(1);
    const std::int32_t after_few = world_after(few), after_many = world_after(many);
    if (report_boxes) {
      Box box;
      bool nan;
      if (!read_box(in, i, box, nan)) report_inactive(*report, i, nan);
    }
    report_bad_world(in, *report, i);
    const bool too_many = world < 0 ? in.count - i > few && after_few == world
                                    : in.count - i > many && after_many == world;
    if (next < world || too_many) set_flag(&worlds_report->grid_wanted);
    if (world < 0 && (last || next >= 0)) fetch_max(&worlds_report->everywhere, i + 1);
  }
};

}  // namespace throng::device
