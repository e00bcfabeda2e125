/* The exported controller stepped through recorded samples: a line "volume
 * temperature in K, power in W" of every period on standard input (nan: no sample), its power of
 * every period on standard output. The last one is of the period after. Research software, not a
 * medical device. */
#include <stdio.h>

#include "pc_controller.h"

static pc_controller controller;

int main(void) {
  pc_controller_init(&controller);
  printf("%.17g\n", (double)pc_controller_start(&controller));
  double sample, applied;
  while (scanf("%lf %lf", &sample, &applied) == 2) {
    printf("%.17g\n", (double)pc_controller_step(&controller, (pc_real)sample, (pc_real)applied));
  }
  return 0;
}
