// Role: the program; the commands about devices: eye, calibrate. Each returns the exit code.
#pragma once

#include <string>
#include <vector>

#include "commands.hpp"

namespace CLI {
class App;
}

namespace photocoag {

struct EyeOptions : CommonOptions {
  std::string socket = "photocoag-eye.sock";
  bool once = false;                ///< end with the first controller
  int owner = 0;                    ///< end with this process, the parent; 0: with none
  std::vector<std::string> faults;  ///< "ID@cycle", or files of them
  std::string tell;                 ///< no eye: send this line to the one at `socket`
};

struct CalibrateOptions : CommonOptions {
  std::string data;     ///< CSV file
  std::string out;      ///< TOML file; empty: standard output
  std::string example;  ///< write example data there
  int degree = 0;       ///< 0: chosen
  int rows = 400;       ///< of the example
};

int eye_command(const EyeOptions& options);
int calibrate_command(const CalibrateOptions& options);

/// Adds them to the program; each stores its exit code.
void add_device_commands(CLI::App& app, int& exit_code);

}  // namespace photocoag
