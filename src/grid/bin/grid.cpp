#include "grid/bin/grid.hpp"

#include <algorithm>
#include <cstring>
#include <memory>
#include <numeric>

#include "base/sse2.hpp"
#include "base/threads.hpp"
#include "grid/emit/worker.hpp"

namespace throng::grid {
namespace {

constexpr std::uint32_t block_batch = 8;
// A task's write buffers for all columns.
constexpr std::size_t bin_buffer_bytes = std::size_t{1} << 20;

// The first column of each box's world; boxes in every world take the slow path.
void column_offsets_of(const Strided<std::int32_t>& worlds, std::size_t begin, std::uint32_t count,
                       std::uint32_t columns, std::uint32_t* column_offsets) noexcept {
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::int32_t world = worlds ? worlds[begin + i] : -1;
    column_offsets[i] = world < 0 ? needs_slow_path : static_cast<std::uint32_t>(world) * columns;
  }
}

// Writes the last records of a column to its block.
inline void flush_buffer(const BinTask& task, std::uint32_t column) {
  const std::uintptr_t end = task.tail[column];
  if (end == 0) return;
  const std::size_t bytes = ((end - 1) & task.buffer_mask()) + 1;
  std::memcpy(reinterpret_cast<void*>(end - bytes), task.buffer(column), bytes);
}

// A record as two 64-bit words, to modify it in registers: narrow stores would block store
// forwarding to the wide load that follows.
struct RecordWords {
  std::uint64_t low, high;  // lower 0, 1, 2, upper 0; upper 1, 2, id
  explicit RecordWords(const Record& r) { std::memcpy(this, &r, sizeof r); }
  // The box begins in an earlier column on the axis.
  void begins_before(int axis, bool before) {
    low &= ~(std::uint64_t{before ? 0xffffu : 0u} << (16 * axis));
  }
  // The box ends in a later column on the axis.
  void ends_after(int axis, bool after) {
    const std::uint64_t ones = after ? base::max_quantized : 0u;
    low |= axis == 0 ? ones << 48 : 0;
    high |= axis == 1 ? ones : (axis == 2 ? ones << 16 : 0);
  }
};
static_assert(sizeof(RecordWords) == sizeof(Record));

inline void append(BinTask& task, std::uint32_t column, const RecordWords& r) {
  if (task.buffers && (task.tail[column] & task.buffer_mask()) == 0) flush_buffer(task, column);
  const std::uintptr_t to = task.next_slot(column);
  char* const written =
      task.buffers ? task.buffer(column) + (to & task.buffer_mask()) : reinterpret_cast<char*>(to);
  std::memcpy(written, &r, sizeof r);
  task.tail[column] = to + sizeof r;
}

}  // namespace

BinnedGrid::BinnedGrid(base::Memory& memory) noexcept
    : pool_(memory),
      regions_(memory),
      tails_(memory),
      order_(memory),
      sizes_(memory),
      wide_{base::Buffer<WideBox>(memory), base::Buffer<WideBox>(memory)} {}

void BinnedGrid::match(const BinnedGrid& other) {
  pool_.match(other.pool_);
  regions_.match(other.regions_);
  tails_.match(other.tails_);
  order_.match(other.order_);
  sizes_.match(other.sizes_);
  for (int side = 0; side < 2; ++side) wide_[side].match(other.wide_[side]);
}

std::uintptr_t BinTask::next_block(std::uint32_t column) {
  return grid->start_block(*this, column);
}

std::uintptr_t BinnedGrid::start_block(BinTask& task, std::uint32_t column) {
  if (task.next_free == task.free_end) {
    const std::uintptr_t blocks = take_blocks(task.task);
    task.next_free = blocks ? blocks : task.dummy;
    task.free_end = task.next_free + block_batch * (blocks ? block_bytes_ : 1);
  }
  if (pool_exhausted_.load(std::memory_order_relaxed) &&
      task.next_free - task.dummy < block_batch) {
    ++task.next_free;
    return task.dummy + sizeof(Block);
  }
  const std::uintptr_t block = task.next_free;
  task.next_free += block_bytes_;
  Block header{0, 0};
  if (const std::uintptr_t tail = task.tail[column]) {
    header.previous = block_of(tail);
    header.before = reinterpret_cast<const Block*>(header.previous)->before + records_per_block();
  }
  std::memcpy(task.buffers ? task.buffer(column) : reinterpret_cast<char*>(block), &header,
              sizeof header);
  return block + sizeof(Block);
}

