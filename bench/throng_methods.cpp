#include "bench/throng_methods.hpp"

#include "apps/common/failure.hpp"
#include "apps/common/failure_text.hpp"

namespace throng::bench {
namespace {

enum class Form {
  warmed,  // one Finder that keeps its memory
  cold,    // a new Finder each time
  vector,  // find_pairs, which returns a new vector
};

class Throng : public Method {
 public:
  Throng(const Options& options, Form form) : options_(options), form_(form), finder_(options) {}

  void place(const Input&) override {
    if (form_ == Form::cold) finder_ = Finder(options_);
  }
  void run(const Input& in) override {
    Boxes boxes(in.boxes, in.count);
    if (in.worlds) boxes.filters.world = {in.worlds, in.count};
    if (form_ == Form::vector) {
      pairs_ = find_pairs(boxes, options_);
      result_.found = pairs_.size();
      return;
    }
    result_ = finder_.find(boxes);
    if (!result_.ok()) throw common::Failure(common::failure_text(result_, {}));
  }
  void collect(const Input&, std::vector<Pair>& out) const override {
    if (form_ == Form::vector) {
      out.insert(out.end(), pairs_.begin(), pairs_.end());
    } else {
      const Pairs pairs = finder_.pairs();
      out.insert(out.end(), pairs.begin(), pairs.end());
    }
  }
  const Result& result() const { return result_; }

 private:
  Options options_;
  Form form_;
  Finder finder_;
  std::vector<Pair> pairs_;
  Result result_;
};

MethodInfo method(const std::string& name, const std::string& note, Options options,
                  Form form = Form::warmed) {
  return {name, note, "", Origin::throng, true, [options, form](unsigned threads) {
            Options o = options;
            o.backend = Backend::cpu;  // the other libraries have no other
            o.threads = threads;
            return std::make_unique<Throng>(o, form);
          }};
}

bool supported(Isa isa) {
  Options o;
  o.isa = isa;
  const Box box{{0, 0, 0}, {1, 1, 1}};
  Finder finder(o);
  return finder.find(Boxes(&box, 1)).ok();
}

}  // namespace

std::vector<MethodInfo> throng_methods(bool isas) {
  Options automatic, canonical, all_pairs, grid;
  canonical.order = Order::canonical;
  all_pairs.algorithm = Algorithm::all_pairs;
  grid.algorithm = Algorithm::grid;
  std::vector<MethodInfo> all = {
      method(throng_name, "unsorted, a new plan each frame, a warmed Finder", automatic),
      method("Throng, sorted", "order = canonical: by first, then second", canonical),
      method("Throng, grid", "algorithm = grid", grid),
      method("Throng, all pairs", "algorithm = all_pairs; small n only", all_pairs),
      method("Throng, cold", "a new Finder each time", automatic, Form::cold),
      method("Throng, find_pairs", "returns a new vector each time", automatic, Form::vector)};
  if (!isas) return all;
  for (const Isa isa : all_isas) {
    if (!supported(isa)) continue;
    Options o;
    o.isa = isa;
    all.push_back(method(std::string("Throng, ") + to_string(isa), "the instruction set given", o));
  }
  return all;
}

std::optional<Result> throng_result(const Method& method) {
  const auto* throng = dynamic_cast<const Throng*>(&method);
  return throng ? std::optional<Result>(throng->result()) : std::nullopt;
}

}  // namespace throng::bench
