#!/usr/bin/env bash
# console_bundle.sh SOURCES: console/dist is what a fresh build of console/src gives, and small.
# Needs npm, and a network or what `./photocoag test` has put into console/node_modules.
set -euo pipefail
sources="$1/console"
bytes=$(cat "$sources"/dist/* | wc -c)
[ "$bytes" -lt 250000 ] || { echo "the bundle has $bytes bytes, 250,000 are allowed"; exit 1; }
PATH="$PATH:$1/build/python/node/bin"
command -v npm >/dev/null || { echo "skipped: there is no npm"; exit; }
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cp -r "$sources"/{package.json,package-lock.json,tsconfig.json,vite.config.js,index.html,src,public} "$scratch"
cd "$scratch"
if [ -d "$sources/node_modules" ]; then
  ln -s "$sources/node_modules" .
else
  timeout 120 npm ci --silent --no-audit --no-fund >/dev/null 2>&1 || { echo "skipped: npm ci does not work here"; exit; }
fi
npm run --silent build >build.txt 2>&1 || { cat build.txt; exit 1; }
diff -r "$sources/dist" dist >/dev/null ||
  { echo "console/dist is not what console/src gives: cd console && npm ci && npm run build"; exit 1; }
echo "the same, $bytes bytes"
