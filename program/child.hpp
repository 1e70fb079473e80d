// Runs another program and hears what it says while it says it.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace throng::program {

struct ChildEnd {
  bool stopped = false;  // it said nothing for too long, and was killed
  int status = 0;        // its exit status; 128 + the signal where one ended it
};

// Runs the program at `path` with these arguments (an argument vector: no shell, nothing to quote),
// nothing on its standard input, its standard error passed through. Each line of its standard
// output, without the line's end, goes to `line` as it comes; what it says last needs no line's
// end. It is killed when for `quiet_seconds` no line came, 0: never. What `line` throws kills it,
// too, and comes out of here. Throws Failure where it cannot be started, as on Windows.
ChildEnd run_child(const std::string& path, const std::vector<std::string>& arguments,
                   double quiet_seconds, const std::function<void(const std::string&)>& line);

}  // namespace throng::program
