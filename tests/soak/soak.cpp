// throng-soak: random scenes and operations, each compared with a reference, for a given time.
// Prints how many boxes and pairs were compared. Stops at the first difference, minimizes its case
// and writes it as a test ready to compile, boxes as .npy and its input bytes.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>

#include "apps/scenes/npy.hpp"
#include "broad_phase/call_sequence.hpp"
#include "support/minimize.hpp"
#include "support/oracle.hpp"

namespace throng::tests {
namespace {

using Clock = std::chrono::steady_clock;

struct SoakOptions {
  double seconds = 3600;
  std::uint64_t boxes = ~std::uint64_t{0}, rounds = ~std::uint64_t{0}, seed = 1;
  bool emulated = false;  // only the emulated device
  bool many = false;      // only scenes of up to 30,000 boxes: many columns, wide boxes
  bool twice = false;     // repeats the same rounds, which must not hold more memory
  double report_seconds = 60;
  std::string folder = ".", minimize;
};

// Resident memory; 0 if /proc does not report it.
double resident_mib() {
  std::ifstream status("/proc/self/status");
  for (std::string name; status >> name;) {
    double kib = 0;
    if (name == "VmRSS:" && status >> kib) return kib / 1024;
  }
  return 0;
}

void save(const std::string& path, const void* data, std::size_t size) {
  std::ofstream(path, std::ios::binary)
      .write(static_cast<const char*>(data), static_cast<std::streamsize>(size));
  std::printf("  wrote %s\n", path.c_str());
}

// Maximum sizes of cases. Mostly small ones, as the double loop is expensive.
constexpr std::size_t tiny = 300, small = 4000, medium = 8000, large = 30000;

// Whether a configuration differs from the double loop in any form of search.
bool differs(Oracle& oracle, const Case& c, std::size_t config) {
  try {
    oracle.begin(c);
    for (std::uint32_t form = 0; form < 3; ++form) oracle.search(c, config, form);
  } catch (const Difference&) {
    return true;
  }
  return false;
}

// Minimizes the failing case and writes files.
void report_case(const std::string& folder, const Case& found, std::size_t config) {
  Oracle oracle;
  const auto fails = [&](const Case& c) { return differs(oracle, c, config); };
  if (!fails(found)) {
    std::printf("  not reproducible with new Finders: the failure depends on their state\n");
    return;
  }
  const Case c = minimize_case(found, fails);
  const std::string test = as_test(c, oracle.configs()[config], "Minimized");
  std::printf("%s", test.c_str());
  save(folder + "/difference_test.cpp", test.data(), test.size());
  const auto write = [&](const std::string& name, const Set& set) {
    const std::string path = folder + "/difference_" + name + ".npy";
    scenes::write_boxes(path, set.boxes.data(), 1, set.size());
    std::printf("  wrote %s: throng check %s\n", path.c_str(), path.c_str());
  };
  write("a", c.a);
  if (c.two_sets) write("b", c.b);
}

class Soak {
 public:
  explicit Soak(const SoakOptions& settings) : settings_(settings), random_(settings.seed) {}

  int run() {
    start_ = last_report_ = Clock::now();
    double warm_mib = 0;
    while (seconds() < settings_.seconds && total_boxes() < settings_.boxes &&
           rounds_ < settings_.rounds) {
      if (!round()) return 1;
      ++rounds_;
      oracle_.drop_large();
      // By then all sizes have occurred, and the workspaces have reached their maximum.
      if (!settings_.twice && warm_mib == 0 && seconds() > settings_.seconds / 5 &&
          rounds_ > warm_rounds)
        warm_mib = resident_mib();
      if (std::chrono::duration<double>(Clock::now() - last_report_).count() >
          settings_.report_seconds)
        print_progress();
    }
    if (settings_.twice && !sanitized) {
      warm_mib = resident_mib();
      random_ = Random(settings_.seed);
      for (std::uint64_t again = rounds_; again > 0; --again, ++rounds_) {
        if (!round()) return 1;
        oracle_.drop_large();
      }
    }
    print_progress();
    std::printf("%s", oracle_.table().c_str());
    std::printf("no difference\n");
    return is_memory_flat(warm_mib) ? 0 : 1;
  }

 private:
  // Enough rounds for all sizes to occur.
  static constexpr std::uint64_t warm_rounds = 2000;

