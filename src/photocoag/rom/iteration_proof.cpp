#include "photocoag/rom/iteration_proof.hpp"

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/sha256.hpp"
#include "photocoag/rom/json_reader.hpp"

namespace photocoag {
namespace {

constexpr const char* kKey = "iteration_proofs";
constexpr std::size_t kMostProofs = 100;

Json parse(const std::string& text) {
  try {
    return Json::parse(text);
  } catch (const Json::exception& error) {
    throw Error(ErrorParts{.problem = fmt::format("not a complete model file: {}", error.what())});
  }
}

// Of the model without its proofs, the claim and the build.
std::string binding(Json model, std::string_view claim) {
  model.erase("checksum");
  model.erase(kKey);
  return sha256_hex(fmt::format("{}\n{}\n{}", sha256_hex(model.dump()), claim, source_hash()));
}

}  // namespace

std::string with_iteration_proof(const std::string& model_text, const IterationProof& proof) {
  Json model = parse(model_text);
  const std::string bound_to = binding(model, proof.claim);
  Json proofs = Json::array();
  for (const Json& old : model.value(kKey, Json::array())) {
    if (old.value("claim", "") != proof.claim && proofs.size() + 1 < kMostProofs) {
      proofs.push_back(old);
    }
  }
  proofs.push_back({{"claim", proof.claim},
                    {"changes_seen", proof.seen},
                    {"changes_proved", proof.proved},
                    {"hard_bound", proof.hard_bound},
                    {"share_of_box", proof.share},
                    {"covers_rounding", proof.covers_rounding},
                    {"boxes", proof.boxes},
                    {"binding", bound_to}});
  model.erase("checksum");
  model[kKey] = std::move(proofs);
  model["checksum"] = sha256_hex(model.dump());
  return model.dump(1) + "\n";
}

std::optional<IterationProof> iteration_proof(const std::string& model_text,
                                              std::string_view claim) {
  const Json model = parse(model_text);
  const JsonReader reader(model, "model file");
  if (!reader.has(kKey)) return std::nullopt;
  const std::string bound_to = binding(model, claim);
  for (const JsonReader& entry : reader[kKey].list(kMostProofs)) {
    if (entry["binding"].text() != bound_to || entry["claim"].text() != claim) continue;
    return IterationProof{.claim = std::string(claim),
                          .seen = static_cast<int>(entry["changes_seen"].count()),
                          .proved = static_cast<int>(entry["changes_proved"].count()),
                          .hard_bound = static_cast<int>(entry["hard_bound"].count()),
                          .share = entry["share_of_box"].number(),
                          .covers_rounding = entry["covers_rounding"].boolean(),
                          .boxes = entry["boxes"].count()};
  }
  return std::nullopt;
}

}  // namespace photocoag
