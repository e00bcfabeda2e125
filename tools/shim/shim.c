/* Role: tests; a library that is loaded before all others (LD_PRELOAD) and makes the system
 * misbehave: a wall clock that jumps, allocations that fail. Used by `photocoag faults` (rows T6,
 * X3). Linux with glibc.
 *
 * PHOTOCOAG_SHIM_REPORT=DESCRIPTOR: where it says what it does, first of all "loaded": no test
 * passes without it. PHOTOCOAG_SHIM_CLOCK=1: every reading of the wall clock is one hour early,
 * right, one hour late, in turn. Prints "jumped" when the first wrong one is handed out.
 * PHOTOCOAG_SHIM_MALLOC=STEP: runs the program once to count the allocations between main and
 * mlockall (where the treatment loop begins), then once for every STEP-th of them, which fails;
 * each run in a process of its own. A "@" in an argument is replaced by the number. Prints "count
 * N" and "N STATUS" lines (PHOTOCOAG_SHIM_FIRST: number to begin with): exit code, 256 + signal, or
 * 300 if the loop would have begun. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

extern void* __libc_malloc(size_t size);
extern void* __libc_calloc(size_t count, size_t size);
extern void* __libc_realloc(void* old, size_t size);
extern void* __libc_memalign(size_t alignment, size_t size);

enum { kLoopBegins = 100 }; /* exit code of a child that came so far */

static atomic_long allocations = -1; /* -1: not counting */
static long fail_at = 0;             /* 0: none */
static long* counted = NULL;         /* shared with the parent */

static void report(const char* line, long first, long second) {
  const char* descriptor = getenv("PHOTOCOAG_SHIM_REPORT");
  if (descriptor != NULL) dprintf(atoi(descriptor), line, first, second);
}

__attribute__((constructor)) static void loaded(void) { report("loaded\n", 0, 0); }

static int fails(void) {
  if (atomic_load_explicit(&allocations, memory_order_relaxed) < 0) return 0;
  return atomic_fetch_add(&allocations, 1) + 1 == fail_at;
}

static void* none(void) {
  errno = ENOMEM;
  return NULL;
}

void* malloc(size_t size) { return fails() ? none() : __libc_malloc(size); }
void* calloc(size_t count, size_t size) { return fails() ? none() : __libc_calloc(count, size); }
void* realloc(void* old, size_t size) { return fails() ? none() : __libc_realloc(old, size); }
void* memalign(size_t alignment, size_t size) {
  return fails() ? none() : __libc_memalign(alignment, size);
}
void* aligned_alloc(size_t alignment, size_t size) { return memalign(alignment, size); }
int posix_memalign(void** out, size_t alignment, size_t size) {
  void* memory = memalign(alignment, size);
  if (memory == NULL) return ENOMEM;
  *out = memory;
  return 0;
}

int mlockall(int flags) {
  if (counted != NULL) {
    *counted = atomic_load(&allocations);
    _exit(kLoopBegins);
  }
  int (*real)(int) = (int (*)(int))dlsym(RTLD_NEXT, "mlockall");
  return real(flags);
}

static long jump(void) {
  static atomic_long readings = 0;
  static int jumps = -1;
  if (jumps < 0) jumps = getenv("PHOTOCOAG_SHIM_CLOCK") != NULL;
  if (!jumps) return 0;
  const long reading = atomic_fetch_add(&readings, 1);
  if (reading == 0) report("jumped\n", 0, 0);
  return 3600 * (reading % 3 - 1);
}

int clock_gettime(clockid_t clock, struct timespec* now) {
  static int (*real)(clockid_t, struct timespec*) = NULL;
  if (real == NULL) real = (int (*)(clockid_t, struct timespec*))dlsym(RTLD_NEXT, "clock_gettime");
  const int status = real(clock, now);
  if (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE) now->tv_sec += jump();
  return status;
}

int gettimeofday(struct timeval* restrict now, void* restrict zone) {
  struct timespec exact;
  (void)zone;
  if (clock_gettime(CLOCK_REALTIME, &exact) != 0) return -1;
  now->tv_sec = exact.tv_sec;
  now->tv_usec = exact.tv_nsec / 1000;
  return 0;
}

time_t time(time_t* out) {
  struct timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  if (out != NULL) *out = now.tv_sec;
  return now.tv_sec;
}

static int (*real_main)(int, char**, char**) = NULL;

/* One run of the program in a child. Returns what the report shows. */
static int run_child(long number, int argc, char** argv, char** environment) {
  const pid_t child = fork();
  if (child < 0) return -1;
  if (child == 0) {
    const int silent = open("/dev/null", O_RDWR);
    dup2(silent, 1);
    dup2(silent, 2);
    char words[64][512];
    char* numbered[65] = {NULL};
    for (int i = 0; i < argc && i < 64; ++i) {
      const char* at = strchr(argv[i], '@');
      if (at == NULL) {
        snprintf(words[i], sizeof(words[i]), "%s", argv[i]);
      } else {
        snprintf(words[i], sizeof(words[i]), "%.*s%ld%s", (int)(at - argv[i]), argv[i], number,
                 at + 1);
      }
      numbered[i] = words[i];
    }
    fail_at = number;
    atomic_store(&allocations, 0);
    const int code = real_main(argc, numbered, environment);
    atomic_store(&allocations, -1);
    exit(code);
  }
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFSIGNALED(status)) return 256 + WTERMSIG(status);
  return WEXITSTATUS(status) == kLoopBegins ? 300 : WEXITSTATUS(status);
}

static int many_mains(int argc, char** argv, char** environment) {
  const char* step_text = getenv("PHOTOCOAG_SHIM_MALLOC");
  if (step_text == NULL) return real_main(argc, argv, environment);
  const long step = atol(step_text);
  counted = mmap(NULL, sizeof(long), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (counted == MAP_FAILED || step < 1) return 2;
  run_child(0, argc, argv, environment);
  const long count = *counted;
  report("count %ld\n", count, 0);
  const char* first_text = getenv("PHOTOCOAG_SHIM_FIRST");
  for (long n = first_text == NULL ? 1 : atol(first_text); n <= count; n += step) {
    report("%ld %ld\n", n, run_child(n, argc, argv, environment));
  }
  return 0;
}

int __libc_start_main(int (*main)(int, char**, char**), int argc, char** argv, void (*init)(void),
                      void (*fini)(void), void (*rtld_fini)(void), void* stack_end) {
  typedef int (*Start)(int (*)(int, char**, char**), int, char**, void (*)(void), void (*)(void),
                       void (*)(void), void*);
  real_main = main;
  const Start start = (Start)dlsym(RTLD_NEXT, "__libc_start_main");
  return start(many_mains, argc, argv, init, fini, rtld_fini, stack_end);
}
