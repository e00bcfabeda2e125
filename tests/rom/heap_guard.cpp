// Replacing malloc works per program: the guard is compiled into this one.
#include "support/heap_guard.cpp"
