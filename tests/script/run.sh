#!/usr/bin/env bash
# The script `photocoag` for a user who may read somebody else's tree but not write to it: what is built runs, what is
# not or is older than its sources is named, and a link leads back to the tree. Argument: source tree.
set -euo pipefail
unset CDPATH
work=$(mktemp -d)
trap 'chmod -R u+w "$work"; rm -rf "$work"' EXIT
chmod 755 "$work"
tree="$work/a tree"
mkdir -p "$tree"/{src,apps,cmake,drivers,console/dist,tests} "$tree"/build/release/{apps,tests} "$work/own/bin"
cp "$1/photocoag" "$tree"
touch "$tree"/{CMakeLists.txt,src/code.cpp,tests/code.cpp}
printf 'const Command kCampaign(\n    "campaign", "many spots", run);\n' >"$tree/apps/campaign.cpp"
program="$tree/build/release/apps/photocoag"
printf '#!/bin/sh\necho "ran:$*"\n' >"$program"
chmod 755 "$program"
cp "$program" "$program-full"
cp "$program" "$tree/build/release/tests/test_apps"
printf 'add_test(inner "%s" inner)\n' "$program" >"$tree/build/release/tests/CTestTestfile.cmake"
ln -s "$tree/photocoag" "$work/own/bin/photocoag"

if [ "$(id -u)" -eq 0 ]; then
  chown -R 65534:65534 "$work/own"
  other=(setpriv --reuid=65534 --regid=65534 --clear-groups)
else
  chmod -R a-w "$tree"
  other=()
fi

# expect CODE TEXT COMMAND…: the other user's command ends with CODE and says TEXT.
expect() {
  local code="$1" text="$2" status=0 said
  shift 2
  said=$("${other[@]}" "$@" 2>&1) || status=$?
  if [ "$status" -ne "$code" ] || [[ "$said" != *"$text"* ]]; then
    printf 'exit code %s instead of %s, or no "%s": %s\n%s\n' "$status" "$code" "$text" "$*" "$said" >&2
    exit 1
  fi
}
change() { [ "$(id -u)" -eq 0 ] || chmod -R u+w "$tree"; "$@"; [ "$(id -u)" -eq 0 ] || chmod -R a-w "$tree"; }
minutes_later() { touch -d "$1 minutes" "$2"; }

expect 0 "ran:simulate --out a b" "$tree/photocoag" simulate --out "a b"
expect 0 "100% tests passed" "$tree/photocoag" test -R inner
expect 8 "No tests were found" "$tree/photocoag" test -R no-such-test
cd "$work"
expect 0 "ran:config" env CDPATH="$work:/" own/bin/photocoag config
[ ! -e "$work/own/bin/build" ] || { echo "the link's folder took a build" >&2; exit 1; }
change minutes_later 1 "$tree/src/code.cpp"
expect 2 "is older than $tree/src/code.cpp, and you cannot write" "$tree/photocoag" simulate
expect 2 "its owner calls ./photocoag test there" "$tree/photocoag" test
change minutes_later 2 "$tree/build/release/.built-photocoag" # a source that the program is not made of
expect 0 "ran:simulate" "$tree/photocoag" simulate
change minutes_later 3 "$tree/build/release/.built-all"
change minutes_later 4 "$tree/tests/code.cpp"
expect 2 "tests/code.cpp" "$tree/photocoag" test
expect 0 "ran:simulate" "$tree/photocoag" simulate
change rm "$tree/build/release/tests/test_apps"
change minutes_later -1 "$tree/tests/code.cpp"
expect 2 "the tests are not built" "$tree/photocoag" test
expect 0 "ran:campaign x" "$tree/photocoag" campaign x
change rm "$program-full"
expect 2 "photocoag-full is not built, and you cannot write to $tree: its owner calls ./photocoag build there" \
  "$tree/photocoag" campaign x
expect 0 "ran:treat" "$tree/photocoag" treat
expect 2 "there is no command capaign; ./photocoag --help lists all" "$tree/photocoag" capaign x
change rm "$program"
expect 2 "photocoag is not built, and you cannot write to $tree: its owner calls ./photocoag there" "$tree/photocoag" config
change rm -r "$tree/build"
change chmod a-w "$tree"
expect 2 "photocoag is not built" "$tree/photocoag" config

# The owner's tree: what a first treatment needs is configured alone, the whole when a command first asks for it, and
# then stays. Stand-ins for what installs, configures and builds.
own="$work/the owner's"
mkdir -p "$own"/{src,apps,cmake,drivers,console/dist,build/deps/osqp} "$work/fakes"
cp "$1/photocoag" "$own"
cp "$tree/apps/campaign.cpp" "$own/apps"
cat >"$work/fakes/cmake" <<'END'
#!/usr/bin/env bash
echo "cmake $*" >>"$LOG"
[ "$1" != --find-package ] || exit 0
if [ "$1" = --build ]; then
  grep -q "FULL:BOOL=ON" "$2/CMakeCache.txt" || [ "$4" = photocoag ] || { echo "unknown target $4"; exit 1; }
  mkdir -p "$2/apps"
  printf '#!/bin/sh\necho "ran:$*"\n' >"$2/apps/photocoag"
  chmod 755 "$2/apps/photocoag"
  exit
fi
mkdir -p build/release
for option in "$@"; do
  case "$option" in -DPHOTOCOAG_FULL=*) echo "PHOTOCOAG_FULL:BOOL=${option#*=}" >"$2/build/release/CMakeCache.txt" ;; esac
done
touch "$2/build/release/build.ninja"
END
printf '#!/bin/sh\necho "$@" >>"$LOG"\necho installed\n' >"$work/fakes/dpkg-query"
chmod 755 "$work/fakes"/*
owner() {
  : >"$work/log"
  LOG="$work/log" PATH="$work/fakes:$PATH" "$own/photocoag" "$@"
}
says() { grep -q -e "$1" "$work/log" || { echo "no \"$1\":" >&2; cat "$work/log" >&2; exit 1; }; }
silent() { ! grep -q -e "$1" "$work/log" || { echo "\"$1\":" >&2; cat "$work/log" >&2; exit 1; }; }
[ "$(owner treat)" = ran:treat ]
says "-DPHOTOCOAG_FULL=OFF" && says "--target photocoag$" && silent libhdf5-dev
[ "$(owner campaign x)" = "ran:campaign x" ]
says "-DPHOTOCOAG_FULL=ON" && says "--target photocoag_full$" && says libhdf5-dev
[ "$(owner treat)" = ran:treat ]
says "--target photocoag$" && silent "FULL"
# OSQP is looked for, and else built, when the whole is or when the solver is named: not by a comment.
printf '[control]\nsolver = "dense" # or "osqp"\n' >"$work/dense.toml"
printf '[control]\nsolver = "osqp"\n' >"$work/paper.toml"
looks_for_osqp() {
  rm -rf "$own/build/deps/osqp"
  owner "$@" >/dev/null
  says "--find-package -DNAME=osqp"
}
rm -r "$own/build/deps/osqp"
for quiet in treat "simulate --config $work/dense.toml"; do
  owner $quiet >/dev/null
  silent --find-package
done
looks_for_osqp simulate --set control.solver=osqp
looks_for_osqp simulate --config "$work/paper.toml"
looks_for_osqp simulate "--config=$work/paper.toml"
looks_for_osqp campaign x
owner campaign x >/dev/null
silent --find-package