std::uintptr_t BinnedGrid::take_blocks(unsigned task) noexcept {
  const std::size_t each = pool_blocks_ / tasks_ / block_batch * block_batch;
  for (unsigned k = 0; k < tasks_; ++k) {
    const unsigned r = (task + k) % tasks_;
    std::atomic<std::size_t>& used = regions_[r].used;
    if (used.load(std::memory_order_relaxed) >= each) continue;
    const std::size_t at = used.fetch_add(block_batch, std::memory_order_relaxed);
    if (at < each) return pool_begin_ + (r * each + at) * block_bytes_;
  }
  // Continues counting, so that the next attempt allocates enough; these writes are discarded.
  regions_[task].used.fetch_add(block_batch, std::memory_order_relaxed);
  pool_exhausted_.store(true, std::memory_order_relaxed);
  return 0;
}

// log2 of the bytes per buffer. Longer buffers are full less often, which is an unpredictable
// branch; but those of all columns have to stay in the L2 cache. 0: no buffers.
unsigned BinnedGrid::choose_buffers(const Search& search, double records) const noexcept {
  constexpr unsigned least = 6, most = 8;
  if (search.kernels->isa == Isa::scalar || search.memory->cap()) return 0;
  if (records * sizeof(Record) < search.stream_bytes) return 0;
  for (unsigned bits = most; bits >= least; --bits) {
    if (std::size_t{columns_} << bits <= bin_buffer_bytes && block_bytes_ >> bits != 0) return bits;
  }
  return 0;
}

void BinnedGrid::prepare(const Job& job, std::size_t boxes) {
  const GridPlan& plan = job.plan;
  columns_ = plan.column_count();
  tasks_ = static_cast<unsigned>(job.team.size());
  const double records = static_cast<double>(boxes) * plan.replicas * 1.05;
  const double per_chain = records / (static_cast<double>(columns_) * tasks_);
  // About four blocks per chain: the last of each is half empty.
  block_bytes_ = 32768;
  const double chain_bytes = per_chain * sizeof(Record);
  const std::uintptr_t least_bytes = plan.worlds == 1 ? 512 : (chain_bytes < 128 ? 64 : 128);
  while (block_bytes_ > least_bytes && static_cast<double>(block_bytes_ * 4) > chain_bytes) {
    block_bytes_ /= 2;
  }
  const std::size_t chains = std::size_t{columns_} * tasks_;
  const std::size_t blocks =
      static_cast<std::size_t>(records / static_cast<double>(records_per_block())) +
      std::min(chains, boxes) + 2 * block_batch * tasks_ + 1;
  buffer_bits_ = choose_buffers(job.search, records);
  char* base = pool_.ensure((blocks + 1) * block_bytes_, true);
  pool_begin_ = (reinterpret_cast<std::uintptr_t>(base) + block_bytes_ - 1) & ~(block_bytes_ - 1);
  pool_blocks_ =
      (pool_.capacity() - (pool_begin_ - reinterpret_cast<std::uintptr_t>(base))) / block_bytes_;
  regions_.ensure(tasks_, true);
  for (unsigned t = 0; t < tasks_; ++t) std::construct_at(&regions_[t]);
  pool_exhausted_ = false;
  wide_count_[0] = wide_count_[1] = 0;
  tails_.ensure(chains * 2);
}

BinReport BinnedGrid::bin(const Job& job) {
  Search& search = job.search;
  const Problem& problem = job.problem;
  const double replicas = job.plan.replicas;
  const auto task_count = static_cast<unsigned>(job.team.size());
  // Under a tight cap the first attempt only counts, so that no byte beyond the need is allocated.
  std::size_t expected = static_cast<std::size_t>(box_count(problem));
  const double expected_bytes = static_cast<double>(expected) * replicas * sizeof(Record);
  if (search.memory->cap() && static_cast<double>(search.memory->cap()) < 3 * expected_bytes)
    expected = 0;
  for (;;) {
    prepare(job, expected);
    base::Mutex merge;
    BinReport total;
    base::ChunkQueue shares[2] = {{problem.queries.count, task_count, bin_tile},
                                  {problem.targets.count, task_count, bin_tile}};
    auto task = [&](unsigned t) {
      search.guarded([&] {
        BinReport mine;
        for (unsigned side = 0; side < 2; ++side) bin_side(job, side, t, shares[side], mine);
        const std::lock_guard<base::Mutex> lock(merge);
        total.add(mine);
      });
    };
    base::run_tasks(*search.executor, task_count, task);
    used_blocks_ = 0;
    for (unsigned t = 0; t < task_count; ++t) used_blocks_ += regions_[t].used;
    if (search.failed()) return {};
    if (!pool_exhausted_) return total;
    // More replicas than estimated. The number of blocks needed is known now.
    const std::size_t wanted = used_blocks_ + std::size_t{block_batch} * task_count;
    expected =
        static_cast<std::size_t>(static_cast<double>(wanted) *
                                 static_cast<double>(block_bytes_ / sizeof(Record)) / replicas) +
        1;
  }
}

