// Writes the cases that the tests of the JavaScript package read: cases.json and cases.bin in a
// folder. The answers are those of the double loop of the tests, of the golden table, and, for
// queries, of this build of the library.
#include <cstdio>
#include <fstream>
#include <iostream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include <throng/broad_phase.hpp>

#include "apps/scenes/golden.hpp"
#include "support/cases.hpp"
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"
#include "support/scene_boxes.hpp"

namespace throng::tests {
namespace {

constexpr std::uint32_t no_object = 0xffffffff;

// A JSON object, written by hand: names and numbers only.
class Object {
 public:
  void raw(const char* name, const std::string& value) {
    text_ << (text_.tellp() == 0 ? "" : ", ") << '"' << name << "\": " << value;
  }
  void text(const char* name, const std::string& value) { raw(name, '"' + value + '"'); }
  void number(const char* name, double value) {
    std::ostringstream out;
    out.precision(std::numeric_limits<double>::max_digits10);
    out << value;
    raw(name, out.str());
  }
  void hexadecimal(const char* name, std::uint64_t value) {
    char digits[17];
    std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(value));
    text(name, digits);
  }
  std::string str() const { return '{' + text_.str() + '}'; }

 private:
  std::ostringstream text_;
};

std::string list_of(const std::vector<std::string>& items) {
  std::string all = "[";
  for (const std::string& item : items) all += (all.size() == 1 ? "\n  " : ",\n  ") + item;
  return all + "\n]";
}

class Writer {
 public:
  explicit Writer(const std::string& folder)
      : folder_(folder), bytes_(folder + "/cases.bin", std::ios::binary) {}

  // [offset in bytes, number of values of 4 or 8 or 1 bytes]; offsets are multiples of 8.
  template <class T>
  void array(Object& to, const char* name, const std::vector<T>& values,
             std::size_t per_value = 1) {
    to.raw(name,
           '[' + std::to_string(at_) + ", " + std::to_string(values.size() * per_value) + ']');
    const std::size_t size = values.size() * sizeof(T);
    bytes_.write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(size));
    const char zeros[8] = {};
    bytes_.write(zeros, static_cast<std::streamsize>((8 - size % 8) % 8));
    at_ += (size + 7) / 8 * 8;
  }
  void boxes(Object& to, const std::vector<Box>& values) { array(to, "boxes", values, 6); }
  void pairs(Object& to, const char* name, const std::vector<Pair>& values) {
    array(to, name, values, 2);
  }
  void set(Object& to, const Set& set, unsigned filters) {
    boxes(to, set.boxes);
    if (filters & with_group) array(to, "group", set.group);
    if (filters & with_mask) array(to, "mask", set.mask);
    if (filters & with_owner) array(to, "owner", set.owner);
    if (filters & with_world) array(to, "world", set.world);
    if (filters & with_static) array(to, "static", set.is_static);
  }

  bool write(const std::vector<std::string>& golden, const std::vector<std::string>& finds,
             const std::vector<std::string>& queries) {
    std::ofstream out(folder_ + "/cases.json");
    out << "{\"golden\": " << list_of(golden) << ",\n\"finds\": " << list_of(finds)
        << ",\n\"queries\": " << list_of(queries) << "}\n";
    return static_cast<bool>(out.flush()) && static_cast<bool>(bytes_.flush());
  }

 private:
  std::string folder_;
  std::ofstream bytes_;
  std::size_t at_ = 0;
};

std::vector<std::string> golden_cases(Writer& writer) {
  std::vector<std::string> all;
  for (const scenes::Golden& golden : scenes::golden()) {
    if (golden.objects > 10000 &&
        (std::string(golden.scene) != "uniform" || golden.objects > 100000))
      continue;
    scenes::Spec spec;
    spec.name = golden.scene;
    spec.objects = golden.objects;
    spec.frames = golden.frame + 1;
    const SceneBoxes scene(spec, golden.frame);
    Object one;
    one.text("name", golden.scene + (' ' + std::to_string(golden.objects)));
    writer.boxes(one, scene.boxes);
    if (!scene.worlds.empty()) writer.array(one, "world", scene.worlds);
    one.number("pairs", static_cast<double>(golden.pairs));
    one.hexadecimal("checksum", golden.checksum);
    one.hexadecimal("canonical", golden.canonical);
    all.push_back(one.str());
  }
  return all;
}

