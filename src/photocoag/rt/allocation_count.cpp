// The calls of malloc and its relatives that a library makes itself, counted: its entries in the
// global offset table lead here.
#include <dlfcn.h>
#include <elf.h>
#include <link.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <new>
#include <string_view>

#include "photocoag/rt/driver_promises.hpp"

namespace photocoag {
namespace {

std::atomic<long> counted{0};

void* counting_malloc(std::size_t size) {
  ++counted;
  return std::malloc(size);
}
void* counting_calloc(std::size_t count, std::size_t size) {
  ++counted;
  return std::calloc(count, size);
}
void* counting_realloc(void* old, std::size_t size) {
  ++counted;
  return std::realloc(old, size);
}
void* counting_aligned_alloc(std::size_t alignment, std::size_t size) {
  ++counted;
  return std::aligned_alloc(alignment, size);
}
int counting_posix_memalign(void** place, std::size_t alignment, std::size_t size) {
  ++counted;
  return ::posix_memalign(place, alignment, size);
}
char* counting_strdup(const char* text) {
  ++counted;
  return ::strdup(text);
}
void* counting_new(std::size_t size) {
  ++counted;
  return ::operator new(size);
}
void* counting_new_array(std::size_t size) {
  ++counted;
  return ::operator new[](size);
}

struct Redirection {
  std::string_view name;
  void* to;
};

const std::array<Redirection, 8>& redirections() {
  static const std::array<Redirection, 8> all = {{
      {"malloc", reinterpret_cast<void*>(counting_malloc)},
      {"calloc", reinterpret_cast<void*>(counting_calloc)},
      {"realloc", reinterpret_cast<void*>(counting_realloc)},
      {"aligned_alloc", reinterpret_cast<void*>(counting_aligned_alloc)},
      {"posix_memalign", reinterpret_cast<void*>(counting_posix_memalign)},
      {"strdup", reinterpret_cast<void*>(counting_strdup)},
      {"_Znwm", reinterpret_cast<void*>(counting_new)},
      {"_Znam", reinterpret_cast<void*>(counting_new_array)},
  }};
  return all;
}

bool is_function_slot(ElfW(Xword) info) {
#if defined(__x86_64__)
  const auto type = ELF64_R_TYPE(info);
  return type == R_X86_64_JUMP_SLOT || type == R_X86_64_GLOB_DAT;
#elif defined(__aarch64__)
  const auto type = ELF64_R_TYPE(info);
  return type == R_AARCH64_JUMP_SLOT || type == R_AARCH64_GLOB_DAT;
#else
  (void)info;
  throw NotTried{"allocations cannot be counted on this kind of machine"};
#endif
}

void write_slot(void** slot, void* value) {
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  const auto start = reinterpret_cast<std::uintptr_t>(slot) & ~(page - 1);
  // The linker may have made the table read-only.
  if (mprotect(reinterpret_cast<void*>(start), page, PROT_READ | PROT_WRITE) != 0) {
    throw NotTried{"the library's table of functions cannot be written to"};
  }
  *slot = value;
}

/// What the dynamic section says of the library's relocations.
struct Dynamic {
  const ElfW(Sym) * symbols = nullptr;
  const char* names = nullptr;
  struct Table {
    const ElfW(Rela) * entries = nullptr;
    std::size_t bytes = 0;
  } data, functions;

  explicit Dynamic(const ElfW(Dyn) * entry) {
    for (; entry->d_tag != DT_NULL; ++entry) {
      const auto address = reinterpret_cast<const void*>(entry->d_un.d_ptr);
      if (entry->d_tag == DT_SYMTAB) symbols = static_cast<const ElfW(Sym)*>(address);
      if (entry->d_tag == DT_STRTAB) names = static_cast<const char*>(address);
      if (entry->d_tag == DT_RELA) data.entries = static_cast<const ElfW(Rela)*>(address);
      if (entry->d_tag == DT_RELASZ) data.bytes = entry->d_un.d_val;
      if (entry->d_tag == DT_JMPREL) functions.entries = static_cast<const ElfW(Rela)*>(address);
      if (entry->d_tag == DT_PLTRELSZ) functions.bytes = entry->d_un.d_val;
    }
  }
};

}  // namespace

void count_allocations(void* library) {
  link_map* map = nullptr;
  if (dlinfo(library, RTLD_DI_LINKMAP, &map) != 0 || map == nullptr) {
    throw NotTried{"the library's place in memory is not known"};
  }
  const Dynamic dynamic(map->l_ld);
  if (dynamic.symbols == nullptr || dynamic.names == nullptr) return;
  for (const Dynamic::Table& table : {dynamic.data, dynamic.functions}) {
    if (table.entries == nullptr) continue;
    for (std::size_t k = 0; k < table.bytes / sizeof(ElfW(Rela)); ++k) {
      const ElfW(Rela)& entry = table.entries[k];
      if (!is_function_slot(entry.r_info)) continue;
      const std::string_view name =
          dynamic.names + dynamic.symbols[ELF64_R_SYM(entry.r_info)].st_name;
      for (const Redirection& one : redirections()) {
        if (one.name != name) continue;
        write_slot(reinterpret_cast<void**>(map->l_addr + entry.r_offset), one.to);
      }
    }
  }
}

long counted_allocations() noexcept { return counted.load(); }

}  // namespace photocoag