void BinnedGrid::bin_side(const Job& job, unsigned side, unsigned t, base::ChunkQueue& shares,
                          BinReport& report) {
  Search& search = job.search;
  const GridPlan& plan = job.plan;
  Worker& worker = *job.team[t];
  const BoxSubset& subset = job.problem.subset(side);
  const std::uint32_t id_offset = job.problem.id_offset(side);
  BinTask& task = worker.bin;
  task.grid = this;
  task.task = t;
  task.block_mask = block_bytes_ - 1;
  if (side == 0) task.next_free = task.free_end = 0;
  task.tail = tails(t, side);
  std::memset(task.tail, 0, columns_ * sizeof(std::uintptr_t));
  const std::uintptr_t dummy =
      reinterpret_cast<std::uintptr_t>(worker.dummy_block.ensure(2 * block_bytes_, true));
  task.dummy = (dummy + block_bytes_ - 1) & ~(block_bytes_ - 1);
  task.buffer_bits = buffer_bits_;
  task.buffers = nullptr;
  if (buffer_bits_ != 0) task.buffers = worker.bin_buffers.ensure(bin_buffer_bytes, true);

  const Boxes& boxes = *subset.boxes;
  // The kernels read whole groups and slightly beyond. Strides below a box and the last boxes are
  // copied out.
  const bool apart = boxes.stride_bytes() >= sizeof(Box);
  const char* packed = apart && !subset.ids && search.margin == 0 ? boxes.packed_data() : nullptr;
  const std::size_t safe = boxes.size() == 0 ? 0 : (boxes.size() - 1) / bin_group * bin_group;
  const bool flat = search.flat;
  const std::uint32_t* names = subset.labels ? subset.labels : subset.ids;
  alignas(64) float tile[bin_tile * 6 + 1];
  alignas(64) std::uint32_t column_offsets[bin_tile + 16] = {};  // with padding
  task.column_offset = task.column_offset.of(plan.worlds > 1 ? column_offsets : nullptr);
  // A chunk ends with a tile, unless it is the last; a tile ends before the copied boxes.
  std::size_t begin, end;
  while (!search.over() && shares.take(t, begin, end)) {
    for (std::uint32_t at = static_cast<std::uint32_t>(begin), count = 0; at < end; at += count) {
      count = std::min(bin_tile, static_cast<std::uint32_t>(end) - at);
      if (packed && at < safe)
        count = static_cast<std::uint32_t>(std::min<std::size_t>(count, safe - at));
      if (task.column_offset)
        column_offsets_of(boxes.filters.world, at, count, plan.map.column_count(), column_offsets);
      if (packed && at < safe) {
        bin_tile_of(job, side,
                    {packed + at * boxes.stride_bytes(), boxes.stride_bytes(), count, nullptr,
                     at + id_offset},
                    task, report);
        continue;
      }
      for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t id = subset.id(at + i);
        Box box = boxes[id];
        if (search.margin != 0 && base::is_active(box)) box = base::expand(box, search.margin);
        if (flat) {
          // All boxes overlap in z; different quantized coordinates avoid the float test.
          box.lower.z = box.lower.z - 1;
          box.upper.z = box.upper.z + 1;
        }
        std::memcpy(tile + 6 * i, &box, sizeof box);
      }
      bin_tile_of(job, side,
                  {reinterpret_cast<const char*>(tile), sizeof(Box), count,
                   names ? names + at : nullptr, at + id_offset},
                  task, report);
    }
  }
  if (task.buffers) {
    for (std::uint32_t column = 0; column < columns_; ++column) flush_buffer(task, column);
    base::fence_streaming_stores();
  }
}

