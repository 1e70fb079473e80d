#include "bench/worlds.hpp"

#include <algorithm>
#include <atomic>

#include "bench/crew.hpp"

namespace throng::bench {
namespace {

class PerWorld : public Contender {
 public:
  PerWorld(const Entry& entry, unsigned threads) : crew_(threads) {
    for (unsigned t = 0; t < crew_.size(); ++t) hands_.push_back({entry.make(1), {}, 0});
  }

  void run(const Input& in) override {
    sort(in);
    next_ = 0;
    crew_.run([&](unsigned t) {
      Hand& hand = hands_[t];
      hand.pairs.clear();
      for (std::size_t w; (w = next_.fetch_add(1)) + 1 < start_.size();) {
        const std::size_t begin = start_[w], count = start_[w + 1] - begin;
        if (count < 2) continue;
        const Input one{boxes_.data() + begin, count};
        if (hand.prepared != count) hand.contender->prepare(one);
        hand.prepared = count;
        hand.contender->place(one);
        hand.contender->run(one);
        const std::size_t first = hand.pairs.size();
        hand.contender->collect(one, hand.pairs);
        for (std::size_t k = first; k < hand.pairs.size(); ++k)
          hand.pairs[k] =
              ordered(id_[begin + hand.pairs[k].first], id_[begin + hand.pairs[k].second]);
      }
    });
  }
  void collect(const Input&, std::vector<Pair>& out) const override {
    for (const Hand& hand : hands_) out.insert(out.end(), hand.pairs.begin(), hand.pairs.end());
  }

 private:
  struct alignas(128) Hand {
    std::unique_ptr<Contender> contender;
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

  Crew crew_;
  std::vector<Hand> hands_;
  std::vector<Box> boxes_;
  std::vector<std::uint32_t> id_;
  std::vector<std::size_t> start_, fill_;
  std::atomic<std::size_t> next_{0};
};

}  // namespace

Entry one_world_at_a_time(const Entry& entry) {
  Entry e = entry;
  e.parallel = true;
  e.note = entry.note + "; one search a world, worlds dealt to the threads";
  e.make = [entry](unsigned threads) { return std::make_unique<PerWorld>(entry, threads); };
  return e;
}

}  // namespace throng::bench
