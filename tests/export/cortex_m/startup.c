/* Start of a program on QEMU's mps2 boards (Cortex-M4F, M7): vectors, memory, FPU, main; what it
 * says. */
#include <stdint.h>

extern uint32_t stack_top, data_load, data_start, data_end, bss_start, bss_end;
int main(void);
void start(void);

static void halt(void) {
  for (;;) {
  }
}

__attribute__((section(".vectors"), used)) static void (*const vectors[16])(void) = {
    (void (*)(void))(uintptr_t)&stack_top, start, halt, halt, halt, halt, halt};

/* Semihosting: what a debugger, or QEMU, does for the program. */
static uint32_t ask(uint32_t operation, const void* argument) {
  register uint32_t r0 __asm__("r0") = operation;
  register const void* r1 __asm__("r1") = argument;
  __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

void print(const char* text) { ask(0x04, text); }

void print_number(const char* name, uint32_t value) {
  char digits[12];
  char* at = digits + sizeof digits - 1;
  *at = '\0';
  do {
    *--at = (char)('0' + value % 10);
    value /= 10;
  } while (value > 0);
  print(name);
  print(" ");
  print(at);
  print("\n");
}

void start(void) {
  const uint32_t* from = &data_load;
  for (uint32_t* to = &data_start; to < &data_end;) *to++ = *from++;
  for (uint32_t* to = &bss_start; to < &bss_end;) *to++ = 0;
  *(volatile uint32_t*)0xE000ED88 |= 0xFU << 20; /* the FPU */
  __asm__ volatile("dsb\n\tisb");
  main();
  ask(0x18, (const void*)0x20026); /* exit */
  halt();
}
