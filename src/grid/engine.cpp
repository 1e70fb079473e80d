#include "grid/engine.hpp"

#include <algorithm>

#include "base/parallel_region.hpp"
#include "base/profile.hpp"
#include "base/threads.hpp"
#include "grid/engine_call.hpp"
#include "grid/plan/filter_planning.hpp"
#include "grid/plan/make_plan.hpp"
#include "grid/steps.hpp"
#include "grid/sweep/sweep_columns.hpp"

namespace throng::grid {
namespace {

// The boxes of a search as one problem.
Problem whole_problem(const Search& search) noexcept {
  const auto side = [](const Boxes& b) {
    return BoxSubset{&b, nullptr, static_cast<std::uint32_t>(b.size())};
  };
  Problem whole;
  whole.queries = side(*search.a);
  whole.targets = search.two_sets ? side(*search.b) : BoxSubset{search.b, nullptr, 0};
  whole.self = !search.two_sets;
  return whole;
}

}  // namespace

Engine::Engine(std::pmr::memory_resource* memory, std::size_t already_held) noexcept
    : memory_(memory, already_held),
      rounded_(memory_),
      filter_classes_(memory_),
      grid_(memory_),
      partition_(memory_),
      sorter_(memory_),
      spill_(memory_),
      pairs_(memory_),
      unordered_(memory_),
      ordered_(memory_),
      workers_(memory_) {}

// Computes the float boxes that replace boxes of doubles in the search.
void Engine::round(Call& call) {
  THRONG_RANGE("round");
  Search& search = call.search;
  const Doubles& doubles = call.doubles;
  const std::size_t of_a = doubles.a->size();
  Box* out = rounded_.ensure(static_cast<std::size_t>(box_count(search)), memory_.cap() != 0);
  const DoubleVec3 origin = choose_origin(doubles);
  const auto fill = [&](const DoubleBoxes& boxes, Box* to, Boxes& rounded) {
    round_to_floats(boxes, origin, doubles.margin, *search.executor, call.tasks, to);
    rounded = Boxes(to, boxes.size());
    rounded.filters = boxes.filters;
  };
  fill(*doubles.a, out, call.rounded[0]);
  if (search.two_sets) fill(*doubles.b, out + of_a, call.rounded[1]);
  search.doubles = &doubles;
  search.margin = 0;  // already applied
  search.flat = doubles.is_flat();
  call.result.times.bin_ms = call.clock.lap();
}

std::array<Candidate, 4> Engine::candidates(const Boxes& a, const Boxes* b,
                                            const Options& options) const {
  Search search;
  search.a = &a;
  search.b = b ? b : &a;
  search.two_sets = b != nullptr;
  search.margin = options.margin;
  const Stats stats = sample_stats(search, whole_problem(search));
  const SweepCost& sweep_cost = *find_kernels(options.isa)->sweep_cost;
  const auto grid = [&](std::uint32_t axis) {
    const Candidate cheapest = cheapest_grid(stats, sweep_cost, axis);
    return options.cell_scale == 1
               ? cheapest
               : scaled(cheapest, stats, sweep_cost, double{options.cell_scale});
  };
  return {brute_force(stats, sweep_cost), grid(0), grid(1), grid(2)};
}

Job Engine::job_of(Call& call) {
  return {call.search, call.problem, call.plan, {workers_.make(call.tasks), call.tasks}};
}

// All steps before the first pair: partition, plan, binning, NaN check.
void Engine::prepare(Call& call) {
  THRONG_RANGE("plan and bin");
  Search& search = call.search;
  BinReport report;
  Worker* const* workers = workers_.make(call.tasks);
  for (unsigned t = 0; t < call.tasks; ++t) workers[t]->begin(search);
  call.problem = whole_problem(search);
  if (search.two_sets && box_count(search) <= max_box_count)
    call.problem.target_id_offset = search.target_id_offset = call.problem.queries.count;
  call.partitioned = !plan_with_filters(search, call.problem, call.options.algorithm, call.tasks,
                                        filter_classes_, call.plan);
  Result& r = call.result;
  has_grid_ = false;
  if (call.partitioned) {
    partition_.split(search, report);
    r.times.plan_ms = call.clock.lap();
    r.plan.algorithm =
        call.options.algorithm == Algorithm::all_pairs ? Algorithm::all_pairs : Algorithm::grid;
    r.plan.reason = "one problem per world, static boxes separate, a plan for each";
  } else {
    r.times.plan_ms = call.clock.lap();
    r.plan.algorithm = call.plan.all_pairs ? Algorithm::all_pairs : Algorithm::grid;
    r.plan.sweep_axis = call.plan.sweep_axis;
    std::copy(call.plan.map.columns, call.plan.map.columns + 3, r.plan.columns);
    r.plan.expected_ns = call.plan.expected_ns;
    r.plan.reason = call.plan.reason;
    report = bin(job_of(call), grid_);
    has_grid_ = !call.plan.all_pairs;
    grid_plan_ = call.plan;
  }
  r.times.bin_ms += call.clock.lap();
  r.inactive = report.inactive;
  if (!search.failed() && report.nan_count && call.options.nan == NanPolicy::refuse) {
    r.first_invalid = report.first_nan;
    r.invalid_count = report.nan_count;
    r.inactive -= report.nan_count;
    nan_in_b_ = report.nan_in_targets;
    search.fail(Status::nan_box, 0);
  }
}

// Finds all pairs once.
void Engine::pass(Call& call, Sink& sink) {
  THRONG_RANGE("find");
  Search& search = call.search;
  search.sink = &sink;
  if (search.pair_test) search.pair_test->restart();
  Worker* const* workers = workers_.make(call.tasks);
  for (unsigned t = 0; t < call.tasks; ++t) workers[t]->begin(search);
  if (call.partitioned)
    solve_partition(call);
  else
    sweep(job_of(call), grid_);
  for (unsigned t = 0; t < call.tasks; ++t) {
    if (!search.failed()) workers[t]->finish();
    call.result.comparisons += workers[t]->comparisons;
    call.result.visited += workers[t]->visited;
  }
  if (!memory_.cap()) workers_.match(call.tasks);
  call.result.times.find_ms += call.clock.lap();
}

void Engine::solve_partition(Call& call) {
  Search& search = call.search;
  Worker* const* workers = workers_.make(call.tasks);
  base::AtomicCounter turns(partition_.problem_count());
  const auto is_large = [&](const Problem& p) {
    return call.tasks > 1 && static_cast<double>(box_count(p)) >= base::cost.team_boxes;
  };
  auto task = [&](unsigned t) {
    search.guarded([&] {
      for (std::uint64_t i; turns.take(i) && !search.over();) {
        const Problem& p = partition_.problem(static_cast<std::uint32_t>(i));
        if (is_large(p)) continue;
        solve_on_one_worker(search, p, make_plan(search, p, call.options.algorithm), *workers[t],
                            1);
      }
    });
  };
  base::run_tasks(*search.executor, call.tasks, task);
  for (std::uint32_t i = 0; i < partition_.problem_count() && !search.over(); ++i) {
    const Problem& p = partition_.problem(i);
    if (!is_large(p)) continue;
    const GridPlan plan = make_plan(search, p, call.options.algorithm);
    const Job job{search, p, plan, {workers, call.tasks}};
    bin(job, grid_);
    if (!search.failed()) sweep(job, grid_);
  }
}

// Estimates and allocates output memory first, which saves a counting pass. If that allocation
// fails, the count decides.
void Engine::reserve_output(Call& call, Output& output) {
  const std::uint64_t most = 8 * box_count(call.search);
  std::size_t guess = static_cast<std::size_t>(std::min<std::uint64_t>(most, few_pairs));
  Worker& worker = *workers_.make(call.tasks)[0];
  if (has_grid_)
    guess = std::max(guess, estimate_pair_count(job_of(call), grid_));
  else if (call.partitioned)
    guess = std::max(guess,
                     partition_.estimate_pair_count(call.search, call.options.algorithm, worker));
  call.result.comparisons += worker.comparisons;
  call.result.visited += worker.visited;
  if (guess == 0 || call.search.over()) return;
  if (Pair* const pairs = output.grow(output.context, guess)) {
    output.data = pairs;
    output.capacity = guess;
  }
}

void Engine::find_into(Call& call, Output& output) {
  if (output.capacity == 0 && output.grow) reserve_output(call, output);
  for (;;) {
    const std::size_t spill = BufferSink::spill_for(call.tasks, output.capacity);
    BufferSink sink(output.data, output.capacity, spill_.ensure(spill, true), spill);
    pass(call, sink);
    sink.close();
    call.result.found = sink.found();
    call.result.written = sink.written();
    if (call.search.failed() || sink.found() <= output.capacity) return;
    if (!output.grow) {
      call.result.status = Status::buffer_too_small;
      return;
    }
    if (!output.grow_to(sink.found())) throw base::AllocationFailed{sink.found() * sizeof(Pair)};
  }
}

Result Engine::find(const Boxes& a, const Boxes* b, const Options& options, Output* output,
                    const Consumer* consumer, PairTest* pair_test) {
  Call call(options);
  call.search.pair_test = pair_test;
  return find(call, a, b, output, consumer);
}

Result Engine::find(const DoubleBoxes& a, const DoubleBoxes* b, const Options& options,
                    Output* output, const Consumer* consumer) {
  Call call(options);
  call.doubles = {&a, b ? b : &a, options.margin};
  call.rounded[0] = Boxes(nullptr, a.size());
  if (b) call.rounded[1] = Boxes(nullptr, b->size());
  return find(call, call.rounded[0], b ? &call.rounded[1] : nullptr, output, consumer);
}

Result Engine::find(Call& call, const Boxes& a, const Boxes* b, Output* output,
                    const Consumer* consumer) {
  THRONG_RANGE("search");
  const Options& options = call.options;
  Result& r = call.result;
  Search& search = call.search;
  search.a = &a;
  search.b = b ? b : &a;
  search.two_sets = b != nullptr;
  search.margin = options.margin;
  search.cell_scale = options.cell_scale;
  search.flat = a.is_flat() && search.b->is_flat();
  search.kernels = find_kernels(options.isa);
  search.executor = &base::executor_of(options);
  search.memory = &memory_;
  search.stop = options.stop;
  memory_.set_cap(consumer ? options.memory_cap_bytes : 0);
  Clock total(true);
  const std::uint64_t boxes = box_count(search);
  call.tasks = threads_for(boxes, options);
  r.plan.isa = search.kernels->isa;
  r.plan.threads = call.tasks;
  r.plan.reason = "";
  base::ParallelRegion::run(*search.executor, call.tasks, [&](const Executor& region) {
    search.executor = &region;
    search.guarded([&] {
      if (search.over()) return;
      if (call.doubles.a) round(call);
      prepare(call);
      if (search.over()) return;
      const bool in_order = options.order == Order::canonical;
      if (consumer)
        in_order ? consume_sorted(call, *consumer) : consume(call, *consumer);
      else
        in_order ? find_sorted(call, *output) : find_into(call, *output);
    });
  });
  if (search.failed()) {
    r.status = search.status();
    r.bytes_needed = search.bytes();
    if (r.status == Status::memory_cap_too_small) {
      // If the estimate was not enough, doubles the cap, so that a caller's retries end.
      const std::uint64_t cap = options.memory_cap_bytes, enough = sufficient_bytes(call);
      r.bytes_needed = std::max(search.bytes(), cap < enough ? enough : 2 * cap);
    }
    r.found = 0;
    // Pairs that a consumer received before memory ran out count as written.
    if (!consumer || r.status == Status::stopped) r.written = 0;
  }
  r.times.total_ms = total.lap();
  return r;
}

}  // namespace throng::grid
