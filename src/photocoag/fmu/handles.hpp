// Role: simulation; instances behind opaque handles, so that an invalid or freed handle is an
// error, not a crash. Used by fmu/calls.hpp. Real time: find() is noexcept, bounded, without a
// lock. Threads: any.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>

namespace photocoag {

/// At most kMost objects at a time.
template <typename T>
class Handles {
 public:
  static constexpr std::size_t kMost = 1024;

  /// The handle of `object`; null if there are too many.
  void* add(std::unique_ptr<T> object) noexcept {
    for (std::size_t slot = 0; slot < kMost; ++slot) {
      T* none = nullptr;
      if (!slots_[slot].object.compare_exchange_strong(none, object.get())) continue;
      static_cast<void>(object.release());
      return reinterpret_cast<void*>(slots_[slot].generation.load() * kMost + slot);
    }
    return nullptr;
  }

  /// Null if it is not the handle of a live object.
  T* find(const void* handle) const noexcept {
    const auto number = reinterpret_cast<std::uintptr_t>(handle);
    const Slot& slot = slots_[number % kMost];
    return slot.generation.load() == number / kMost ? slot.object.load() : nullptr;
  }

  void remove(const void* handle) noexcept {
    const std::unique_ptr<T> object(find(handle));
    if (!object) return;
    Slot& slot = slots_[reinterpret_cast<std::uintptr_t>(handle) % kMost];
    slot.generation.fetch_add(1);
    slot.object.store(nullptr);
  }

 private:
  struct Slot {
    std::atomic<T*> object{nullptr};
    std::atomic<std::uintptr_t> generation{1};  // from 1: no handle is null
  };
  std::array<Slot, kMost> slots_;
};

}  // namespace photocoag
