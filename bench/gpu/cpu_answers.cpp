#include <stdexcept>

#include <throng/checksum.hpp>
#include <throng/throng.hpp>

#include "bench/gpu/session.hpp"

namespace throng::bench::gpu {

void answer_by_cpu(const Case& c, unsigned threads, Answers& answers) {
  FrameMaker maker(c);
  Options options;
  options.backend = Backend::cpu;
  options.threads = threads;
  options.nan = NanPolicy::inactive;  // as find_async treats them
  Finder finder(options);
  for (std::size_t f = 0; f < c.frames; ++f) {
    Boxes boxes(maker.frame(f), c.objects);
    if (!maker.worlds().empty())
      boxes.filters.world = {maker.worlds().data(), maker.worlds().size()};
    Answer answer;
    // No pair is stored: 100M boxes have 1.6 GB of them.
    const Result r = finder.consume(boxes, [&](const Pair* pairs, std::size_t count) {
      answer.checksum += pair_checksum(pairs, count);
      return true;
    });
    if (!r.ok()) throw std::runtime_error(c.label + ": " + r.message);
    answer.pairs = r.found;
    answers.add(c.label, c.objects, f, answer);
  }
}

}  // namespace throng::bench::gpu
