
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iterator>
#include <memory>
#include <utility>
#include <variant>
#include <vector>

#include "command.hpp"
#include "console.hpp"
#include "options.hpp"
#include "photocoag/config/fields.hpp"
#include "photocoag/core/build_info.hpp"

namespace photocoag {
namespace {

struct OptionWords {
  std::string name;        ///< "--config"; of a positional one: FILE
  std::string short_name;  ///< "-h", or empty
  std::string description;
  std::string value;               ///< name of its value; empty: a flag
  std::vector<std::string> words;  ///< its value is one of them; empty: anything
  bool positional = false;

  bool is_key() const { return name == "--set" || name == "--vary"; }
};

struct CommandWords {
  std::string name, description, footer;
  std::vector<OptionWords> options;
};

// The words in an option's type, e.g. "TEXT:{cycle,qp}".
std::vector<std::string> words_of(const std::string& type) {
  std::vector<std::string> words;
  const std::size_t begin = type.find('{');
  const std::size_t end = type.find('}');
  if (begin == std::string::npos || end == std::string::npos) return words;
  for (std::size_t at = begin + 1; at < end;) {
    const std::size_t comma = std::min(type.find(',', at), end);
    words.push_back(type.substr(at, comma - at));
    at = comma + 1;
  }
  return words;
}

OptionWords option_words(const CLI::Option& option) {
  OptionWords out;
  out.positional = option.get_positional();
  out.name = out.positional || option.get_lnames().empty()
                 ? option.get_single_name()
                 : fmt::format("--{}", option.get_lnames().front());
  if (!out.positional && !option.get_snames().empty()) {
    out.short_name = fmt::format("-{}", option.get_snames().front());
  }
  out.description = option.get_description();
  if (option.get_items_expected_max() > 0) {
    const std::string type = option.get_type_name();
    out.words = words_of(type);
    out.value = out.words.empty() ? type.substr(0, type.find(':'))
                                  : fmt::format("{}", fmt::join(out.words, "|"));
  }
  return out;
}

std::vector<CommandWords> commands_of(const CLI::App& app) {
  std::vector<CommandWords> all;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    CommandWords words{command->get_name(), command->get_description(), command->get_footer(), {}};
    for (const CLI::Option* option : command->get_options()) {
      words.options.push_back(option_words(*option));
    }
    all.push_back(std::move(words));
  }
  return all;
}

// Every key of the configuration, those of the default layers included.
std::vector<std::string> all_keys() {
  Config config;
  std::vector<std::string> keys;
  for (const Field& field : fields(config)) {
    const auto* layers = std::get_if<LayersField>(&field.value);
    if (layers == nullptr) {
      keys.push_back(field.key);
      continue;
    }
    for (Layer& layer : *layers->layers) {
      for (const Field& inner : layer_fields(layer, field.key + "." + layer.name)) {
        if (!inner.key.ends_with(".name")) keys.push_back(inner.key);
      }
    }
  }
  return keys;
}

std::string replaced(const std::string& text, std::string_view from, std::string_view to) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t found = std::min(text.find(from, at), text.size());
    out.append(text, at, found - at);
    if (found < text.size()) out.append(to);
    at = found + from.size();
  }
  return out;
}

// Within single quotes.
std::string quoted_for_shell(const std::string& text) { return replaced(text, "'", "'\\''"); }

