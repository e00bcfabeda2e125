#include "photocoag/core/sha256.hpp"

// The functions of OpenSSL 1.1: those of version 3 set themselves up at their first call, and crash
// if that finds no memory.
#define OPENSSL_API_COMPAT 0x10100000L
#include <fmt/format.h>
#include <openssl/sha.h>

#include <array>

#include "photocoag/core/error.hpp"

namespace photocoag {

std::string sha256_hex(std::string_view bytes) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest{};
  SHA256_CTX state;
  if (SHA256_Init(&state) != 1 || SHA256_Update(&state, bytes.data(), bytes.size()) != 1 ||
      SHA256_Final(digest.data(), &state) != 1) {
    throw Error("SHA-256 failed in the OpenSSL library");
  }
  std::string text;
  for (const unsigned char byte : digest) text += fmt::format("{:02x}", byte);
  return text;
}

}  // namespace photocoag
