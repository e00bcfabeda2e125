function model = photocoag_model(file, absorption_factor, choroid_factor)
% PHOTOCOAG_MODEL  Matrices of a reduced model file at one absorption factor.
%
%   model = photocoag_model(file, absorption_factor)
%   model = photocoag_model(file, absorption_factor, choroid_factor)
%
% file: made by `photocoag reduce --out file`. Fields of model:
%   A, B, C, D         continuous time, x' = A x + B u, y = C x; u: commanded power, W;
%                      y: volume and peak temperature rise over ambient, K
%   A_d, B_d, period   the same for one control period, s
%   ss                 ss(A, B, C, D) with names, where there is one (Control System Toolbox; Octave: pkg load control)
% Research software, not a medical device. For MATLAB R2016b and Octave 7 or newer.
  if nargin < 3
    choroid_factor = 1;
  end
  if ~(isnumeric(absorption_factor) && isscalar(absorption_factor) && isfinite(absorption_factor) && absorption_factor > 0)
    error('photocoag:absorption_factor', 'absorption_factor: a finite number above 0 is accepted');
  end
  content = jsondecode(fileread(file));
  if ~isfield(content, 'format') || ~strcmp(content.format, 'photocoag reduced model') || ~any(content.version == [1 2])
    error('photocoag:file', '%s: not a reduced model file of version 1 or 2', file);
  end
  theta = coefficients(content.theta, absorption_factor, choroid_factor);
  C_volume = theta.' * terms(content.continuous.C_volume, numel(theta));
  if content.volume_normalized
    C_volume = C_volume / absorbed(content.absorbed_fraction, absorption_factor, choroid_factor);
  end
  model.A = content.continuous.A;
  model.B = columns(content.continuous.B, numel(theta)) * theta;
  model.C = [C_volume; reshape(content.continuous.C_peak, 1, [])];
  model.D = zeros(2, 1);
  model.A_d = content.discrete.A;
  model.B_d = columns(content.discrete.B, numel(theta)) * theta;
  model.period = content.discrete.period_s;
  model.ss = [];
  if exist('ss', 'file') || exist('ss', 'class')
    model.ss = ss(model.A, model.B, model.C, model.D);
    model.ss.InputName = {'power_W'};
    model.ss.OutputName = {'volume_K', 'peak_K'};
  end
end

function theta = coefficients(law, alpha, beta)
  switch law.kind
    case 'deim'
      theta = zeros(numel(law.points), 1);
      for j = 1:numel(law.points)
        theta(j) = absorbed(law.points(j), alpha, beta);
      end
    case 'taylor'
      theta = (alpha - law.center) .^ (0:law.terms - 1).';
    case 'chebyshev'
      second = 1;
      if isfield(law, 'choroid_terms')
        second = law.choroid_terms;
      end
      first = law.terms / second;
      theta = chebyshev((alpha - law.center) / law.half_width, first);
      if second > 1
        theta = kron(chebyshev((beta - law.choroid_center) / law.choroid_half_width, second), theta);
      end
    otherwise
      error('photocoag:file', 'theta.kind: deim, chebyshev and taylor are accepted');
  end
end

function values = chebyshev(x, count)
  values = ones(count, 1);
  if count > 1
    values(2) = x;
  end
  for j = 3:count
    values(j) = 2 * x * values(j - 1) - values(j - 2);
  end
end

function s = absorbed(point, alpha, beta)
  front = point.fixed_front + alpha * point.scaled_front;
  back = point.fixed_back + alpha * point.scaled_back;
  if isfield(point, 'choroid_front')
    front = front + beta * point.choroid_front;
    back = back + beta * point.choroid_back;
  end
  s = -exp(-front) * expm1(front - back);
end

% jsondecode makes a column of a matrix with one row or one column.
function matrix = columns(values, count)
  matrix = reshape(values, [], count);
end

function matrix = terms(values, count)
  matrix = reshape(values, count, []);
end
