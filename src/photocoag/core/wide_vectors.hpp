// Role: simulation; lets a loop over plain arrays use the processor's wider vector registers where
// there are any, in a program built for every processor. Used by fom, eye. The bits of the results
// are the same: element by element, and no product is contracted with a sum.
#pragma once

// GCC on x86-64 with glibc chooses the version when the program is loaded; the sanitizers' own
// start-up does not get on with that.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define PHOTOCOAG_WIDE_VECTORS __attribute__((target_clones("avx2", "default")))
#else
#define PHOTOCOAG_WIDE_VECTORS
#endif
