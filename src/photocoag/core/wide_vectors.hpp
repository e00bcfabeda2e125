// Role: simulation; lets a loop over plain arrays use AVX2 where the processor has it, in a
// portable build. Used by fom, rom, eye, safety, crosscheck. Results are bit-identical: element by
// element, no fused multiply-add.
#pragma once

// GCC on x86-64 with glibc chooses the version at load time (ifunc), which sanitizers do not
// support.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define PHOTOCOAG_WIDE_VECTORS __attribute__((target_clones("avx2", "default")))
#else
#define PHOTOCOAG_WIDE_VECTORS
#endif
