// Role: setup; the parts of the model file that depend on alpha, and the certificate. Used by
// rom/file. Format: docs/model-file.md. Each read_ function throws Error naming the field.
#pragma once

#include "photocoag/rom/certificate.hpp"
#include "photocoag/rom/json_reader.hpp"
#include "photocoag/rom/theta.hpp"

namespace photocoag {

/// `parameters`: 1, alpha; 2, alpha and beta.
Json absorbed_to_json(const AbsorbedFraction& absorbed, int parameters);
AbsorbedFraction read_absorbed(const JsonReader& json, int parameters);

Json theta_to_json(const Theta& theta, int parameters);
Theta read_theta(const JsonReader& json, int parameters);

Json certificate_to_json(const ErrorCertificate& certificate);
/// Validated (ErrorCertificate::validate).
ErrorCertificate read_certificate(const JsonReader& json);

}  // namespace photocoag