  // `warm_mib`: resident memory when the workspaces had reached their maximum; 0: unknown.
  bool is_memory_flat(double warm_mib) const {
    if (sanitized) {
      std::printf("resident memory was not checked: the sanitizer keeps freed memory\n");
      return true;
    }
    if (warm_mib == 0) {
      std::printf(
          "resident memory was not checked: %llu rounds and %.0f s are too few; it takes %llu and "
          "a "
          "fifth of --seconds, or --twice 1\n",
          number(rounds_), seconds(), number(warm_rounds));
      return true;
    }
    const double end_mib = resident_mib();
    // Repeated rounds need the same memory; new ones sometimes a little more.
    const double most_mib = settings_.twice ? 1.05 * warm_mib + 8 : 1.25 * warm_mib + 48;
    std::printf("resident memory: %.0f MiB after %s, %.0f MiB at the end, at most %.0f\n", warm_mib,
                settings_.twice ? "the first half" : "a fifth of the time", end_mib, most_mib);
    if (end_mib <= most_mib) return true;
    std::printf("MEMORY GREW\n");
    return false;
  }

  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  std::uint64_t total_boxes() const { return oracle_.totals.boxes + sequence_counts_.boxes; }

  // One sequence of calls in 80 rounds; a large scene in some thousands.
  bool round() {
    const std::uint32_t kind = random_.below(4000);
    if (settings_.many) return scene(large);
    if (kind % 80 == 0) return call_sequence();
    return scene(kind == 1 ? large : kind < 20 ? medium : kind % 2 ? small : tiny);
  }

  bool call_sequence() {
    const std::vector<std::uint8_t> bytes = random_bytes(random_, 64 + random_.below(1500));
    try {
      Bytes stream(bytes);
      const CallSequenceCounts c = run_call_sequence(stream);
      sequence_counts_.updates += c.updates, sequence_counts_.boxes += c.boxes,
          sequence_counts_.pairs += c.pairs;
      sequence_counts_.queries += c.queries;
      return true;
    } catch (const Difference& difference) {
      std::printf("DIFFERENCE in round %llu, seed %llu: %s\n", number(rounds_),
                  number(settings_.seed), difference.what());
      if (settings_.folder.empty()) return false;
      const std::vector<std::uint8_t> least = minimize_bytes(bytes, [](const auto& b) {
        try {
          Bytes stream(b);
          run_call_sequence(stream);
        } catch (const Difference&) {
          return true;
        }
        return false;
      });
      save(settings_.folder + "/difference_broad_phase", least.data(), least.size());
      std::printf("  copy it to tests/fuzz/corpus/broad_phase, and the tests run it\n");
      return false;
    }
  }

  bool scene(std::size_t most) {
    // Enough bytes for all boxes, or too few.
    std::vector<std::uint8_t> bytes = random_bytes(
        random_, random_.one_in(3) ? 40 + random_.below(200) : 40 + random_.below(6000));
    // Most of the larger scenes are scattered boxes, the cheapest to search and compare.
    if (most == small && !random_.one_in(4)) bytes[0] = scattered_shape;
    Bytes stream(bytes);
    const Case c = make_case(stream, most);
    oracle_.begin(c);
    // Tens of thousands of boxes in one place would take minutes, and gigabytes per copy.
    constexpr std::size_t most_pairs = std::size_t{1} << 25;
    if (oracle_.expected().pairs().size() > most_pairs) return true;
    if (rounds_ % 64 == 0) {
      ++oracle_.totals.close_checked;
      if (has_close_pair(c)) ++oracle_.totals.close_cases;
    }
    // CPU searches on one thread cost some 0.05 us per box; starting threads, and the emulated
    // device, cost many times as much for few boxes. Many pairs take time to compare.
    const std::size_t pairs_per_box = oracle_.expected().pairs().size() / (c.size() + 1);
    const std::uint32_t searches = most == tiny        ? 20
                                   : pairs_per_box > 8 ? 6
                                   : pairs_per_box > 1 ? 20
                                                       : 192;
    for (std::uint32_t k = 0; k < searches; ++k) {
      const std::size_t config =
          random_.below(static_cast<std::uint32_t>(oracle_.configs().size()));
      if (!should_run(oracle_.configs()[config], c.size(), most)) continue;
      try {
        oracle_.search(c, config, random_.below(1u << 20));
      } catch (const Difference& difference) {
        std::printf("DIFFERENCE in round %llu, seed %llu, %s: %s\n", number(rounds_),
                    number(settings_.seed), describe(c).c_str(), difference.what());
        if (!settings_.folder.empty()) report_case(settings_.folder, c, config);
        return false;
      }
    }
    return true;
  }

