// Role: setup; memory shared by descriptor between processes, its size sealed. Used by rt and eye.
// Source: docs/devices.md, "Transports".
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

/// A new zero-filled T with its descriptor; `others`: whether other processes may map it writable.
/// Throws Error.
template <typename T>
Mapped<T> make_sealed(Access others, int& descriptor) {
  return Mapped<T>(static_cast<T*>(detail::make_sealed(sizeof(T), others, descriptor)),
                   Unmap{sizeof(T)});
}

/// Maps memory from another process and closes the descriptor. Null unless it is sealed and at
/// least of T's size: shrinking it would crash this process.
template <typename T>
Mapped<T> map_sealed(int descriptor, Access access) noexcept {
  return Mapped<T>(static_cast<T*>(detail::map_sealed(descriptor, sizeof(T), access)),
                   Unmap{sizeof(T)});
}

/// A zero-filled T, private to this process. Throws Error.
template <typename T>
Mapped<T> make_private() {
  return Mapped<T>(static_cast<T*>(detail::map_private(sizeof(T))), Unmap{sizeof(T)});
}

}  // namespace photocoag
