#include "command.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "console.hpp"

namespace photocoag {
namespace {

std::vector<const Command*>& registered() {
  static std::vector<const Command*> all;
  return all;
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

}  // namespace

CommandOption CommandOption::type_name(const char* name) const {
  return CommandOption(option_->type_name(name));
}

CommandOption CommandOption::check(const Check& check) const {
  return CommandOption(option_->check([check](const std::string& text) { return check(text); }));
}

CommandOption CommandOption::one_of(std::initializer_list<const char*> words) const {
  return CommandOption(
      option_->check(CLI::IsMember(std::vector<std::string>(words.begin(), words.end()))));
}

CommandOption CommandOption::required() const { return CommandOption(option_->required()); }

CommandOption CommandOption::needs(CommandOption other) const {
  return CommandOption(option_->needs(other.option_));
}

CommandOption CommandOption::needs(const char* other) const {
  return CommandOption(option_->needs(other));
}

CommandOption CommandOption::excludes(CommandOption other) const {
  return CommandOption(option_->excludes(other.option_));
}

CommandOption CommandOption::excludes(const char* other) const {
  return CommandOption(option_->excludes(other));
}

CommandOption CommandOption::one_value_each() const {
  return CommandOption(option_->allow_extra_args(false));
}

CommandOption CommandOption::show_default() const {
  return CommandOption(option_->capture_default_str());
}

template <typename T>
CommandOption CommandLine::add_option(const char* name, T& value, const char* description) {
  return CommandOption(app_->add_option(name, value, description));
}

template CommandOption CommandLine::add_option(const char*, double&, const char*);
template CommandOption CommandLine::add_option(const char*, int&, const char*);
template CommandOption CommandLine::add_option(const char*, unsigned&, const char*);
template CommandOption CommandLine::add_option(const char*, std::size_t&, const char*);
template CommandOption CommandLine::add_option(const char*, std::string&, const char*);
template CommandOption CommandLine::add_option(const char*, std::optional<double>&, const char*);
template CommandOption CommandLine::add_option(const char*, std::optional<std::size_t>&,
                                               const char*);
template CommandOption CommandLine::add_option(const char*, std::vector<std::string>&, const char*);

CommandOption CommandLine::add_text(const char* name,
                                    const std::function<void(const std::string&)>& take,
                                    const char* description) {
  return CommandOption(app_->add_option_function<std::string>(name, take, description));
}

CommandOption CommandLine::add_flag(const char* name, bool& value, const char* description) {
  return CommandOption(app_->add_flag(name, value, description));
}

void CommandLine::footer(const std::string& text) { app_->footer(text); }

void CommandLine::callback(const std::function<void()>& run) { app_->callback(run); }

void CommandLine::take_everything() {
  app_->set_help_flag();
  app_->prefix_command();
}

Command::Command(const char* name, const char* description, Configure configure)
    : name_(name), description_(description), configure_(std::move(configure)) {
  registered().push_back(this);
}

void Command::add_to(CLI::App& app, const char* group, int& exit_code) const {
  CLI::App* command = app.add_subcommand(name_, description_);
  if (*group != '\0') command->group(group);
  CommandLine line(*command);
  configure_(line, exit_code);
}

int run_program(const ProgramWords& words, const std::vector<CommandGroup>& groups, int argc,
                char** argv) {
  CLI::App app{words.description};
  app.name(words.name);
  bool as_json = false;
  CLI::Option* version_flag = app.set_version_flag("--version", words.version);
  app.add_flag("--json", as_json, "with --version: as one JSON object")->needs(version_flag);
  app.require_subcommand(1);
  app.footer(words.footer);
  int exit_code = 0;
  add_commands(app, groups, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (argc > 1 && *argv[1] != '-' && app.get_subcommands().empty()) {
      say("{}: there is no command {}; {} --help lists all\n", words.name, argv[1], words.name);
      return kExitBadInput;
    }
    // Help and version are a success; everything else is bad usage.
    return app.exit(error) == 0 ? 0 : kExitBadInput;
  }
  return exit_code;
}

}  // namespace photocoag
