// Processes as this system has them: by POSIX, or by Windows.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace throng::common {

// A running program whose standard output is a pipe to this one. It has nothing on its standard
// input; its standard error is passed through. The destructor kills it if it still runs.
class ChildProcess {
 public:
  // `arguments`: an argument vector: no shell, no quoting. Throws Failure where it cannot be
  // started.
  ChildProcess(const std::string& path, const std::vector<std::string>& arguments);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  // Waits for output, and reads what is there, at most `bytes`. 0: it has closed its output.
  // Nothing: no output came for `milliseconds`; -1: no limit.
  std::optional<std::size_t> read(char* into, std::size_t bytes, int milliseconds);
  // Does not wait.
  bool has_ended();
  // Returns when it has ended.
  void kill();
  // After its end: its exit status; 128 + the signal that ended it.
  int status() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Runs a program with this one's input and output to its end; returns its exit status. Where the
// system can replace this process by it, it does not return. Throws Failure where it cannot be
// started.
int run_instead(const std::string& path, const std::vector<std::string>& arguments);

}  // namespace throng::common
