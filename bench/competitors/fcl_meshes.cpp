// FCL's collide of two triangle meshes with all contacts, in doubles: the search in trees that were
// made before, and with the making of the trees.
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>

#include <limits>

#include "meshes.hpp"

namespace throng::bench {
namespace {

using Model = fcl::BVHModel<fcl::OBBRSS<double>>;

std::shared_ptr<Model> model_of(const Mesh& mesh) {
  std::vector<fcl::Vector3d> points;
  points.reserve(mesh.vertices.size());
  for (const Vec3& v : mesh.vertices) points.emplace_back(v.x, v.y, v.z);
  std::vector<fcl::Triangle> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) triangles.emplace_back(t.a, t.b, t.c);
  auto model = std::make_shared<Model>();
  model->beginModel();
  model->addSubModel(points, triangles);
  model->endModel();
  return model;
}

class Fcl : public MeshPairMethod {
 public:
  Fcl(const Mesh& a, const Mesh& b, bool rebuild)
      : mesh_a_(a), mesh_b_(b), rebuild_(rebuild), a_(model_of(a)), b_(model_of(b)) {}

  std::string name() const override {
    return rebuild_ ? "FCL collide, trees rebuilt" : "FCL collide, trees kept";
  }
  std::size_t run() override {
    if (rebuild_) {
      a_ = model_of(mesh_a_);
      b_ = model_of(mesh_b_);
    }
    const auto place = fcl::Transform3d::Identity();
    const fcl::CollisionRequest<double> request(std::numeric_limits<std::size_t>::max(), false);
    result_.clear();
    fcl::collide<double>(a_.get(), place, b_.get(), place, request, result_);
    return result_.numContacts();
  }
  std::vector<Pair> pairs() const override {
    std::vector<Pair> all;
    for (std::size_t i = 0; i < result_.numContacts(); ++i) {
      const auto& contact = result_.getContact(i);
      all.push_back(
          {static_cast<std::uint32_t>(contact.b1), static_cast<std::uint32_t>(contact.b2)});
    }
    return all;
  }

 private:
  const Mesh &mesh_a_, &mesh_b_;
  bool rebuild_;
  std::shared_ptr<Model> a_, b_;
  fcl::CollisionResult<double> result_;
};

}  // namespace

std::vector<std::unique_ptr<MeshPairMethod>> fcl_mesh_pairs(const Mesh& a, const Mesh& b) {
  std::vector<std::unique_ptr<MeshPairMethod>> all;
  for (const bool rebuild : {false, true}) all.push_back(std::make_unique<Fcl>(a, b, rebuild));
  return all;
}

}  // namespace throng::bench
