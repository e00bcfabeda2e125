/* A driver for an instrument that speaks lines of text over TCP (fake_instrument.py), as
 * docs/own-driver.md writes it step by step. Settings: "port=N", default 5025, on this machine. */
#define _GNU_SOURCE /* ppoll */
#include <arpa/inet.h>
#include <errno.h>
#include <math.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "photocoag/device/driver.h"

static const double kVoltsPerKelvin = 0.1;

typedef struct {
  int socket;
  int64_t period_ns;
  char text[4096]; /* received and not yet read */
  size_t size;
  uint64_t token;    /* of the last power taken */
  uint64_t sequence; /* of the last sample handed out */
  int64_t time_ns;   /* of that sample */
  int has_next;      /* one that has come after a dropped one */
  uint64_t next_sequence;
  photocoag_sample next;
  photocoag_readback next_readback;
  photocoag_readback readback; /* of the period of the last sample */
} bench;

static int64_t now_ns(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

/* 1. A word to the instrument: it must not block, a line is either sent or the bench has gone. */
static int32_t say(const bench* b, const char* line) {
  const size_t size = strlen(line);
  const ssize_t sent = send(b->socket, line, size, MSG_DONTWAIT | MSG_NOSIGNAL);
  return sent == (ssize_t)size ? PHOTOCOAG_GOOD : PHOTOCOAG_GONE;
}

static int32_t bench_open(void** device, const char* settings, char* message, uint32_t size) {
  const char* port = strstr(settings, "port=");
  struct sockaddr_in address = {.sin_family = AF_INET};
  address.sin_port = htons((uint16_t)(port != NULL ? strtol(port + 5, NULL, 10) : 5025));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  bench* b = calloc(1, sizeof *b);
  if (b == NULL) return PHOTOCOAG_GONE;
  b->socket = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (b->socket < 0 || connect(b->socket, (struct sockaddr*)&address, sizeof address) != 0) {
    snprintf(message, size, "no instrument at port %d: %s", ntohs(address.sin_port),
             strerror(errno));
    if (b->socket >= 0) close(b->socket);
    free(b);
    return PHOTOCOAG_GONE;
  }
  const int yes = 1; /* a power does not wait for more to send */
  setsockopt(b->socket, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  b->readback = (photocoag_readback){0.0, 0.0, 1, 1, 1};
  *device = b;
  return PHOTOCOAG_GOOD;
}

static int32_t bench_arm(void* device, int64_t period_ns) {
  bench* b = device;
  char line[64];
  b->period_ns = period_ns;
  snprintf(line, sizeof line, "PERIOD %lld\n", (long long)period_ns);
  return say(b, line);
}

/* 2. A line from the instrument, at the latest at the deadline. */
static int32_t read_line(bench* b, int64_t deadline_ns, char* line, size_t room) {
  for (;;) {
    char* end = memchr(b->text, '\n', b->size);
    if (end != NULL) {
      const size_t length = (size_t)(end - b->text);
      if (length >= room) return PHOTOCOAG_GONE;
      memcpy(line, b->text, length);
      line[length] = '\0';
      b->size -= length + 1;
      memmove(b->text, end + 1, b->size);
      return PHOTOCOAG_GOOD;
    }
    const int64_t left = deadline_ns - now_ns();
    if (left <= 0) return PHOTOCOAG_TIMEOUT;
    struct pollfd input = {.fd = b->socket, .events = POLLIN};
    const struct timespec wait = {.tv_sec = (time_t)(left / 1000000000),
                                  .tv_nsec = (long)(left % 1000000000)};
    if (ppoll(&input, 1, &wait, NULL) <= 0) continue;
    const ssize_t got = recv(b->socket, b->text + b->size, sizeof b->text - b->size, MSG_DONTWAIT);
    if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) return PHOTOCOAG_GONE;
    if (got > 0) b->size += (size_t)got;
  }
}

/* 3. One sample per period, in order: for one that was dropped the next one's arrival is the word,
 * and it is handed out without a temperature. */
static int32_t bench_wait_sample(void* device, int64_t deadline_ns, photocoag_sample* sample) {
  bench* b = device;
  if (!b->has_next) {
    char line[256];
    const int32_t answer = read_line(b, deadline_ns, line, sizeof line);
    if (answer != PHOTOCOAG_GOOD) return answer;
    unsigned long long number = 0;
    long long time_ns = 0;
    double volts = NAN, emitted = NAN, command = NAN;
    int interlock = 0;
    if (sscanf(line, "SAMPLE %llu %lld %lf %lf %lf %d", &number, &time_ns, &volts, &emitted,
               &command, &interlock) != 6) {
      return PHOTOCOAG_GONE; /* not our instrument */
    }
    b->next_sequence = number;
    b->next = (photocoag_sample){.volume_temperature = volts / kVoltsPerKelvin,
                                 .raw = (int64_t)(volts * 1e6),
                                 .sequence = number,
                                 .time_ns = time_ns};
    b->next_readback = (photocoag_readback){emitted, command, interlock, 1, 1};
    b->has_next = 1;
    if (b->sequence == 0) b->time_ns = time_ns - (int64_t)number * b->period_ns;
  }
  ++b->sequence;
  b->time_ns += b->period_ns;
  if (b->next_sequence > b->sequence) {
    *sample = (photocoag_sample){
        .volume_temperature = NAN, .sequence = b->sequence, .time_ns = b->time_ns};
    return PHOTOCOAG_GOOD; /* the readback stays that of the period before */
  }
  b->has_next = 0;
  *sample = b->next;
  b->time_ns = sample->time_ns;
  b->readback = b->next_readback;
  return PHOTOCOAG_GOOD;
}

/* 4. An old command is no command, and what is no power is none either. */
static int32_t bench_write_power(void* device, double power, uint64_t token) {
  bench* b = device;
  if (token <= b->token) return PHOTOCOAG_TIMEOUT;
  if (!(power >= 0.0 && power <= 1.0)) return PHOTOCOAG_GONE;
  char line[96];
  snprintf(line, sizeof line, "POWER %llu %.17g\n", (unsigned long long)token, power);
  b->token = token;
  return say(b, line);
}

static int32_t bench_readback(void* device, photocoag_readback* readback) {
  *readback = ((bench*)device)->readback;
  return PHOTOCOAG_GOOD;
}

static int32_t bench_heartbeat(void* device, uint64_t cycle) {
  (void)device;
  (void)cycle; /* the watchdog lives in the instrument and is fed by tokens alone */
  return PHOTOCOAG_GOOD;
}

static void bench_safe_off(void* device) { say(device, "OFF\n"); }

static void bench_close(void* device) {
  bench* b = device;
  say(b, "OFF\n");
  close(b->socket); /* the end of the connection is 0 W, too */
  free(b);
}

const photocoag_driver_table* photocoag_driver(void) {
  static const photocoag_driver_table table = {.version = PHOTOCOAG_DRIVER_VERSION,
                                               .size = sizeof(photocoag_driver_table),
                                               .name = "bench over TCP",
                                               .simulated = 1,
                                               .open = bench_open,
                                               .arm = bench_arm,
                                               .wait_sample = bench_wait_sample,
                                               .write_power = bench_write_power,
                                               .readback = bench_readback,
                                               .heartbeat = bench_heartbeat,
                                               .safe_off = bench_safe_off,
                                               .close = bench_close};
  return &table;
}
