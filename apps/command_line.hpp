// Role: the program; declares a command's options. The parser behind it, CLI11, is compiled only in
// command.cpp: its headers cost five seconds of compile time per file.
#pragma once

#include <functional>
#include <initializer_list>
#include <string>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace photocoag {

/// Returns what is wrong with the text of an option; empty: nothing.
using Check = std::function<std::string(const std::string& text)>;

/// An option, flag or positional argument of a command.
class CommandOption {
 public:
  explicit CommandOption(CLI::Option* option) : option_(option) {}

  CommandOption type_name(const char* name) const;
  CommandOption check(const Check& check) const;
  CommandOption one_of(std::initializer_list<const char*> words) const;
  CommandOption required() const;
  CommandOption needs(CommandOption other) const;
  CommandOption needs(const char* other) const;
  CommandOption excludes(CommandOption other) const;
  CommandOption excludes(const char* other) const;
  /// For a list: one value after each name, which may be repeated.
  CommandOption one_value_each() const;
  /// --help shows the current value.
  CommandOption show_default() const;

 private:
  CLI::Option* option_;
};

class CommandLine {
 public:
  explicit CommandLine(CLI::App& app) : app_(&app) {}

  /// A name without dashes is positional. T: one of the types instantiated in command.cpp.
  template <typename T>
  CommandOption add_option(const char* name, T& value, const char* description);
  /// An option whose text `take` stores or rejects with an Error.
  CommandOption add_text(const char* name, const std::function<void(const std::string& text)>& take,
                         const char* description);
  CommandOption add_flag(const char* name, bool& value, const char* description);
  /// Text at the end of --help.
  void footer(const std::string& text);
  /// Called when everything is parsed and checked.
  void callback(const std::function<void()>& run);
  /// Accepts all further arguments unparsed, including --help.
  void take_everything();

  const CLI::App& parser() const noexcept { return *app_; }

 private:
  CLI::App* app_;
};

}  // namespace photocoag
