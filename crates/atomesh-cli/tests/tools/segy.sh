# segy RAW NX NY NZ: unsigned bytes, x fastest, as SEG-Y revision 1 with samples of 16 bits. Inlines lie along x; traces and
# samples are 4 apart.
segy() {
  od -An -v -tu1 -w1 "$1" | awk -v nx="$2" -v ny="$3" -v nz="$4" '
    function two(v) { printf "%c%c", int(v / 256) % 256, v % 256 }
    function four(v) { two(int(v / 65536)); two(v % 65536) }
    function none(n) { while (n-- > 0) printf "%c", 0 }
    { sample[NR - 1] = $1 }
    END {
      for (i = 1; i <= 40; i++) printf "C%2d%77s", i, ""
      none(16); two(4000); two(0); two(nz); two(0); two(3); none(274); two(256); two(1); none(96)
      for (y = 0; y < ny; y++) for (x = 0; x < nx; x++) {
        none(28); two(1); none(84); two(nz); two(4000); none(62); four(4 * x); four(4 * y); four(100 + y); four(300 + x); none(44)
        for (z = 0; z < nz; z++) two(sample[x + nx * (y + ny * z)])
      }
    }'
}
