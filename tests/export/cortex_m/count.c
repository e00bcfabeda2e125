/* Replays recorded periods and counts the instructions of each with SysTick, which QEMU moves by
 * virtual time: with -icount shift=0 an instruction is 1 ns, a tick of 25 MHz 40 instructions. */
#include <math.h>
#include <stdint.h>

#include "pc_controller.h"
#include "recorded.h" /* RECORDED, recorded[][3]: first of a treatment, sample, applied power */

#define TICK 40
#define TICKS (*(volatile uint32_t*)0xE000E018)
#define STACK 2048 /* words that are looked at */

void print_number(const char* name, uint32_t value);

static pc_controller controller;
static float powers;

static void step(const float* period) {
  if (period[0] > 0) {
    pc_controller_init(&controller);
    powers += pc_controller_start(&controller);
  } else if (isnan(period[1])) {
    powers += pc_controller_step_without_sample(&controller, period[2]);
  } else {
    powers += pc_controller_step(&controller, period[1], period[2]);
  }
}

/* Words below here that a period has written to. */
static uint32_t __attribute__((noinline)) stack_of(const float* period) {
  volatile uint32_t* here = __builtin_frame_address(0);
  volatile uint32_t* const lowest = here - STACK;
  for (volatile uint32_t* word = lowest; word < here - 64; ++word) *word = 0xA5A5A5A5U;
  step(period);
  volatile uint32_t* word = lowest;
  while (word < here - 64 && *word == 0xA5A5A5A5U) ++word;
  return (uint32_t)(here - word);
}

int main(void) {
  *(volatile uint32_t*)0xE000E014 = 0xFFFFFF;
  *(volatile uint32_t*)0xE000E010 = 5;
  uint32_t worst = 0;
  uint32_t stack = 0;
  uint64_t sum = 0;
  uint32_t before = TICKS;
  const uint32_t nothing = before - TICKS;
  for (int n = 0; n < RECORDED; ++n) {
    before = TICKS;
    step(recorded[n]);
    const uint32_t ticks = ((before - TICKS) & 0xFFFFFF) - nothing;
    sum += ticks;
    if (ticks > worst) worst = ticks;
  }
  const float power = powers / RECORDED;
  for (int n = 0; n < RECORDED; ++n) {
    const uint32_t words = stack_of(recorded[n]);
    if (words > stack) stack = words;
  }
  print_number("mean", (uint32_t)(sum * TICK / RECORDED));
  print_number("worst", worst * TICK);
  print_number("state", sizeof controller);
  print_number("stack", 4 * stack);
  print_number("power_nW", (uint32_t)(1e9F * power));
  return 0;
}
