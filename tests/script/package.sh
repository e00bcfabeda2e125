#!/usr/bin/env bash
# The Debian packages on a bare Debian: the program installs with what it depends on and nothing else, treats an eye
# within the time allowed, and removes itself. 77: no root, no debootstrap, no dpkg-shlibdeps or no archive to be reached.
# Arguments: build tree; seconds of processor time that the first treatment may take (without: any).
set -euo pipefail
skip() { echo "skipped: $*"; exit 77; }
build="$1"
allowed="${2:-}"
[ "$(id -u)" -eq 0 ] || skip "debootstrap needs root"
command -v debootstrap >/dev/null || skip "no debootstrap"
command -v dpkg-shlibdeps >/dev/null || skip "no dpkg-shlibdeps (dpkg-dev)"
. /etc/os-release
archive=$(apt-get indextargets --format '$(SITE)' 'Created-By: Packages' "Suite: $VERSION_CODENAME" 2>/dev/null | head -n 1)
[ -n "$archive" ] || archive=$(apt-get indextargets --format '$(SITE) $(CODENAME)' 'Created-By: Packages' |
  awk -v name="$VERSION_CODENAME" '$2 == name { print $1; exit }')
[ -n "$archive" ] || skip "no archive of $VERSION_CODENAME among apt's sources"

work=$(mktemp -d)
root="$work/root"
trap 'umount -q "$root/proc" 2>/dev/null || true; rm -rf "$work"' EXIT
python3 "$(dirname "$0")/../../tools/bill_of_materials" "$build" "$build"/apps/photocoag{,-full}
(cd "$build" && cpack -G DEB -B "$work/packages" >"$work/log" 2>&1) || { tail "$work/log"; exit 1; }
for package in photocoag libphotocoag libphotocoag-dev; do
  ls "$work/packages/${package}"_*.deb >/dev/null
done

timeout 900 debootstrap --variant=minbase "$VERSION_CODENAME" "$root" "$archive" >"$work/log" 2>&1 ||
  { tail -n 3 "$work/log"; skip "no bare system from $archive"; }
cp "$work/packages"/*.deb "$root/"
cp /etc/resolv.conf "$root/etc/" || true
find /etc/apt/apt.conf.d -name '*proxy*' -exec cp {} "$root/etc/apt/apt.conf.d/" \;
mount -t proc proc "$root/proc" || skip "/proc cannot be mounted"
export DEBIAN_FRONTEND=noninteractive LC_ALL=C HOME=/root
chroot "$root" sh -c 'apt-get update -qq && apt-get install -y -qq --no-install-recommends /photocoag_*.deb' \
  >"$work/log" 2>&1 || { tail "$work/log"; exit 1; }
TIMEFORMAT='%R s, %U s of processor time in the program, %S s in the system'
{ time chroot "$root" sh -c 'cd /root && photocoag treat --out run' >"$work/treat" 2>&1; } 2>"$work/took" ||
  { cat "$work/treat"; exit 1; }
echo "first treat: $(cat "$work/took")"
# Processor time, so that what else the machine does plays no part. With the machine for itself it takes less than that.
[ -z "$allowed" ] || awk -v most="$allowed" '{ exit !($3 + 0 + $11 < most) }' "$work/took" ||
  { echo "more than $allowed s"; exit 1; }
[ -s "$root/root/run/report.html" ]
[ -s "$root/usr/lib/photocoag/libphotocoag_nidaqmx.so" ]
chroot "$root" photocoag --version --json | grep -q '"source_hash"'
# What needs more libraries is in a program of its own.
chroot "$root" sh -c 'cd /root && photocoag convert run --hdf5 run.h5 --mat run.mat && [ -s run.h5 ] && [ -s run.mat ]' >"$work/log" 2>&1 ||
  { tail "$work/log"; exit 1; }
grep -q CycloneDX "$root/usr/share/doc/photocoag/photocoag.cdx.json"
grep -q '^OSQP\|^osqp' "$root/usr/share/doc/photocoag/THIRD-PARTY.txt" || grep -q '"osqp": ".*NOTFOUND' "$build/parts.json"
chroot "$root" apt-get purge -y -qq photocoag >"$work/log" 2>&1 || { tail "$work/log"; exit 1; }
[ ! -e "$root/usr/bin/photocoag" ] && [ ! -e "$root/usr/share/photocoag" ]