void BinnedGrid::bin_tile_of(const Job& job, unsigned side, const BinInput& tile, BinTask& task,
                             BinReport& report) {
  job.search.kernels->bin(job.plan.map, tile, task);
  for (std::uint32_t o = 0; o < task.deferred_count; ++o) {
    const std::uint32_t i = task.deferred[o];
    Box box;
    std::memcpy(&box, tile.boxes + i * tile.stride, sizeof box);
    if (base::is_active(box)) {
      bin_spanning(job.plan.map, task, side, box, task.first_column_record[i],
                   task.column_offset ? task.column_offset[i] : 0);
    } else {
      report.add_inactive(task.first_column_record[i].id - job.problem.id_offset(side),
                          base::has_nan(box), side == 1);
    }
  }
}

void BinnedGrid::bin_spanning(const base::Quantizer& map, BinTask& task, unsigned side,
                              const Box& box, const Record& record, std::uint32_t column_offset) {
  const float corner[6] = {box.lower.x, box.lower.y, box.lower.z,
                           box.upper.x, box.upper.y, box.upper.z};
  std::int32_t lower[3], upper[3], from[3], to[3];
  std::uint64_t touched = 1;
  for (int k = 0; k < 3; ++k) {
    lower[k] = base::quantize(map, k, corner[k]);
    upper[k] = base::quantize(map, k, corner[k + 3]);
    from[k] = base::column_of(lower[k]);
    to[k] = base::column_of(upper[k]);
    touched *= static_cast<std::uint64_t>(to[k] - from[k] + 1);
  }
  // Stored separately and swept over each of its columns: see sweep/column_search.cpp.
  if (static_cast<double>(touched) > base::cost.wide_columns || column_offset >= max_columns) {
    WideBox wide;
    wide.id = record.id;
    wide.column_offset = column_offset;
    std::copy(lower, lower + 3, wide.lower);
    std::copy(upper, upper + 3, wide.upper);
    const std::lock_guard<base::Mutex> lock(wide_mutex_);
    const std::uint32_t count = wide_count_[side];
    wide_[side].grow(count + 1, count)[count] = wide;
    wide_count_[side] = count + 1;
    return;
  }
  const RecordWords whole(record);
  for (std::int32_t x = from[0]; x <= to[0]; ++x) {
    RecordWords in_x = whole;
    in_x.begins_before(0, x > from[0]);
    in_x.ends_after(0, x < to[0]);
    for (std::int32_t y = from[1]; y <= to[1]; ++y) {
      RecordWords in_y = in_x;
      in_y.begins_before(1, y > from[1]);
      in_y.ends_after(1, y < to[1]);
      for (std::int32_t z = from[2]; z <= to[2]; ++z) {
        RecordWords in_z = in_y;
        in_z.begins_before(2, z > from[2]);
        in_z.ends_after(2, z < to[2]);
        append(task,
               column_offset + static_cast<std::uint32_t>(x) * map.stride[0] +
                   static_cast<std::uint32_t>(y) * map.stride[1] +
                   static_cast<std::uint32_t>(z) * map.stride[2],
               in_z);
      }
    }
  }
}

std::span<const std::uint32_t> BinnedGrid::count_records() {
  std::uint32_t* const sizes = sizes_.ensure(columns_);
  for (std::uint32_t c = 0; c < columns_; ++c) {
    std::uint64_t size = 0;
    for (unsigned chain = 0; chain < 2 * tasks_; ++chain) {
      const std::uintptr_t tail = tails_[std::size_t{chain} * columns_ + c];
      if (tail == 0) continue;
      const std::uintptr_t block = block_of(tail);
      size += reinterpret_cast<const Block*>(block)->before +
              (tail - block - sizeof(Block)) / sizeof(Record);
    }
    sizes[c] = static_cast<std::uint32_t>(std::min<std::uint64_t>(size, 0xffffffffu));
  }
  return {sizes, columns_};
}

std::span<const std::uint32_t> BinnedGrid::largest_first() {
  const std::span<const std::uint32_t> sizes = count_records();
  const std::uint64_t total = std::accumulate(sizes.begin(), sizes.end(), std::uint64_t{0});
  const std::uint32_t most = *std::max_element(sizes.begin(), sizes.end());
  if (most < 2 * (total / columns_ + 1)) return {};
  std::uint32_t* order = order_.ensure(columns_);
  std::size_t count = 0;
  for (std::uint32_t c = 0; c < columns_; ++c) {
    order[count] = c;
    count += sizes[c] != 0;
  }
  std::sort(order, order + count,
            [sizes](std::uint32_t x, std::uint32_t y) { return sizes[x] > sizes[y]; });
  return {order, count};
}

}  // namespace throng::grid