std::string in_bash(const std::vector<CommandWords>& commands) {
  std::string names;
  std::string cases;
  for (const CommandWords& command : commands) {
    fmt::format_to(std::back_inserter(names), "{}{}", names.empty() ? "" : " ", command.name);
    std::string options;
    std::string values;
    for (const OptionWords& option : command.options) {
      const std::string words = fmt::format("{}", fmt::join(option.words, " "));
      if (option.positional) {
        if (!words.empty()) fmt::format_to(std::back_inserter(values), "words='{}'; ", words);
        continue;
      }
      fmt::format_to(std::back_inserter(options), "{}{}", options.empty() ? "" : " ", option.name);
      if (words.empty()) continue;
      fmt::format_to(std::back_inserter(values), "[ \"$before\" != {} ] || words='{}'; ",
                     option.name, words);
    }
    fmt::format_to(std::back_inserter(cases), "    {}) options='{}'; {};;\n", command.name, options,
                   values);
  }
  return fmt::format(R"(# bash completion of photocoag: source <(photocoag completion bash)
_photocoag() {{
  local word="${{COMP_WORDS[COMP_CWORD]}}" before="${{COMP_WORDS[COMP_CWORD - 1]}}" options='' words=''
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    local commands='{} --help --version'
    # The script in the root of the sources has more.
    case "$1" in */*) commands+=' test python build package docs' ;; esac
    COMPREPLY=($(compgen -W "$commands" -- "$word"))
    return
  fi
  case "$before" in
  --set | --vary)
    type compopt >/dev/null 2>&1 && compopt -o nospace 2>/dev/null
    COMPREPLY=($(compgen -S = -W '{}' -- "$word"))
    return
    ;;
  esac
  case "${{COMP_WORDS[1]}}" in
{}  esac
  case "$word" in
  -*) COMPREPLY=($(compgen -W "$options" -- "$word")) ;;
  *) [ -z "$words" ] || COMPREPLY=($(compgen -W "$words" -- "$word")) ;;
  esac
}}
complete -o default -F _photocoag photocoag ./photocoag
)",
                     names, fmt::join(all_keys(), " "), cases);
}

std::string in_zsh(const std::vector<CommandWords>& commands) {
  const auto escaped = [](std::string text) {
    for (const char* special : {"\\", "[", "]", ":"}) {
      text = replaced(text, special, fmt::format("\\{}", special));
    }
    return quoted_for_shell(text);
  };
  std::string names;
  std::string cases;
  for (const CommandWords& command : commands) {
    fmt::format_to(std::back_inserter(names), "    '{}:{}'\n", command.name,
                   escaped(command.description));
    std::string arguments;
    for (const OptionWords& option : command.options) {
      const std::string action = option.is_key() ? "_photocoag_keys"
                                 : option.words.empty()
                                     ? "_files"
                                     : fmt::format("({})", fmt::join(option.words, " "));
      const std::string value =
          option.value.empty() ? "" : fmt::format(":{}:{}", escaped(option.value), action);
      if (option.positional) {
        fmt::format_to(std::back_inserter(arguments), " \\\n      '*{}'", value);
      } else {
        fmt::format_to(std::back_inserter(arguments), " \\\n      '{}{}[{}]{}'",
                       option.is_key() ? "*" : "", option.name, escaped(option.description), value);
      }
    }
    fmt::format_to(std::back_inserter(cases), "    {}) _arguments{} ;;\n", command.name, arguments);
  }
  return fmt::format(R"(#compdef photocoag
# zsh completion of photocoag: source <(photocoag completion zsh), or a file _photocoag in $fpath
_photocoag_keys() {{
  compadd -S = -- {}
}}
_photocoag() {{
  local -a commands
  commands=(
{}  )
  if (( CURRENT == 2 )); then
    _describe command commands
    return
  fi
  words=("${{(@)words[2,-1]}}")
  (( CURRENT-- ))
  case $words[1] in
{}  esac
}}
if [ "$funcstack[1]" = _photocoag ]; then _photocoag "$@"; else compdef _photocoag photocoag; fi
)",
                     fmt::join(all_keys(), " "), names, cases);
}

std::string in_fish(const std::vector<CommandWords>& commands) {
  const auto escaped = [](std::string text) {
    return replaced(replaced(text, "\\", "\\\\"), "'", "\\'");
  };
  std::string text = fmt::format(
      "# fish completion of photocoag: photocoag completion fish | source\n"
      "set -l keys {}\ncomplete -c photocoag -f\n",
      fmt::format("{}=", fmt::join(all_keys(), "= ")));
  for (const CommandWords& command : commands) {
    fmt::format_to(std::back_inserter(text),
                   "complete -c photocoag -n __fish_use_subcommand -a {} -d '{}'\n", command.name,
                   escaped(command.description));
    for (const OptionWords& option : command.options) {
      fmt::format_to(std::back_inserter(text),
                     "complete -c photocoag -n '__fish_seen_subcommand_from {}'", command.name);
      if (!option.positional) {
        fmt::format_to(std::back_inserter(text), " -l {} -d '{}'", option.name.substr(2),
                       escaped(option.description));
      }
      if (option.is_key()) {
        text += " -x -a \"$keys\"";
      } else if (!option.words.empty()) {
        fmt::format_to(std::back_inserter(text), " -x -a '{}'", fmt::join(option.words, " "));
      } else if (!option.value.empty()) {
        text += option.positional ? " -F" : " -r -F";
      }
      text += '\n';
    }
  }
  return text;
}

// Text that roff takes as it is.
std::string for_roff(std::string text) {
  text = replaced(replaced(text, "\\", "\\e"), "-", "\\-");
  text = replaced(text, "\n.", "\n\\&.");
  return text.starts_with('.') || text.starts_with('\'') ? fmt::format("\\&{}", text) : text;
}

std::string as_manual(const CLI::App& app, const std::vector<CommandWords>& commands) {
  std::string text = fmt::format(
      ".TH PHOTOCOAG 1 \"\" \"photocoag {}\" \"User Commands\"\n.SH NAME\nphotocoag \\- {}\n"
      ".SH SYNOPSIS\n.B photocoag\n.I COMMAND\n[\\fIOPTIONS\\fR]\n.SH DESCRIPTION\n{}\n{}\n"
      ".SH COMMANDS\n",
      version(), "real\\-time model predictive control of retinal laser treatment",
      for_roff(app.get_description()), for_roff(std::string(kResearchNotice)));
  for (const CommandWords& command : commands) {
    fmt::format_to(std::back_inserter(text), ".SS {}\n{}\n", for_roff(command.name),
                   for_roff(command.description));
    for (const OptionWords& option : command.options) {
      fmt::format_to(std::back_inserter(text), ".TP\n\\fB{}\\fR{}{}\n{}\n", for_roff(option.name),
                     option.value.empty() || option.positional ? "" : " ",
                     option.positional ? "" : for_roff(option.value), for_roff(option.description));
    }
    // Only the footer's examples; the rest is printed once, below.
    const std::string examples = command.footer.substr(0, command.footer.find("\nExit code"));
    if (!examples.empty()) {
      fmt::format_to(std::back_inserter(text), ".PP\n.nf\n{}\n.fi\n", for_roff(examples));
    }
  }
  return text +
         ".SH EXIT STATUS\n0 good; 1 finished but a check failed, or stopped; 2 bad input; "
         "3 device fault.\n.SH SEE ALSO\nThe documents in docs/ of the sources.\n";
}

std::string completion(const CLI::App& app, std::string_view kind) {
  const std::vector<CommandWords> commands = commands_of(app);
  if (kind == "bash") return in_bash(commands);
  if (kind == "zsh") return in_zsh(commands);
  if (kind == "fish") return in_fish(commands);
  return as_manual(app, commands);
}

const Command kCompletion(
    "completion", "shell completion of commands, options and keys; or the manual page",
    [](CommandLine& command, int& exit_code) {
      const auto kind = std::make_shared<std::string>();
      command.add_option("SHELL", *kind, "for this shell; man: the manual page")
          .required()
          .one_of({"bash", "zsh", "fish", "man"});
      command.footer(fmt::format(
          "Examples:\n"
          "  source <(photocoag completion bash)         # in ~/.bashrc\n"
          "  source <(photocoag completion zsh)          # in ~/.zshrc, after compinit\n"
          "  photocoag completion fish > ~/.config/fish/completions/photocoag.fish\n"
          "  photocoag completion man | man -l -\n"
          "Exit code: 0 good; 2 bad input.\n{}",
          kResearchNotice));
      command.callback([&parser = command.parser(), &exit_code, kind] {
        write_output("-", completion(*parser.get_parent(), *kind));
        exit_code = 0;
      });
    });

}  // namespace

}  // namespace photocoag
