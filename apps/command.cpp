#include "command.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>

namespace photocoag {
namespace {

std::vector<const Command*>& registered() {
  static std::vector<const Command*> all;
  return all;
}

}  // namespace

Command::Command(const char* name, const char* description, Configure configure)
    : name_(name), description_(description), configure_(configure) {
  registered().push_back(this);
}

void Command::add_to(CLI::App& app, const char* group, int& exit_code) const {
  CLI::App* command = app.add_subcommand(name_, description_);
  if (*group != '\0') command->group(group);
  configure_(*command, exit_code);
}

void add_commands(CLI::App& app, const std::vector<CommandGroup>& groups, int& exit_code) {
  std::vector<const Command*> left = registered();
  std::sort(left.begin(), left.end(),
            [](const Command* a, const Command* b) { return a->name() < b->name(); });
  for (const CommandGroup& group : groups) {
    for (const std::string_view name : group.commands) {
      const auto found = std::find_if(left.begin(), left.end(),
                                      [name](const Command* c) { return c->name() == name; });
      if (found == left.end()) continue;  // a program without it
      (*found)->add_to(app, group.what_for, exit_code);
      left.erase(found);
    }
  }
  for (const Command* command : left) command->add_to(app, "", exit_code);
}

}  // namespace photocoag