  // Whether to run a drawn configuration: slow ones run less often.
  bool should_run(const Config& how, std::size_t boxes, std::size_t most) {
    if (settings_.emulated) return how.backend == Backend::emulated && how.threads == 1;
    const bool expensive = how.threads != 1 || how.backend != Backend::cpu;
    if (expensive && most != large && !random_.one_in(16)) return false;
    // The scalar kernels, and brute force over many boxes.
    const bool slow = boxes > 100 && (how.isa == Isa::scalar ||
                                      (how.algorithm == Algorithm::all_pairs && boxes > 2000));
    return !slow || random_.one_in(40);
  }
  static unsigned long long number(std::uint64_t n) { return n; }
  void print_progress() {
    last_report_ = Clock::now();
    const ComparisonCounts& t = oracle_.totals;
    std::printf(
        "%7.0f s  seed %llu  %llu rounds  %llu boxes and %llu pairs compared: %llu searches of "
        "%llu "
        "scenes, %llu updates, %llu queries; %.0f %% of the scenes touch within 2 ulp; %.0f "
        "MiB\n",
        seconds(), number(settings_.seed), number(rounds_), number(total_boxes()),
        number(t.pairs + sequence_counts_.pairs), number(t.searches), number(t.cases),
        number(sequence_counts_.updates), number(sequence_counts_.queries),
        100.0 * static_cast<double>(t.close_cases) /
            static_cast<double>(std::max<std::uint64_t>(t.close_checked, 1)),
        resident_mib());
    std::fflush(stdout);
  }

  SoakOptions settings_;
  Random random_;
  Oracle oracle_;
  CallSequenceCounts sequence_counts_;
  std::uint64_t rounds_ = 0;
  Clock::time_point start_, last_report_;
};

// Converts an input on which the fuzz target find_pairs fails into a test.
int minimize(const SoakOptions& settings) {
  std::ifstream file(settings.minimize, std::ios::binary);
  const std::vector<std::uint8_t> input{std::istreambuf_iterator<char>(file), {}};
  Bytes bytes(input);
  const std::uint32_t choice = bytes.next();
  const Case c = make_case(bytes, 600);
  Oracle oracle;
  for (std::uint32_t k = 0; k < 4; ++k) {
    const std::size_t config = (choice + k * 11) % oracle.configs().size();
    if (!differs(oracle, c, config)) continue;
    report_case(settings.folder, c, config);
    return 0;
  }
  std::printf("throng-soak: %s: no configuration of this input differs from the double loop\n",
              settings.minimize.c_str());
  return 1;
}

}  // namespace
}  // namespace throng::tests

int main(int argc, char** argv) {
  throng::tests::SoakOptions settings;
  for (int i = 1; i < argc; i += 2) {
    const std::string name = argv[i];
    const char* value = i + 1 < argc ? argv[i + 1] : nullptr;
    if (value && name == "--seconds") {
      settings.seconds = std::strtod(value, nullptr);
    } else if (value && name == "--boxes") {
      settings.boxes = static_cast<std::uint64_t>(std::strtod(value, nullptr));
    } else if (value && name == "--rounds") {
      settings.rounds = std::strtoull(value, nullptr, 10);
    } else if (value && name == "--emulated") {
      settings.emulated = std::strtoull(value, nullptr, 10) != 0;
    } else if (value && name == "--many") {
      settings.many = std::strtoull(value, nullptr, 10) != 0;
    } else if (value && name == "--twice") {
      settings.twice = std::strtoull(value, nullptr, 10) != 0;
    } else if (value && name == "--seed") {
      settings.seed = std::strtoull(value, nullptr, 10);
    } else if (value && name == "--report-seconds") {
      settings.report_seconds = std::strtod(value, nullptr);
    } else if (value && name == "--minimize") {
      settings.minimize = value;
    } else if (value && name == "--folder") {
      settings.folder = value;
    } else {
      std::printf(
          "throng-soak: '%s' is unknown or has no value; options: --seconds S (3600), --boxes "
          "N and --rounds N (stop there), --seed N (1), --emulated 1 (emulated device), --many 1 "
          "(scenes of up to 30,000), --twice 1 (repeat the rounds, check memory), "
          "--report-seconds S (60), --folder WHERE (.; empty: write nothing), --minimize INPUT (of "
          "the fuzz "
          "target find_pairs)\n",
          argv[i]);
      return 2;
    }
  }
  if (!settings.minimize.empty()) return throng::tests::minimize(settings);
  return throng::tests::Soak(settings).run();
}
