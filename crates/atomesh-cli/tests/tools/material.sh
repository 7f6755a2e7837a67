# micrograph: bright grains and dark pores in a grey matrix, with something like noise, as PGM.
micrograph() {
  awk 'BEGIN {
    print "P2", 80, 60, 255
    for (y = 0; y < 60; y++) for (x = 0; x < 80; x++) {
      grain = (x - 22) ^ 2 + (y - 28) ^ 2 < 150 || (x - 60) ^ 2 + (y - 38) ^ 2 < 110
      pore = (x - 52) ^ 2 + (y - 14) ^ 2 < 60
      print 140 + 80 * grain - 80 * pore + (7 * x * x + 5 * x * y + 3 * y) % 13
    }
  }'
}

# stretched INP STRAIN: displacements of all nodes on the sides, as stretched along x.
stretched() {
  awk -v strain="$2" -F ', *' '
    /^\*/ { nodes = /^\*NODE$/; side = /^\*NSET, NSET=[xyz](min|max)$/; next }
    nodes { x[$1] = $2 }
    side { for (i = 1; i <= NF; i++) if ($i != "") on[$i] = 1 }
    END { print "*BOUNDARY"; for (n in on) printf "%d, 1, 1, %.12g\n%d, 2, 2, 0\n", n, strain * x[n], n }
  ' "$1"
}
