function varargout = photocoag_controller(varargin)
% PHOTOCOAG_CONTROLLER  The controller that `photocoag export-c` has written, one period a call.
%
%   [controller, power, decision] = photocoag_controller('new')
%   [power, decision] = photocoag_controller('step', controller, volume_temperature, applied_power)
%   photocoag_controller('free', controller)
%   about = photocoag_controller('about')
%
% new: cold tissue; power, W, is the one of the first period. step: from the volume temperature at the period's end (K, rise
% over the start; [] without a sample) and the power that the laser emitted in it (W), power of the next one. NaN or infinite
% gives 0 W. decision: what the power was decided from; controllers are numbers, 64 at a time.
% It has to be built before: photocoag_build. THE SUPERVISOR IS NOT IN IT. Research software, not a medical device.
  error('photocoag:not_built', 'not built yet: photocoag export-c --out FOLDER, then photocoag_build(''FOLDER'')');
end
