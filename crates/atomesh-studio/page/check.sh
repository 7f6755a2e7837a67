#!/bin/sh
# Checks the types that the page's comments state. Needs npm's registry; the build needs neither it nor this.
set -eu
cd "$(dirname "$0")"
exec npx --yes -p typescript@5 tsc --noEmit --allowJs --checkJs --target es2022 --module es2022 \
  --moduleResolution bundler --lib es2022,dom,dom.iterable ./*.js
