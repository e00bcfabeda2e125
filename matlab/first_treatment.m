function first_treatment(mat_file, model_file)
% FIRST_TREATMENT  A run's table beside its reduced model, as docs/run-folder.md describes it. Before:
%   ./photocoag simulate --out runs/first
%   ./photocoag convert runs/first --mat first.mat
%   ./photocoag reduce --out first.json
% Research software, not a medical device.
  if nargin < 2
    mat_file = 'first.mat';
    model_file = 'first.json';
  end
  run = load(mat_file);
  cycles = run.cycles;
  fprintf('%d cycles, columns in run.units: power_W in %s\n', numel(cycles.time_s), run.units.power_W);
  fprintf('peak at most %.2f K\n', max(cycles.peak_true_K));

  % The same powers into the reduced model: what the controller believed at the end.
  model = photocoag_model(model_file, cycles.absorption_estimate(end));
  x = zeros(size(model.A, 1), 1);
  y = zeros(2, numel(cycles.power_W));
  for k = 1:numel(cycles.power_W)
    x = model.A_d * x + model.B_d * cycles.power_W(k);
    y(:, k) = model.C * x;
  end
  fprintf('reduced model: largest distance from the true peak %.2f K\n', max(abs(y(2, :).' - cycles.peak_true_K)));

  if usejava('desktop') || ~isempty(getenv('DISPLAY'))
    plot(1e3 * cycles.time_s, cycles.peak_true_K, 1e3 * cycles.time_s, y(2, :));
    xlabel('time, ms'); ylabel('peak temperature rise, K'); legend('true', 'reduced model');
  end
end
