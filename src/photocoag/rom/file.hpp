// Role: setup; the reduced model file, the seam between offline and online. Used by `reduce`, the
// model cache, `treat`, embedding programs. Format: docs/model-file.md. Units: SI, in the key
// names.
#pragma once

#include <string>
#include <string_view>

#include "photocoag/rom/reduced_model.hpp"

namespace photocoag {

inline constexpr int kModelFileVersion = 1;
/// Version of files that also hold the responses over several uncertain quantities.
inline constexpr int kUncertainModelFileVersion = 2;

/// The model as JSON text with its checksum (SHA-256 of everything else). The same model gives the
/// same bytes; numbers are written so that they read back bit for bit.
std::string to_json(const ReducedModel& model);

/// Reads and verifies. `where` is named in errors. Throws Error naming the field, what was found
/// and what is accepted: not JSON, truncated, altered (checksum), another version, a missing or
/// wrong field, or a model that verify() rejects.
ReducedModel from_json(std::string_view text, std::string_view where);

/// to_json into a file, replaced as a whole (written beside it, then renamed). Throws Error.
void save_reduced_model(const ReducedModel& model, const std::string& path);

/// from_json of a regular file of at most 10 MB. Throws Error.
ReducedModel load_reduced_model(const std::string& path);

}  // namespace photocoag
