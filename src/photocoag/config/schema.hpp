// Role: setup; the configuration's JSON Schema, made from the table of keys, for editors that
// complete and check TOML. Used by `config --schema`, tests. Units: those of the keys. Real time:
// no.
#pragma once

#include <string>

namespace photocoag {

/// JSON Schema (draft 2020-12) of a configuration file: every key with its meaning, range and
/// default. A file that it accepts may still break a rule across keys (docs/configuration.md).
std::string config_schema();

}  // namespace photocoag
