#include "apps/stream/pair_output.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include <throng/checksum.hpp>

namespace throng::stream {
namespace {

using Clock = std::chrono::steady_clock;

// In a merge each run has at least this many keys in memory.
constexpr std::size_t min_keys = 512;
constexpr std::size_t block_pairs = 4096;

class Timer {
 public:
  explicit Timer(double& ms) : ms_(ms) {}
  ~Timer() { ms_ += std::chrono::duration<double, std::milli>(Clock::now() - start_).count(); }
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

 private:
  double& ms_;
  Clock::time_point start_ = Clock::now();
};

}  // namespace

PairOutput::PairOutput(const std::string& path, std::size_t run_keys, Scratch& scratch)
    : path_(path), scratch_(scratch), keys_(run_keys) {
  if (run_keys != 0) waiting_.resize(scratch.extent_bytes());
}
PairOutput::~PairOutput() = default;

void PairOutput::write(const Pair* pairs, std::size_t count) {
  if (keys_.empty()) {
    const std::uint64_t checksum = pair_checksum(pairs, count);
    const std::lock_guard<std::mutex> lock(mutex_);
    totals_.checksum += checksum;
    deliver(pairs, count);
    return;
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  for (std::size_t i = 0; i < count; ++i) {
    if (key_count_ == keys_.size()) spill();
    keys_[key_count_++] = std::uint64_t{pairs[i].first} << 32 | pairs[i].second;
  }
}

void PairOutput::deliver(const Pair* pairs, std::size_t count) {
  totals_.count += count;
  if (path_.empty()) return;
  if (!writer_) writer_ = std::make_unique<scenes::PairWriter>(path_);
  writer_->write(pairs, count);
}

PairOutput::Mark PairOutput::mark() const noexcept {
  return {writer_ ? writer_->count() : 0, totals_};
}

void PairOutput::rewind(const Mark& mark) {
  if (!keys_.empty()) return;
  totals_ = mark.totals;
  if (writer_) writer_->truncate(mark.written);
}

void PairOutput::spill() {
  const Timer timer(order_ms_);
  std::sort(keys_.begin(), keys_.begin() + static_cast<std::ptrdiff_t>(key_count_));
  const auto add_run = [&](const auto& fill) {
    Part run(scratch_, sizeof(std::uint64_t));
    run.begin(waiting_.data());
    fill([&](std::uint64_t key) { run.add(reinterpret_cast<const char*>(&key)); });
    run.seal();
    runs_.push_back(std::move(run));
  };
  add_run([&](const auto& add) {
    for (std::size_t i = 0; i < key_count_; ++i) add(keys_[i]);
  });
  key_count_ = 0;
  const std::size_t max_runs = std::clamp<std::size_t>(keys_.size() / min_keys, 2, 256);
  if (runs_.size() < max_runs) return;
  std::vector<Part> merged = std::exchange(runs_, {});
  add_run([&](const auto& add) { merge(merged, add); });
}

// Calls take(key) for the keys of all runs in order, without duplicates. The runs are read through
// the memory of keys_.
template <class Take>
void PairOutput::merge(std::vector<Part>& runs, const Take& take) {
  struct RunCursor {
    std::uint64_t key;
    std::size_t run;
    bool operator<(const RunCursor& other) const noexcept {
      return key > other.key;
    }  // the smallest on top
  };
  struct Reader {
    std::uint64_t next = 0;        // in the run
    std::size_t at = 0, here = 0;  // in memory
  };
  const std::size_t keys_per_run = keys_.size() / runs.size();
  std::vector<Reader> readers(runs.size());
  std::vector<RunCursor> cursors;
  const auto push = [&](std::size_t r) {
    Reader& reader = readers[r];
    std::uint64_t* keys = keys_.data() + r * keys_per_run;
    if (reader.at == reader.here) {
      const std::uint64_t left = runs[r].count() - reader.next;
      if (left == 0) return;
      reader.here = static_cast<std::size_t>(std::min<std::uint64_t>(left, keys_per_run));
      reader.at = 0;
      runs[r].read(reader.next, reader.here, reinterpret_cast<char*>(keys));
      reader.next += reader.here;
    }
    cursors.push_back({keys[reader.at++], r});
    std::push_heap(cursors.begin(), cursors.end());
  };
  for (std::size_t r = 0; r < runs.size(); ++r) push(r);
  bool any = false;
  std::uint64_t before = 0;
  while (!cursors.empty()) {
    std::pop_heap(cursors.begin(), cursors.end());
    const RunCursor head = cursors.back();
    cursors.pop_back();
    if (!any || head.key != before) take(head.key);
    any = true;
    before = head.key;
    push(head.run);
  }
}

PairTotals PairOutput::finish_frame() {
  if (!keys_.empty()) {
    if (key_count_ != 0 || runs_.empty()) spill();
    const Timer timer(order_ms_);
    Pair block[block_pairs];
    std::size_t count = 0;
    const auto flush = [&] {
      totals_.checksum += pair_checksum(block, count);
      deliver(block, count);
      count = 0;
    };
    std::vector<Part> runs = std::exchange(runs_, {});
    merge(runs, [&](std::uint64_t key) {
      block[count++] = {static_cast<std::uint32_t>(key >> 32), static_cast<std::uint32_t>(key)};
      if (count == block_pairs) flush();
    });
    flush();
  }
  return std::exchange(totals_, {});
}

void PairOutput::finish() {
  if (path_.empty()) return;
  deliver(nullptr, 0);  // an empty result is a file, too
  writer_->finish();
  writer_.reset();
}

}  // namespace throng::stream
