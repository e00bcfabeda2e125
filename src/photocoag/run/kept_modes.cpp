#include "photocoag/run/kept_modes.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/files.hpp"
#include "photocoag/core/sha256.hpp"

namespace photocoag {
namespace {

namespace fs = std::filesystem;
using Eigen::Index;
using Eigen::VectorXd;

constexpr std::string_view kMagic = "photocoag modes 1\n";
constexpr std::size_t kLargest = 64'000'000;
// Of the largest entry of the matrix; QR steps leave some 1e-14.
constexpr double kResidual = 1e-11;

std::string bytes_of(const VectorXd& values) {
  return {reinterpret_cast<const char*>(values.data()),
          static_cast<std::size_t>(values.size()) * sizeof(double)};
}

std::string checksum(std::string_view content) {
  const auto* bytes = reinterpret_cast<const Bytef*>(content.data());
  return fmt::format("{:08x}\n", crc32_z(0, bytes, content.size()));
}

bool are_eigenpairs(const SymmetricEigen<double>& eigen, const VectorXd& diagonal,
                    const VectorXd& off_diagonal) {
  const Index n = diagonal.size();
  double scale = diagonal.cwiseAbs().maxCoeff();
  if (n > 1) scale = std::max(scale, off_diagonal.cwiseAbs().maxCoeff());
  for (Index j = 0; j < n; ++j) {
    const auto vector = eigen.vectors.col(j);
    VectorXd off = (diagonal.array() - eigen.values[j]).matrix().cwiseProduct(vector);
    off.head(n - 1) += off_diagonal.cwiseProduct(vector.tail(n - 1));
    off.tail(n - 1) += off_diagonal.cwiseProduct(vector.head(n - 1));
    const bool good = off.cwiseAbs().maxCoeff() <= kResidual * scale &&
                      std::abs(vector.squaredNorm() - 1.0) <= kResidual &&
                      (j == 0 || eigen.values[j] >= eigen.values[j - 1]);
    if (!good) return false;  // NaN too
  }
  return true;
}

std::optional<SymmetricEigen<double>> read_modes(const fs::path& path, const VectorXd& diagonal,
                                                 const VectorXd& off_diagonal) {
  const Index n = diagonal.size();
  const auto numbers = static_cast<std::size_t>(n + n * n) * sizeof(double);
  std::error_code error;
  if (!fs::is_regular_file(fs::symlink_status(path, error))) return std::nullopt;
  try {
    const std::string content = read_file(path.string(), kLargest, "file of modes");
    const std::size_t head = kMagic.size() + 9;
    if (content.size() != head + numbers || !content.starts_with(kMagic)) return std::nullopt;
    const std::string_view body = std::string_view(content).substr(head);
    if (content.compare(kMagic.size(), 9, checksum(body)) != 0) return std::nullopt;
    SymmetricEigen<double> eigen{VectorXd(n), Eigen::MatrixXd(n, n), true};
    std::memcpy(eigen.values.data(), body.data(), static_cast<std::size_t>(n) * sizeof(double));
    std::memcpy(eigen.vectors.data(), body.data() + static_cast<std::size_t>(n) * sizeof(double),
                static_cast<std::size_t>(n * n) * sizeof(double));
    if (!are_eigenpairs(eigen, diagonal, off_diagonal)) return std::nullopt;
    return eigen;
  } catch (const Error&) {
    return std::nullopt;  // recomputed, and the file replaced
  }
}

void drop_the_oldest(const fs::path& folder) {
  std::vector<std::pair<fs::file_time_type, fs::path>> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.path().filename().string().starts_with("modes-")) {
      files.emplace_back(entry.last_write_time(), entry.path());
    }
  }
  if (files.size() <= kMostKeptModes) return;
  std::sort(files.begin(), files.end());
  for (std::size_t i = 0; i + kMostKeptModes < files.size(); ++i) fs::remove(files[i].second);
}

void write_modes(const fs::path& path, const SymmetricEigen<double>& eigen) {
  try {
    fs::create_directories(path.parent_path());
    // Replace links and pipes too: the folder belongs to the cache.
    const fs::file_status there = fs::symlink_status(path);
    if (fs::exists(there) && !fs::is_regular_file(there)) fs::remove(path);
    std::string body = bytes_of(eigen.values);
    body.append(reinterpret_cast<const char*>(eigen.vectors.data()),
                static_cast<std::size_t>(eigen.vectors.size()) * sizeof(double));
    write_file(path.string(), std::string(kMagic) + checksum(body) + body);
    drop_the_oldest(path.parent_path());
  } catch (const std::exception&) {
    // A cache that cannot be written only costs some milliseconds at the next start.
  }
}

}  // namespace

Diagonalize kept_modes(std::string folder) {
  return [folder = std::move(folder)](const VectorXd& diagonal, const VectorXd& off_diagonal) {
    if (folder.empty()) return tridiagonal_eigen(diagonal, off_diagonal);
    const std::string key =
        sha256_hex(std::string(source_hash()) + bytes_of(diagonal) + bytes_of(off_diagonal));
    const fs::path path = fs::path(folder) / fmt::format("modes-{}.bin", key.substr(0, 32));
    if (auto kept = read_modes(path, diagonal, off_diagonal)) {
      std::error_code error;  // mark as used
      fs::last_write_time(path, fs::file_time_type::clock::now(), error);
      return *std::move(kept);
    }
    SymmetricEigen<double> eigen = tridiagonal_eigen(diagonal, off_diagonal);
    if (eigen.converged) write_modes(path, eigen);
    return eigen;
  };
}

}  // namespace photocoag
