// Role: setup; memory that processes share by descriptor and whose size nobody can change any more.
// Used by rt and eye. Source: docs/devices.md, "Transports".
#pragma once

#include <cstddef>
#include <memory>

namespace photocoag {

struct Unmap {
  std::size_t size = 0;
  void operator()(const void* memory) const noexcept;
};
template <typename T>
using Mapped = std::unique_ptr<T, Unmap>;

enum class Access { kRead, kWrite };

namespace detail {
void* make_sealed(std::size_t size, Access others, int& descriptor);
void* map_sealed(int descriptor, std::size_t size, Access access) noexcept;
void* map_private(std::size_t size);
}  // namespace detail

/// A new T of zeros with its descriptor; `others` may map it to read, or also to write. Throws
/// Error.
template <typename T>
Mapped<T> make_sealed(Access others, int& descriptor) {
  return Mapped<T>(static_cast<T*>(detail::make_sealed(sizeof(T), others, descriptor)),
                   Unmap{sizeof(T)});
}

/// Maps what came from another process and closes the descriptor. Null unless it is sealed memory
/// of T's size or more: whoever could shrink it could end this process.
template <typename T>
Mapped<T> map_sealed(int descriptor, Access access) noexcept {
  return Mapped<T>(static_cast<T*>(detail::map_sealed(descriptor, sizeof(T), access)),
                   Unmap{sizeof(T)});
}

/// A T of zeros for this process alone. Throws Error.
template <typename T>
Mapped<T> make_private() {
  return Mapped<T>(static_cast<T*>(detail::map_private(sizeof(T))), Unmap{sizeof(T)});
}

}  // namespace photocoag
