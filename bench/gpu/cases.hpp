// The cases of the subcommand gpu: scenes at numbers of boxes, recorded files; and their frames,
// made by all threads of the host.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <throng/options.hpp>
#include <throng/types.hpp>

namespace throng::bench::gpu {

struct Case {
  std::string experiment;
  std::string label;   // of the scene, or a file's path
  std::string scene;   // empty: a file
  double density = 0;  // pairs per box; 0: the scene's own
  std::size_t objects = 0;
  std::size_t frames = 1;  // different inputs, used in turn
  bool canonical = false;  // also measured with sorted pairs
  Algorithm algorithm = Algorithm::automatic;
};

// "scaling", "scenes", "stages", "crossover"; sizes above `most` are left out. Throws
// std::invalid_argument.
std::vector<Case> cases_of(const std::string& part, std::size_t most);
// One per file, with all of its frames; throws scenes::FileError.
std::vector<Case> cases_of_files(const std::vector<std::string>& files);

// The mean width along x of the first thousand boxes.
float mean_width(const Box* boxes, std::size_t n);

// Makes the frames of a case, one at a time.
class FrameMaker {
 public:
  explicit FrameMaker(const Case& c);
  ~FrameMaker();
  // Frame f, valid until the next call.
  const Box* frame(std::size_t f);
  // One world per box; empty: none.
  const std::vector<std::int32_t>& worlds() const { return worlds_; }

 private:
  struct Source;
  std::unique_ptr<Source> source_;
  std::unique_ptr<Box[]> boxes_;
  std::vector<std::int32_t> worlds_;
  std::size_t objects_;
};

}  // namespace throng::bench::gpu
