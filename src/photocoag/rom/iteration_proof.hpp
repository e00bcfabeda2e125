// Role: setup; a proved bound on active-set changes, stored in the reduced model file. Used by the
// program (`certify`). Format: docs/model-file.md. Units: none. Real time: none.
// Threads: plain data.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace photocoag {

/// What was proved, and of what. A hash binds it to one model, one claim and one build.
struct IterationProof {
  std::string claim;   ///< settings and box, as text
  int seen = 0;        ///< most changes that a sampled problem of the box needed
  int proved = 0;      ///< no problem of the box needs more
  int hard_bound = 0;  ///< the solver gives up after this many
  double share = 0.0;  ///< fraction of the box in which `seen` is proved
  bool covers_rounding = false;
  std::size_t boxes = 0;
};

/// The model file's text with the proof in it, replacing one for the same claim, and a new
/// checksum. Throws Error if the text is no model file.
std::string with_iteration_proof(const std::string& model_text, const IterationProof& proof);

/// The proof of a claim about this model by this build, if the file has one. Proofs for another
/// model, claim or build are ignored. Throws Error if the text is no model file.
std::optional<IterationProof> iteration_proof(const std::string& model_text,
                                              std::string_view claim);

}  // namespace photocoag
