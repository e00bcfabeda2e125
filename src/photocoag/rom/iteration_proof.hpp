// Role: setup; a proved number of active-set changes, kept in the reduced model file beside the
// model. Used by the program (`certify`). Format: docs/model-file.md. Units: none. Real time: none.
// Threads: plain data.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace photocoag {

/// What was proved, and of what. It holds for one model, one claim and one build: a hash over all
/// three binds it to them.
struct IterationProof {
  std::string claim;   ///< settings and box, as text
  int seen = 0;        ///< the most changes that a problem of the box was seen to need
  int proved = 0;      ///< none needs more
  int hard_bound = 0;  ///< after which the solver gives up
  double share = 0.0;  ///< of the box, in which `seen` is proved
  bool covers_rounding = false;
  std::size_t boxes = 0;
};

/// The model file's text with the proof in it, in place of one for the same claim, and a checksum
/// that fits. Throws Error if the text is no model file.
std::string with_iteration_proof(const std::string& model_text, const IterationProof& proof);

/// The proof of a claim about this model by this build, if the file has one. One that was made for
/// another model, another claim or by another build is no proof. Throws Error if the text is no
/// model file.
std::optional<IterationProof> iteration_proof(const std::string& model_text,
                                              std::string_view claim);

}  // namespace photocoag
