// The counter of heap allocations is the solver exam's; it must be compiled into each program that counts.
#include "qp/allocations.cpp"  // NOLINT(bugprone-suspicious-include)
