// Finds the pairs of row sources of any size in a given amount of memory.
#pragma once

#include <cstdint>
#include <functional>
#include <memory_resource>
#include <string>
#include <vector>

#include <throng/finder.hpp>

#include "apps/stream/pair_output.hpp"
#include "apps/stream/rows.hpp"
#include "apps/stream/scratch.hpp"
#include "apps/stream/split.hpp"

namespace throng::stream {

struct SolverSizes {
  std::size_t arena_bytes = 0;   // for rows in memory
  std::size_t finder_bytes = 0;  // for the library
  std::size_t sample_rows = 0;
};

// A problem that fits into the arena is searched. A larger one is cut into slabs along the best
// axis (split.hpp), each a smaller problem. Where no cut helps, as for boxes in one place, it is
// processed in blocks, each with itself and all later ones, without geometry. A search that exceeds
// the library's share of memory is repeated in halves.
class Solver {
 public:
  // How rows in memory are searched: Finder::consume, or a test's substitute. b may be null.
  using Search = std::function<Result(Finder&, const Boxes& a, const Boxes* b, Consumer)>;

  Solver(const SolverSizes& sizes, const Options& options, Scratch& scratch, PairOutput& output,
         std::function<void(double)> progress, Search search = consume);

  struct Problem {
    Source* side[2] = {};
    const Layout* layout[2] = {};
    bool self = true;  // pairs within side[0]
    std::string name;  // for messages
  };
  struct InputCounts {  // of both sides
    std::uint64_t inactive = 0, comparisons = 0, visited = 0;
  };
  // Writes a frame's pairs to the output. The sides may hold inactive boxes and NaN.
  InputCounts solve_frame(const Problem& problem);

  std::uint64_t searches() const noexcept { return searches_; }
  std::uint64_t slabs() const noexcept { return slabs_; }
  const throng::Plan& plan() const noexcept { return plan_; }
  double search_ms() const noexcept { return search_ms_; }

 private:
  // The order of the two ids of a pair.
  enum class PairOrder { by_index, as_found, swapped };
  struct Lists;  // of a problem that was cut

  static Result consume(Finder& finder, const Boxes& a, const Boxes* b, Consumer consumer) {
    return b ? finder.consume(a, *b, consumer) : finder.consume(a, consumer);
  }
  void solve(const Problem& problem, int depth);
  void divide(const Problem& problem, const Split& split, int depth);
  void distribute(const Problem& problem, int side, const Split& split, Lists& lists);
  void slab(const Problem& problem, const Split& split, Lists& lists, int s, int depth);
  void solve_in_blocks(const Problem& problem);
  Split choose(const Problem& problem);
  std::uint64_t rows_of(const Problem& problem) const;
  bool fits(const Problem& problem, std::size_t bytes) const;
  Rows load(Source& source, const Layout& layout, std::uint64_t first, std::size_t count,
            std::size_t at);
  // Searches `here`, in the first `used` bytes of the arena, against all rows of `source`. With a
  // split: only those that can overlap slab s.
  void search_against(Rows here, std::size_t used, Source& source, const Layout& layout,
                      PairOrder pair_order, const Split* split, int s, std::uint64_t first = 0);
  void search(const Rows& a, const Rows* b, PairOrder pair_order);
  bool try_search(const Rows& a, const Rows* b, PairOrder pair_order, Result& result);
  void advance(double work);

  SolverSizes sizes_;
  Options options_;
  bool refuses_inverted_;
  Scratch& scratch_;
  PairOutput& output_;
  std::function<void(double)> progress_;
  Search search_;
  std::pmr::vector<char> arena_;
  std::size_t owned_bytes_limit_;  // of the arena: the limit for a slab's owned rows
  Finder finder_;
  std::string name_;
  InputCounts counts_;
  std::uint64_t searches_ = 0, slabs_ = 0;
  throng::Plan plan_;
  double search_ms_ = 0;
  double work_done_ = 0, work_ = 0;  // in rows, weighted
  double reported_progress_ = 0;
};

}  // namespace throng::stream
