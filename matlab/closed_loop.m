function [power, peak] = closed_loop(model_file, absorption_factor, periods)
% CLOSED_LOOP  The controller (MEX) treats the reduced model at another absorption factor. Before:
%   ./photocoag reduce --out first.json
%   ./photocoag export-c --out controller      and here: photocoag_build('controller')
% power: W, of every period; peak: K, of the model. Research software, not a medical device.
  if nargin < 1
    model_file = 'first.json';
  end
  if nargin < 3
    absorption_factor = 1.1;
    periods = 250;
  end
  eye = photocoag_model(model_file, absorption_factor);
  about = photocoag_controller('about');
  if abs(about.period_s - eye.period) > 1e-12
    error('photocoag:period', 'the controller is for %g s, the model for %g s', about.period_s, eye.period);
  end
  [controller, next] = photocoag_controller('new');
  freed = onCleanup(@() photocoag_controller('free', controller));
  x = zeros(size(eye.A_d, 1), 1);
  power = zeros(periods, 1);
  peak = zeros(periods, 1);
  estimate = zeros(periods, 1);
  for k = 1:periods
    power(k) = next;
    x = eye.A_d * x + eye.B_d * power(k);
    y = eye.C * x;
    peak(k) = y(2);
    [next, decision] = photocoag_controller('step', controller, y(1), power(k));
    estimate(k) = decision.peak_K;
  end
  fprintf('%d periods, peak at most %.2f K, estimated absorption factor %.3f\n', periods, max(peak), decision.absorption);
  if usejava('desktop') || ~isempty(getenv('DISPLAY'))
    plot(1:periods, peak, 1:periods, estimate);
    xlabel('period'); ylabel('peak temperature rise, K'); legend('model', 'estimate');
  end
end
