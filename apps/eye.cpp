// `photocoag eye`: a simulated eye with its laser, in a process of its own.
#include <sys/prctl.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <memory>

#include "command.hpp"
#include "configured.hpp"
#include "console.hpp"
#include "options.hpp"
#include "photocoag/config/config.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/core/error.hpp"
#include "photocoag/core/stop_signal.hpp"
#include "photocoag/eye/eye_server.hpp"
#include "photocoag/fom/full_order_model.hpp"
#include "photocoag/rt/eye_link.hpp"
#include "photocoag/run/calibration_file.hpp"
#include "photocoag/run/device_config.hpp"

namespace photocoag {
namespace {

struct EyeOptions : CommonOptions {
  std::string socket = "photocoag-eye.sock";
  bool once = false;                ///< end with the first controller
  int owner = 0;                    ///< end with this parent process; 0: none
  std::vector<std::string> faults;  ///< "ID@cycle", or files of them
  std::string tell;                 ///< do not start an eye: send this line to the one at `socket`
};
int eye_command(const EyeOptions& options) {
  if (!options.tell.empty()) {
    const std::string answer = command_eye(options.socket, options.tell);
    print("{}\n", answer);
    return answer.starts_with("refused") ? 2 : 0;
  }
  // The controller that starts an eye for once has checked the configuration.
  const Config config = options.once ? load_config(options.config, options.set)
                                     : configured(Use::kEye, options.config, options.set);
  const int per_period = pulses_per_period(config);
  const std::string& own_curve = config.photoacoustics.eye_calibration;
  const GrueneisenCurve curve(
      load_curve(own_curve.empty() ? config.photoacoustics.calibration : own_curve));
  FaultScript faults;
  for (const std::string& fault : options.faults) add_faults(fault, faults);
  const auto model = std::make_shared<const FullOrderModel>(config.plant.tissue, config.grid);
  PulsedEye eye(model, config.plant.absorption(), curve,
                {.pulse_period = config.photoacoustics.pulse_period,
                 .noise = config.plant.noise * std::sqrt(static_cast<double>(per_period)),
                 .noise_kind = config.photoacoustics.eye_noise,
                 .dark_is_silent = config.plant.zero_power_sample == ZeroPowerSample::kMissing,
                 .power_max = config.control.power_max,
                 .seed = config.run.seed},
                faults);
  stop_on_signals({SIGTERM});
  if (options.owner != 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != options.owner) return 0;  // the parent has already ended
  }
  if (options.once || options.owner != 0) {
    // Ctrl-C and a closed terminal are handled by the controller: the eye ends when that has gone.
    for (const int theirs : {SIGINT, SIGHUP}) signal(theirs, SIG_IGN);
  } else {
    stop_on_signals({SIGINT, SIGHUP});
    say("photocoag {}: {}\n", version(), kResearchNotice);
    say("eye       {} states, absorption factor {:g}, a pulse every {:g} ms; {}\n", model->states(),
        config.plant.absorption_factor, config.photoacoustics.pulse_period * 1e3, options.socket);
  }
  const EyeStatistics statistics = serve_eye(
      {.socket = options.socket, .once = options.once, .foreign_core = config.safety.core}, eye,
      faults, config.photoacoustics.pulse_period, stop_requested());
  say("{}", to_text(statistics));
  return 0;
}

const Command kEye(
    "eye", "a simulated eye with its laser as a process of its own: pulses, pressure transients",
    eye_command, [](CommandLine& command, EyeOptions& options) {
      add_common(command, options);
      command.add_option("--socket", options.socket, "where controllers connect").type_name("PATH");
      command.add_option("--owner", options.owner, "end with this process, the parent")
          .type_name("PID");
      command.add_flag("--once", options.once, "end when the first controller has gone");
      command
          .add_option("--fault", options.faults,
                      "ID@cycle[+count][*value] of docs/devices.md, or a file with one per line")
          .type_name("FAULT")
          .one_value_each();
      command
          .add_option("--tell", options.tell,
                      "send this line to an eye that runs: status, cold, fault ID@cycle")
          .type_name("TEXT");
      command.footer(
          footer("  photocoag eye --socket /tmp/eye\n"
                 "  photocoag treat --device eye:/tmp/eye\n"
                 "  photocoag eye --socket /tmp/eye --tell 'fault M2@120'\n"
                 "The eye is that of [plant], [photoacoustics] and control.period_ms."));
    });

}  // namespace

}  // namespace photocoag
