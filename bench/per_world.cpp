#include "bench/per_world.hpp"

#include <algorithm>
#include <atomic>

#include "bench/competitors/thread_pool.hpp"

namespace throng::bench {
namespace {

class PerWorld : public Method {
 public:
  PerWorld(const MethodInfo& method, unsigned threads) : pool_(threads) {
    for (unsigned t = 0; t < pool_.size(); ++t) workers_.push_back({method.make(1), {}, 0});
  }

  void run(const Input& in) override {
    sort(in);
    next_ = 0;
    pool_.run([&](unsigned t) {
      Worker& worker = workers_[t];
      worker.pairs.clear();
      for (std::size_t w; (w = next_.fetch_add(1)) + 1 < start_.size();) {
        const std::size_t begin = start_[w], count = start_[w + 1] - begin;
        if (count < 2) continue;
        const Input one{boxes_.data() + begin, count};
        if (worker.prepared != count) worker.method->prepare(one);
        worker.prepared = count;
        worker.method->place(one);
        worker.method->run(one);
        const std::size_t first = worker.pairs.size();
        worker.method->collect(one, worker.pairs);
        for (std::size_t k = first; k < worker.pairs.size(); ++k)
          worker.pairs[k] =
              ordered(id_[begin + worker.pairs[k].first], id_[begin + worker.pairs[k].second]);
      }
    });
  }
  void collect(const Input&, std::vector<Pair>& out) const override {
    for (const Worker& worker : workers_)
      out.insert(out.end(), worker.pairs.begin(), worker.pairs.end());
  }

 private:
  struct alignas(128) Worker {
    std::unique_ptr<Method> method;
    std::vector<Pair> pairs;
    std::size_t prepared;
  };

  void sort(const Input& in) {
    std::int32_t last = 0;
    for (std::size_t i = 0; i < in.count; ++i) last = std::max(last, in.worlds[i]);
    start_.assign(static_cast<std::size_t>(last) + 2, 0);
    for (std::size_t i = 0; i < in.count; ++i) ++start_[static_cast<std::size_t>(in.worlds[i]) + 1];
    for (std::size_t w = 1; w < start_.size(); ++w) start_[w] += start_[w - 1];
    fill_ = start_;
    boxes_.resize(in.count);
    id_.resize(in.count);
    for (std::size_t i = 0; i < in.count; ++i) {
      const std::size_t at = fill_[static_cast<std::size_t>(in.worlds[i])]++;
      boxes_[at] = in.boxes[i];
      id_[at] = static_cast<std::uint32_t>(i);
    }
  }

  ThreadPool pool_;
  std::vector<Worker> workers_;
  std::vector<Box> boxes_;
  std::vector<std::uint32_t> id_;
  std::vector<std::size_t> start_, fill_;
  std::atomic<std::size_t> next_{0};
};

}  // namespace

MethodInfo one_world_at_a_time(const MethodInfo& method) {
  MethodInfo e = method;
  e.parallel = true;
  e.note = method.note + "; one search per world, worlds distributed over the threads";
  e.make = [method](unsigned threads) { return std::make_unique<PerWorld>(method, threads); };
  return e;
}

}  // namespace throng::bench
