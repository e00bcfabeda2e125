/* The controller that `photocoag export-c` writes, step by step from MATLAB and Octave. Built by
 * photocoag_build.m; how to call it: photocoag_controller.m. Research software, not a medical
 * device; THE SUPERVISOR IS NOT IN IT. Controllers are stored here and referred to by numbers, so
 * that using one that was freed or never made is an error and not a crash. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "mex.h"
#include "pc_controller.h"

#define MOST 64

static pc_controller controllers[MOST];
static uint32_t made[MOST]; /* number of the controller in that place, 0: none */
static uint32_t last_made;

static void refuse(const char* which, const char* why) {
  mexErrMsgIdAndTxt("photocoag:controller", "photocoag_controller: %s: %s", which, why);
}

static bool is_real_number(const mxArray* value) {
  return mxIsDouble(value) && !mxIsComplex(value) && !mxIsSparse(value) &&
         mxGetNumberOfElements(value) == 1;
}

static double number_of(const mxArray* value, const char* which) {
  if (!is_real_number(value)) refuse(which, "one real number of class double is accepted");
  return mxGetScalar(value);
}

/* The place of a controller. */
static int place_of(const mxArray* value) {
  const double number = number_of(value, "controller");
  int place = 0;
  while (place < MOST && !(made[place] != 0 && number == (double)made[place])) ++place;
  if (place == MOST) refuse("controller", "not one that 'new' has given, or freed since");
  return place;
}

static mxArray* decision_of(const pc_controller* controller) {
  static const char* const kStatus[] = {"solved", "relaxed", "failed", "kkt_failed", "bad_input"};
  static const char* const kGate[] = {"passed", "not_finite", "outside"};
  static const char* const kSample[] = {"updated", "none", "outlier", "restarted"};
  const char* names[] = {"status",      "gate",         "sample",     "power_reference_W",
                         "peak_K",      "peak_sigma_K", "absorption", "solver_iterations",
                         "limit_active"};
  const pc_decision* made_of = &controller->decision;
  mxArray* about = mxCreateStructMatrix(1, 1, (int)(sizeof names / sizeof *names), names);
  mxSetField(about, 0, "status", mxCreateString(kStatus[made_of->status]));
  mxSetField(about, 0, "gate", mxCreateString(kGate[made_of->gate]));
  mxSetField(about, 0, "sample", mxCreateString(kSample[made_of->sample]));
  mxSetField(about, 0, "power_reference_W", mxCreateDoubleScalar((double)made_of->power_reference));
  mxSetField(about, 0, "peak_K", mxCreateDoubleScalar((double)pc_controller_peak(controller)));
  mxSetField(about, 0, "peak_sigma_K",
             mxCreateDoubleScalar((double)pc_controller_peak_sigma(controller)));
  mxSetField(about, 0, "absorption", mxCreateDoubleScalar((double)controller->filter.alpha));
  mxSetField(about, 0, "solver_iterations", mxCreateDoubleScalar(made_of->changes));
  mxSetField(about, 0, "limit_active", mxCreateLogicalScalar(made_of->limit_active));
  return about;
}

static void give_power(int nlhs, mxArray* plhs[], const pc_controller* controller) {
  plhs[0] = mxCreateDoubleScalar((double)controller->decision.power);
  if (nlhs > 1) plhs[1] = decision_of(controller);
}

/* [controller, power, decision] = photocoag_controller('new') */
static void make(int nlhs, mxArray* plhs[]) {
  int place = 0;
  while (place < MOST && made[place] != 0) ++place;
  if (place == MOST) refuse("new", "64 controllers at a time; 'free' those that are not needed");
  if (last_made == UINT32_MAX) refuse("new", "no numbers left; clear photocoag_controller");
  pc_controller_init(&controllers[place]);
  (void)pc_controller_start(&controllers[place]);
  made[place] = ++last_made;
  plhs[0] = mxCreateDoubleScalar((double)made[place]);
  if (nlhs > 1) give_power(nlhs - 1, plhs + 1, &controllers[place]);
}

/* [power, decision] = photocoag_controller('step', controller, volume_temperature, applied_power)
 */
static void step(int nlhs, mxArray* plhs[], const mxArray* prhs[]) {
  pc_controller* controller = &controllers[place_of(prhs[1])];
  const double applied = number_of(prhs[3], "applied_power");
  if (mxIsDouble(prhs[2]) && mxIsEmpty(prhs[2])) {
    (void)pc_controller_step_without_sample(controller, (pc_real)applied);
  } else {
    const double sample = number_of(prhs[2], "volume_temperature (or [], no sample)");
    (void)pc_controller_step(controller, (pc_real)sample, (pc_real)applied);
  }
  give_power(nlhs, plhs, controller);
}

/* about = photocoag_controller('about') */
static void tell(mxArray* plhs[]) {
  const char* names[] = {"period_s", "horizon", "order", "precision"};
  plhs[0] = mxCreateStructMatrix(1, 1, (int)(sizeof names / sizeof *names), names);
  mxSetField(plhs[0], 0, "period_s", mxCreateDoubleScalar((double)PC_PERIOD));
  mxSetField(plhs[0], 0, "horizon", mxCreateDoubleScalar(PC_HORIZON));
  mxSetField(plhs[0], 0, "order", mxCreateDoubleScalar(PC_ORDER));
  mxSetField(plhs[0], 0, "precision", mxCreateString(sizeof(pc_real) == 8 ? "double" : "single"));
}

typedef struct {
  const char* name;
  int inputs;  /* including the name itself */
  int outputs; /* maximum */
} call;

static const call kCalls[] = {{"new", 1, 3}, {"step", 4, 2}, {"free", 2, 0}, {"about", 1, 1}};
enum { NEW, STEP, FREE, ABOUT, CALLS };

void mexFunction(int nlhs, mxArray* plhs[], int nrhs, const mxArray* prhs[]) {
  char name[8] = "";
  int which = 0;
  if (nrhs < 1 || !mxIsChar(prhs[0]) || mxGetM(prhs[0]) != 1 ||
      mxGetString(prhs[0], name, sizeof name) != 0) {
    name[0] = '\0';
  }
  while (which < CALLS && strcmp(name, kCalls[which].name) != 0) ++which;
  if (which == CALLS) refuse("first argument", "'new', 'step', 'free' and 'about' are accepted");
  if (nrhs != kCalls[which].inputs || nlhs > kCalls[which].outputs) {
    refuse(name, "another number of arguments or results; see help photocoag_controller");
  }
  if (which == NEW) make(nlhs, plhs);
  if (which == STEP) step(nlhs, plhs, prhs);
  if (which == FREE) made[place_of(prhs[1])] = 0;
  if (which == ABOUT) tell(plhs);
}
