// Contact candidates of any mesh are those of a double loop, through C++ and through C, with
// finders that keep the memory of earlier meshes.
#include <throng/throng.h>

#include "fuzz/target.hpp"
#include "support/configs.hpp"
#include "support/contact_reference.hpp"

namespace throng::tests {
namespace {

throng_contact_mesh c_view(const ContactScene& s) {
  throng_contact_mesh c{};
  const auto vertices = [](const std::vector<DoubleVec3>& v) {
    return throng_vertices{v.size(), nullptr, v.empty() ? nullptr : &v[0].x, 0};
  };
  c.start = vertices(s.start);
  c.end = vertices(s.end);
  c.edges = {s.edges.size(), s.edges.empty() ? nullptr : &s.edges[0].a, 0};
  c.faces = {s.faces.size(), s.faces.empty() ? nullptr : &s.faces[0].a, 0};
  c.dimension = s.dimension;
  c.rings = s.rings;
  if (!s.group.empty()) c.group = {s.group.data(), 0};
  if (!s.mask.empty()) c.mask = {s.mask.data(), 0};
  return c;
}

void check_c(const ContactScene& scene, const ContactCandidates& want) {
  static throng_contact_finder* const finder = throng_contact_finder_create(nullptr);
  const throng_contact_mesh mesh = c_view(scene);
  if (throng_contact_finder_find(finder, &mesh, scene.radius) != THRONG_OK)
    throw Difference(std::string("C: ") + throng_contact_finder_result(finder)->message);
  const auto pairs = [](const throng_pair* (*get)(const throng_contact_finder*, size_t*)) {
    size_t count = 0;
    const throng_pair* const first = get(finder, &count);
    return Pairs{reinterpret_cast<const Pair*>(first), count};
  };
  const std::string difference = contact_difference(
      {pairs(throng_contact_finder_vertex_face), pairs(throng_contact_finder_edge_edge),
       pairs(throng_contact_finder_edge_vertex)},
      want);
  if (!difference.empty()) throw Difference("C: " + difference);
}

}  // namespace

void run(Bytes& bytes) {
  static std::vector<Config> configs = [] {
    std::vector<Config> all = all_configs();
    std::erase_if(all, [](const Config& c) { return c.backend != Backend::cpu; });
    return all;
  }();
  static std::vector<ContactFinder> finders(configs.size());
  const std::size_t which = bytes.below(static_cast<std::uint32_t>(configs.size()));
  const ContactScene scene = make_contact_scene(bytes, 40);
  const ContactReference reference(scene);
  ContactFinder& finder = finders[which];
  finder.set_options(configs[which].options());
  const Result r = finder.find(scene.view(), scene.radius);
  if (!r.ok()) throw Difference(r.message);
  const std::string difference = contact_difference(finder.candidates(), reference.expected);
  if (!difference.empty()) throw Difference(configs[which].name() + ": " + difference);
  check_c(scene, reference.expected);
}

}  // namespace throng::tests
