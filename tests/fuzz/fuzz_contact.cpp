// Contact candidates of any mesh are those of a double loop, with finders that keep the memory of
// earlier meshes.
#include "fuzz/target.hpp"
#include "support/configs.hpp"
#include "support/contact_reference.hpp"

namespace throng::tests {

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
}

}  // namespace throng::tests
