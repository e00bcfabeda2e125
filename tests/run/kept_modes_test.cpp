// Eigenpairs in files: the bits of those computed, and nothing that is not of the matrix.
#include "photocoag/run/kept_modes.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "support/temporary_folder.hpp"

namespace photocoag::testing {
namespace {

namespace fs = std::filesystem;
using Eigen::VectorXd;

struct Chain {
  VectorXd diagonal;
  VectorXd beside;
};

Chain chain(Eigen::Index n, double stiffness) {
  Chain made{VectorXd(n), VectorXd(n - 1)};
  for (Eigen::Index i = 0; i < n; ++i) made.diagonal[i] = 2.0 * stiffness + 0.1 * std::sin(i);
  made.beside.setConstant(-stiffness);
  return made;
}

bool same(const SymmetricEigen<double>& a, const SymmetricEigen<double>& b) {
  return a.converged && b.converged && a.values == b.values && a.vectors == b.vectors;
}

std::string content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void write(const fs::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

class KeptModes : public ::testing::Test {
 protected:
  std::vector<fs::path> files() const {
    std::vector<fs::path> found;
    for (const auto& entry : fs::directory_iterator(folder_.path())) found.push_back(entry.path());
    return found;
  }
  SymmetricEigen<double> ask(const Chain& of) const {
    return kept_modes(folder_.path().string())(of.diagonal, of.beside);
  }

  TemporaryFolder folder_;
};

TEST_F(KeptModes, AreReadAndHaveTheBitsOfThoseComputed) {
  const Chain one = chain(40, 1e3);
  const SymmetricEigen<double> computed = tridiagonal_eigen(one.diagonal, one.beside);
  EXPECT_TRUE(same(ask(one), computed));
  ASSERT_EQ(files().size(), 1U);
  EXPECT_TRUE(same(ask(one), computed));
  // What is read is the file's: a vector with the other sign is an eigenvector, too.
  std::string text = content(files()[0]);
  const std::size_t head = text.find('\n') + 1;
  char* vector = text.data() + head + 9 + 40 * sizeof(double);
  for (int i = 0; i < 40; ++i) {
    double value = 0.0;
    std::memcpy(&value, vector + i * 8, 8);
    value = -value;
    std::memcpy(vector + i * 8, &value, 8);
  }
  const auto* body = reinterpret_cast<const Bytef*>(text.data() + head + 9);
  char sum[10];
  std::snprintf(sum, sizeof sum, "%08lx",
                crc32(0, body, static_cast<uInt>(text.size() - head - 9)));
  write(files()[0], text.substr(0, head) + sum + "\n" + text.substr(head + 9));
  EXPECT_EQ(ask(one).vectors.col(0), -computed.vectors.col(0));
}

TEST_F(KeptModes, WhatIsNotOfTheMatrixIsReplaced) {
  const Chain one = chain(40, 1e3);
  const Chain other = chain(40, 1.001e3);
  const SymmetricEigen<double> computed = tridiagonal_eigen(one.diagonal, one.beside);
  ask(one);
  const fs::path file = files().at(0);
  const std::string good = content(file);
  ask(other);
  std::string foreign;
  for (const fs::path& path : files()) {
    if (path != file) foreign = content(path);
  }
  std::string flipped = good;
  flipped[good.size() / 2] = static_cast<char>(flipped[good.size() / 2] ^ 1);
  for (const std::string& bad :
       {foreign, flipped, good.substr(0, good.size() - 8), std::string()}) {
    ASSERT_NE(bad, good);
    write(file, bad);
    EXPECT_TRUE(same(ask(one), computed));
    EXPECT_EQ(content(file), good);
  }
}

TEST_F(KeptModes, ALinkIsReplacedAndItsTargetStays) {
  const Chain one = chain(20, 1.0);
  ask(one);
  const fs::path file = files().at(0);
  const TemporaryFolder elsewhere;
  write(elsewhere.path() / "precious", "mine");
  fs::remove(file);
  fs::create_symlink(elsewhere.path() / "precious", file);
  ask(one);
  EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(file)));
  EXPECT_EQ(content(elsewhere.path() / "precious"), "mine");
}

TEST_F(KeptModes, OnlySoManyStay) {
  for (int k = 0; k < 12; ++k) ask(chain(5 + k, 1.0));
  EXPECT_EQ(files().size(), kMostKeptModes);
}

TEST_F(KeptModes, WithoutAFolderNothingIsWritten) {
  const Chain one = chain(12, 2.0);
  EXPECT_TRUE(same(kept_modes("")(one.diagonal, one.beside), ask(one)));
  EXPECT_EQ(files().size(), 1U);
}

}  // namespace
}  // namespace photocoag::testing
