// The command line: any words give a valid command or a message. Nothing is run: the words are
// parsed as the program does, and numbers with their suffixes.
#include <CLI/CLI.hpp>

#include "apps/common/failure.hpp"
#include "apps/common/numbers.hpp"
#include "apps/throng/commands.hpp"
#include "fuzz/target.hpp"

namespace throng::tests {
namespace {

const char* const words[] = {"demo",
                             "pairs",
                             "scene",
                             "check",
                             "explain",
                             "bench",
                             "--help",
                             "--version",
                             "-h",
                             "--backend",
                             "cpu",
                             "emulated",
                             "auto",
                             "--algorithm",
                             "all-pairs",
                             "grid",
                             "--order",
                             "canonical",
                             "any",
                             "--threads",
                             "--repeat",
                             "--memory",
                             "64M",
                             "--json",
                             "--group",
                             "--mask",
                             "--owner",
                             "--world",
                             "--static",
                             "--group-b",
                             "--world-b",
                             "--nan",
                             "inactive",
                             "refuse",
                             "--round",
                             "outward",
                             "--margin",
                             "--isa",
                             "scalar",
                             "-o",
                             "--output",
                             "--objects",
                             "100K",
                             "--frames",
                             "--density",
                             "--seed",
                             "--moving",
                             "uniform",
                             "a.npy",
                             "b.npy",
                             "-1",
                             "0",
                             "1e9",
                             "nan",
                             "--",
                             "",
                             "--threads=",
                             "-5",
                             "18446744073709551616",
                             "1e999",
                             "%s",
                             "--\xff"};

std::string word(Bytes& bytes) {
  const std::uint32_t b = bytes.next();
  constexpr std::uint32_t known = sizeof words / sizeof *words;
  if (b < 4 * known && b < 250) return words[b % known];
  std::string text;
  for (std::uint32_t k = bytes.next() % 12; k > 0; --k) {
    const char c = static_cast<char>(bytes.next());
    if (c) text += c;
  }
  return text;
}

void number(const std::string& text) {
  for (const bool bytes : {false, true}) {
    try {
      bytes ? common::parse_bytes(text, "--option") : common::parse_count(text, "--option");
    } catch (const common::Failure& failure) {
      if (std::string(failure.what()).find("--option") == std::string::npos)
        throw Difference("a number was refused without the option's name");
    }
  }
}

}  // namespace

void run(Bytes& bytes) {
  CLI::App app("throng", "throng");
  app.set_version_flag("--version", "0");
  app.require_subcommand(1);
  const cli::Run commands[] = {cli::add_demo(app), cli::add_pairs(app), cli::add_scene(app),
                               cli::add_check(app), cli::add_explain(app)};
  for (const cli::Run& command : commands)
    if (!command) throw Difference("a command that cannot run");
  std::vector<std::string> arguments;
  while (!bytes.empty() && arguments.size() < 24) arguments.push_back(word(bytes));
  for (const std::string& text : arguments) number(text);
  std::vector<const char*> argv = {"throng"};
  for (const std::string& text : arguments) argv.push_back(text.c_str());
  try {
    app.parse(static_cast<int>(argv.size()), argv.data());
  } catch (const CLI::ParseError& error) {
    // Help and version are not errors; anything else needs a message.
    if (error.get_exit_code() != 0 && std::string(error.what()).empty())
      throw Difference("refused without a message");
  } catch (const common::Failure& failure) {  // a number, from the option that parses it
    if (std::string(failure.what()).rfind("--", 0) != 0)
      throw Difference("a number was refused without the option's name");
  }
}

}  // namespace throng::tests
