// A small engine on top of a BroadPhase: boxes of doubles, sleeping bodies, collision rules, and
// contacts that persist from step to step.
#include <throng/throng.hpp>

#include <cstdio>
#include <vector>

#include "check.hpp"

namespace {

struct Body {
  double lower[3], upper[3];
  bool awake;
  int type, affinity;  // bits: two touch if the type of one is in the affinity of the other
  int part_of;         // bodies of one machine never touch
  throng::ObjectId id;
};

struct Contact {
  throng::ObjectId first = 0, second = 0;
  bool alive = false;
  double impulse = 0;
};

bool touch(const Body& a, const Body& b) {
  for (int k = 0; k < 3; ++k) {
    if (a.lower[k] > b.upper[k] || b.lower[k] > a.upper[k]) return false;
  }
  return true;
}
bool allowed(const Body& a, const Body& b) {
  return ((a.type & b.affinity) || (b.type & a.affinity)) && a.part_of != b.part_of;
}

// snippet-begin: filter
// `type` and `affinity` have 16 bits. Throng requires (a.group & b.mask) and (b.group & a.mask).
// With both halves in both numbers, each of the two is true exactly if the type of one body is in
// the affinity of the other.
throng::Filter filter_of(const Body& body) {
  throng::Filter filter;
  filter.group = static_cast<unsigned>(body.type) | static_cast<unsigned>(body.affinity) << 16;
  filter.mask = static_cast<unsigned>(body.affinity) | static_cast<unsigned>(body.type) << 16;
  filter.owner = body.part_of;
  return filter;
}
// snippet-end: filter

class Engine {
 public:
  // snippet-begin: add
  void add(Body body) {
    body.id = phase_.add(throng::round_outward(body.lower, body.upper), filter_of(body));
    if (bodies_.size() <= body.id) bodies_.resize(body.id + 1);
    bodies_[body.id] = body;  // ids are small numbers: indices
  }
  // snippet-end: add

  void push(throng::ObjectId id, double by) {
    Body& body = bodies_[id];
    body.lower[0] += by;
    body.upper[0] += by;
    body.awake = true;
  }

  void wake(throng::ObjectId first) {
    std::vector<throng::ObjectId> waking = {first};
    while (!waking.empty()) {
      const throng::ObjectId id = waking.back();
      waking.pop_back();
      if (bodies_[id].awake) continue;
      bodies_[id].awake = true;
      touching_.resize(phase_.pairs_of(id, nullptr, 0));  // how many there are
      phase_.pairs_of(id, touching_.data(), touching_.size());
      for (const throng::LivePair& pair : touching_)
        waking.push_back(pair.first == id ? pair.second : pair.first);
    }
  }

  // snippet-begin: step
  bool step() {
    ids_.clear();
    boxes_.clear();
    for (const Body& body : bodies_) {
      if (!body.awake) continue;  // a sleeping body costs nothing
      ids_.push_back(body.id);
      boxes_.push_back(throng::round_outward(body.lower, body.upper));
    }
    throng::Result result = phase_.move(ids_.data(), boxes_);
    if (result.ok()) result = phase_.update();
    if (!result.ok()) {  // nothing changed: the step can be repeated
      std::fprintf(stderr, "%s\n", result.message);
      return false;
    }
    // The slot is fixed while the pair exists, so the contact keeps its place.
    for (const throng::LivePair& pair : phase_.ended()) contacts_[pair.slot] = {};
    contacts_.resize(static_cast<std::size_t>(phase_.slot_limit()));
    for (const throng::LivePair& pair : phase_.begun()) {
      contacts_[pair.slot] = {pair.first, pair.second, true, 0};
    }
    for (Contact& contact : contacts_) {
      if (!contact.alive) continue;
      const Body &a = bodies_[contact.first], &b = bodies_[contact.second];
      // Rounded boxes are slightly larger: compare the doubles last.
      if ((a.awake || b.awake) && touch(a, b)) solve(contact);
    }
    return true;
  }
  // snippet-end: step

  std::size_t solved() const { return solved_; }
  const std::vector<Body>& bodies() const { return bodies_; }
  void sleep() {
    for (Body& body : bodies_) body.awake = false;
  }
  const std::vector<Contact>& contacts() const { return contacts_; }

 private:
  void solve(Contact& contact) {
    ++solved_;
    contact.impulse += 1;
  }

  throng::BroadPhase phase_;
  std::vector<Body> bodies_;  // by id
  std::vector<Contact> contacts_;
  std::vector<throng::ObjectId> ids_;
  std::vector<throng::Box> boxes_;
  std::vector<throng::LivePair> touching_;
  std::size_t solved_ = 0;
};

}  // namespace

int main() {
  Engine engine;
  for (int i = 0; i < 400; ++i) {
    const double x = 0.1 * (i % 20), y = 1.3 * (i / 20 % 5), z = 0.7 * (i / 100);
    engine.add({{x, y, z}, {x + 0.3, y + 1.3, z + 0.7}, true, i % 5, 7 * i % 4, i / 3, 0});
  }
  for (int step = 0; step < 50; ++step) {
    const std::size_t before = engine.solved();
    if (step % 7 == 6) engine.sleep();
    for (throng::ObjectId id = 0; id < 400; id += 9) engine.push(id, step % 2 ? 0.1 : -0.1);
    CHECK(engine.step());
    std::size_t wanted = 0;
    for (std::size_t a = 0; a < 400; ++a) {
      for (std::size_t b = a + 1; b < 400; ++b) {
        const Body &one = engine.bodies()[a], &other = engine.bodies()[b];
        wanted += (one.awake || other.awake) && touch(one, other) && allowed(one, other);
      }
    }
    CHECK(engine.solved() - before == wanted);
    CHECK(wanted > 100);
  }
  // Waking a body wakes its whole island, by the boxes of the last step.
  engine.sleep();
  engine.wake(9);
  std::vector<bool> reached(400);
  reached[9] = true;
  std::size_t count = 0;
  for (bool more = true; more;) {
    more = false;
    for (const Contact& c : engine.contacts()) {
      if (!c.alive || reached[c.first] == reached[c.second]) continue;
      reached[c.first] = reached[c.second] = more = true;
    }
  }
  for (std::size_t i = 0; i < 400; ++i) {
    CHECK(engine.bodies()[i].awake == reached[i]);
    count += reached[i];
  }
  CHECK(count > 1);
  // Contacts that existed in all steps kept their data.
  double most = 0;
  for (const Contact& contact : engine.contacts())
    most = contact.impulse > most ? contact.impulse : most;
  CHECK(most == 50);
}