std::vector<std::string> find_cases(Writer& writer) {
  std::vector<std::string> all;
  const auto add = [&](const std::string& name, const Case& c) {
    Object one;
    one.text("name", name);
    writer.set(one, c.a, c.filters_a);
    if (c.two_sets) {
      Object other;
      writer.set(other, c.b, c.filters_b);
      one.raw("other", other.str());
    }
    one.number("margin", c.margin);
    one.text("nan", c.nan == NanPolicy::refuse ? "refuse" : "inactive");
    if (c.is_refused()) {
      one.raw("refused", "true");
    } else {
      const Answer answer = c.two_sets ? reference_pairs(c.first(), c.second(), c.margin)
                                       : reference_pairs(c.first(), c.margin);
      one.number("inactive", static_cast<double>(answer.inactive));
      writer.pairs(one, "pairs", answer.pairs);
    }
    all.push_back(one.str());
  };
  for (const HardScene& scene : hard_scenes(600)) {
    Case c;
    c.a.boxes = scene.boxes;
    add(scene.name, c);
  }
  Random random(7);
  for (int i = 0; i < 600; ++i) {
    const std::vector<std::uint8_t> choices = random_bytes(random, 4096);
    Bytes bytes(choices);
    const Case c = make_case(bytes, 120);
    add("random " + std::to_string(i) + ' ' + c.shape, c);
  }
  return all;
}

std::vector<std::string> query_cases(Writer& writer) {
  std::vector<std::string> all;
  std::uint64_t seed = 1;
  for (const HardScene& scene : hard_scenes(300)) {
    Random random(seed++);
    BroadPhase objects;
    std::vector<ObjectId> ids(scene.boxes.size());
    if (!objects.add(scene.boxes, ids.data()).ok()) continue;
    const std::vector<Box> boxes(scene.boxes.begin(), scene.boxes.begin() + 40);
    std::vector<Sweep> sweeps;
    std::vector<Vec3> by;
    for (const Box& box : boxes) {
      by.push_back(random.point(-20, 20));
      sweeps.push_back({box, by.back()});
    }
    Object one;
    one.text("name", scene.name);
    writer.boxes(one, scene.boxes);
    writer.array(one, "by", by, 3);
    if (!objects.find_overlaps(boxes).ok()) continue;
    writer.pairs(one, "overlaps", {objects.overlaps().begin(), objects.overlaps().end()});
    for (const bool first : {false, true}) {
      if (!objects
               .find_hits(sweeps.data(), sweeps.size(), first ? SweepHits::first : SweepHits::all)
               .ok())
        continue;
      std::vector<Pair> hits;
      std::vector<double> times;
      for (const SweepHit& hit : objects.hits()) {
        hits.push_back({hit.sweep, hit.object});
        times.push_back(hit.time);
      }
      writer.pairs(one, first ? "first" : "hits", hits);
      writer.array(one, first ? "firstTimes" : "times", times);
    }
    std::vector<Vec3> origins, directions;
    std::vector<std::uint32_t> hit_objects;
    std::vector<double> distances;
    for (int i = 0; i < 40; ++i) {
      const Vec3 from = random.point(-30, 30), along = random.point(-1, 1);
      const RayHit hit = objects.raycast(from, along).value_or(RayHit{no_object, 0, {}, {}});
      origins.push_back(from);
      directions.push_back(along);
      hit_objects.push_back(hit.object);
      distances.push_back(hit.distance);
    }
    writer.array(one, "origins", origins, 3);
    writer.array(one, "directions", directions, 3);
    writer.array(one, "rayObjects", hit_objects);
    writer.array(one, "rayDistances", distances);
    all.push_back(one.str());
  }
  return all;
}

}  // namespace
}  // namespace throng::tests

int main(int count, char** arguments) {
  using namespace throng::tests;
  if (count != 2) {
    std::cerr << "usage: throng-web-cases FOLDER\n";
    return 2;
  }
  Writer writer(arguments[1]);
  const auto golden = golden_cases(writer);
  const auto finds = find_cases(writer);
  const auto queries = query_cases(writer);
  if (writer.write(golden, finds, queries)) return 0;
  std::cerr << "cannot write to " << arguments[1] << '\n';
  return 1;
}
