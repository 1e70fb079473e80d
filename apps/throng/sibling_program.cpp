#include "apps/throng/sibling_program.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>

#include <fmt/format.h>

#include "apps/common/interrupt.hpp"
#include "apps/throng/failure.hpp"

#ifdef _WIN32
#include <process.h>
#else
#include <unistd.h>
#endif

namespace throng::cli {

int run_sibling_program(const std::string& path, const std::vector<std::string>& arguments) {
  std::vector<char*> argv;
  argv.push_back(const_cast<char*>(path.c_str()));
  for (const std::string& argument : arguments) {
    argv.push_back(const_cast<char*>(argument.c_str()));
  }
  argv.push_back(nullptr);
  std::fflush(stdout);
  common::restore_write_signals();  // an ignored signal would stay ignored in the other program
#ifdef _WIN32
  const auto status = _spawnv(_P_WAIT, path.c_str(), argv.data());
  if (status >= 0) return static_cast<int>(status);
#else
  execv(path.c_str(), argv.data());  // an argument vector: no shell, nothing to quote
#endif
  throw Failure(fmt::format("{} cannot be started: {}", path, std::strerror(errno)));
}

}  // namespace throng::cli
