// Role: setup; the configuration's JSON Schema, from the table of its keys, for editors that
// complete and check TOML. Used by the program and the tests. Units: those of the keys. Real time:
// no.
#pragma once

#include <string>

namespace photocoag {

/// JSON Schema (draft 2020-12) of a configuration file: every key with its meaning, range and
/// default. What it accepts may still be refused for rules across keys (docs/configuration.md).
std::string config_schema();

}  // namespace photocoag
