// Role: setup; the parts of the model file that depend on alpha, and the certificate. Used by
// rom/file. Format: docs/model-file.md. Each read_ function throws Error naming the field.
#pragma once

#include "photocoag/rom/certificate.hpp"
#include "photocoag/rom/json_reader.hpp"
#include "photocoag/rom/theta.hpp"

namespace photocoag {

/// Row by row.
Json matrix_to_json(const Eigen::MatrixXd& matrix);

/// `parameters`: how many, in the order of ScaledBy.
Json absorbed_to_json(const AbsorbedFraction& absorbed, std::size_t parameters);
AbsorbedFraction read_absorbed(const JsonReader& json, std::size_t parameters);

Json theta_to_json(const Theta& theta, std::size_t parameters);
Theta read_theta(const JsonReader& json, std::size_t parameters);

Json certificate_to_json(const ErrorCertificate& certificate);
/// Validated (ErrorCertificate::validate).
ErrorCertificate read_certificate(const JsonReader& json);

}  // namespace photocoag
