// Runs another program and reads its output line by line while it runs.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace throng::common {

struct ChildEnd {
  bool stopped = false;  // no output for too long; killed
  int status = 0;        // its exit status; 128 + the signal that ended it
};

// Runs the program at `path` with these arguments (an argument vector: no shell, no quoting),
// nothing on its standard input, its standard error passed through. Each line of its standard
// output goes to `line` without its end; the last needs no line end. It is killed when no output
// came for `quiet_seconds` (0: no limit). An exception from `line` kills it and propagates. Throws
// Failure where it cannot be started.
ChildEnd run_child(const std::string& path, const std::vector<std::string>& arguments,
                   double quiet_seconds, const std::function<void(const std::string&)>& line);

}  // namespace throng::common
