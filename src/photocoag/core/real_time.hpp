// Role: online; marks functions that must neither block nor allocate. Used by estimation, qp, mpc,
// loop. Source: Clang, "Function Effect Analysis" and RealtimeSanitizer (Clang 20 and later). No
// effect with other compilers. Write it after noexcept: `Decision decide() noexcept
// PHOTOCOAG_NONBLOCKING;`. Built with -fsanitize=realtime (CMake preset `rtsan`), a marked function
// that reaches malloc, a lock, a sleep or I/O ends the program.
#pragma once

#if defined(__clang__) && defined(__has_cpp_attribute)
#if __has_cpp_attribute(clang::nonblocking)
#define PHOTOCOAG_NONBLOCKING [[clang::nonblocking]]
#endif
#endif
#ifndef PHOTOCOAG_NONBLOCKING
#define PHOTOCOAG_NONBLOCKING
#endif

// 1 in a build that checks the marked functions.
#if defined(__has_feature)
#if __has_feature(realtime_sanitizer)
#define PHOTOCOAG_RTSAN 1
#endif
#endif
#ifndef PHOTOCOAG_RTSAN
#define PHOTOCOAG_RTSAN 0
#endif
