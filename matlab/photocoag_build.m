function photocoag_build(folder, out)
% PHOTOCOAG_BUILD  Makes the function photocoag_controller (MEX) of what `photocoag export-c --out FOLDER` has written.
%
%   photocoag_build('FOLDER')         into the present folder
%   photocoag_build('FOLDER', 'OUT')  into the folder OUT
%
% Wants a C compiler: Octave's mkoctfile (Debian: octave-dev), in MATLAB one that `mex -setup C` finds.
% Research software, not a medical device.
  if nargin < 2
    out = pwd;
  end
  if ~exist(fullfile(folder, 'pc_controller.h'), 'file')
    error('photocoag:folder', '%s: not a folder that photocoag export-c has written, with the prefix pc_', folder);
  end
  sources = dir(fullfile(folder, 'pc_*.c'));
  files = cellfun(@(name) fullfile(folder, name), {sources.name}, 'UniformOutput', false);
  files = [{fullfile(fileparts(mfilename('fullpath')), 'photocoag_controller.c')}, files];
  target = fullfile(out, ['photocoag_controller.' mexext]);
  clear photocoag_controller  % one that is loaded cannot be replaced
  if exist('OCTAVE_VERSION', 'builtin')
    before = getenv('CFLAGS');
    setenv('CFLAGS', '-O2 -std=c99 -fPIC -ffp-contract=off -fno-math-errno');
    back = onCleanup(@() setenv('CFLAGS', before));
    status = mkoctfile('--mex', ['-I' folder], '-o', target, files{:});
    if status ~= 0
      error('photocoag:build', 'mkoctfile could not build it; what it says is above');
    end
  elseif ispc
    mex(['-I' folder], '-output', target, files{:});
  else
    mex(['-I' folder], 'CFLAGS=$CFLAGS -std=c99 -ffp-contract=off', '-output', target, files{:});
  end
  rehash;
end
