#include "apps/throng/search_options.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <throng/cuda.hpp>

#include "apps/common/numbers.hpp"
#include "apps/throng/failure.hpp"

namespace throng::cli {
namespace {

void add_filters(CLI::App& app, FilterFiles& files, const std::string& suffix, const char* set) {
  const auto add = [&](const char* name, std::string& file, const char* what) {
    app.add_option(name + suffix, file, what)
        ->type_name("FILE.npy")
        ->group(fmt::format("Filters, one value for each box of {}", set));
  };
  add("--group", files.group, "uint32: each box's group must share a bit with the other's mask");
  add("--mask", files.mask, "uint32: see --group");
  add("--owner", files.owner, "int32: equal owners never pair, -1: no owner");
  add("--world", files.world, "int32: different worlds never pair, -1: in every world");
  add("--static", files.is_static, "uint8: two nonzero never pair");
}

}  // namespace

void InputArguments::require_no_filters_b() const {
  const FilterFiles& f = filters_b;
  if (!(f.group + f.mask + f.owner + f.world + f.is_static).empty()) {
    throw Failure("found a filter that ends in -b, wanted a second file of boxes for it");
  }
}

void add_input_arguments(CLI::App& app, InputArguments& arguments) {
  app.add_option("A", arguments.a,
                 "boxes: float32 of shape (n, 6) or (frames, n, 6), min then max; 2-D: 4 for 6")
      ->required()
      ->type_name("FILE.npy");
  app.add_option("B", arguments.b, "a second set: pairs of a box of A and a box of B")
      ->type_name("FILE.npy");
  add_filters(app, arguments.filters_a, "", "A");
  add_filters(app, arguments.filters_b, "-b", "B");
  app.add_option_function<std::string>(
         "--nan", [&](const std::string& v) { arguments.nan_inactive = v == "inactive"; },
         "a box with a NaN: refuse (the default), or inactive: it overlaps nothing")
      ->check(CLI::IsMember({"refuse", "inactive"}).description(""))
      ->type_name("refuse|inactive");
  app.add_option_function<std::string>(
         "--round", [&](const std::string& v) { arguments.round_outward = v == "outward"; },
         "outward: take float64 boxes, rounded outward to float32")
      ->check(CLI::IsMember({"outward"}).description(""))
      ->type_name("outward");
  app.add_option_function<std::string>("--margin", common::margin_into(arguments.margin),
                                       "grow every box by this much on each side")
      ->type_name("M");
}

void add_threads(CLI::App& app, unsigned& threads) {
  app.add_option_function<std::string>("--threads", common::threads_into(threads),
                                       "maximum number; 0: all")
      ->type_name("N");
}

void add_search_arguments(CLI::App& app, SearchArguments& arguments, AutoBackend auto_backend) {
  const auto add = [&](const char* name, std::string& value, std::vector<std::string> choices,
                       const char* what) {
    std::string type;
    for (const std::string& choice : choices) type += (type.empty() ? "" : "|") + choice;
    app.add_option(name, value, what)
        ->check(CLI::IsMember(choices).description(""))  // the type's name already says it
        ->type_name(type);
  };
  if (auto_backend == AutoBackend::cpu_only)
    add("--backend", arguments.backend, {"auto", "cpu"}, "the CPU, whatever is given");
  else
    add("--backend", arguments.backend, {"auto", "cpu", "cuda", "emulated"},
        auto_backend == AutoBackend::cpu
            ? "where to search; auto: the CPU; cuda: a GPU; emulated: the GPU pipeline on the CPU"
            : "where to search; auto: the CPU, or a GPU where it is faster; emulated: the GPU "
              "pipeline on the CPU");
  add("--algorithm", arguments.algorithm, {"auto", "all-pairs", "grid"},
      "auto chooses by measured properties of the boxes");
  add("--order", arguments.order, {"any", "canonical"},
      "canonical: sorted by first, then second; the same bytes everywhere");
  add("--isa", arguments.isa, {"auto", "scalar", "sse4", "avx2", "avx512", "neon"},
      "instruction set; auto: the widest available");
  add_threads(app, arguments.threads);
}

common::HintOptions to_hint_options(const SearchArguments& search) {
  return {.nan = true,
          .inverted = true,
          .backend = true,
          .isa = search.isa == "auto" ? "" : search.isa};
}

Options to_options(const InputArguments& input, const SearchArguments& search) {
  Options options;
  options.backend = search.backend == "cuda"       ? Backend::cuda
                    : search.backend == "emulated" ? Backend::emulated
                    : search.backend == "cpu"      ? Backend::cpu
                                                   : Backend::automatic;
  if (options.backend == Backend::cuda) {
    const Result result = cuda::available();
    if (!result.ok()) {
      throw Failure(
          fmt::format("--backend cuda: {}", common::failure_text(result, to_hint_options(search))));
    }
  }
  options.algorithm = search.algorithm == "all-pairs" ? Algorithm::all_pairs
                      : search.algorithm == "grid"    ? Algorithm::grid
                                                      : Algorithm::automatic;
  options.order = search.order == "canonical" ? Order::canonical : Order::any;
  options.nan = input.nan_inactive ? NanPolicy::inactive : NanPolicy::refuse;
  options.inverted = input.refuses_inverted ? InvertedPolicy::refuse : InvertedPolicy::inactive;
  for (const Isa isa : all_isas)
    if (search.isa == to_string(isa)) options.isa = isa;
  options.margin = input.margin;
  options.threads = search.threads;
  return options;
}

}  // namespace throng::cli
