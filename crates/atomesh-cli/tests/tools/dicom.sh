# series FOLDER UID KIND: 24 slices of 24 x 24 samples of 1 x 1 x 2 mm with a ball inside; KIND is grey or label. Bare DICOM:
# explicit little endian, no more attributes than a reader needs.
series() {
  mkdir -p "$1" && awk -v folder="$1" -v uid="$2" -v n=24 -v value="$3" '
    function two(v) { printf "%c%c", v % 256, int(v / 256) % 256 > file }
    function four(v) { two(v % 65536); two(int(v / 65536)) }
    function text(group, element, type, words) {
      if (length(words) % 2) words = words (type == "UI" ? sprintf("%c", 0) : " ")
      two(group); two(element); printf "%s", type > file; two(length(words)); printf "%s", words > file
    }
    function number(group, element, v) { two(group); two(element); printf "US" > file; two(2); two(v) }
    BEGIN {
      for (z = 0; z < n; z++) {
        file = folder "/" z ".dcm"
        for (i = 0; i < 128; i++) printf "%c", 0 > file
        printf "DICM" > file
        text(2, 16, "UI", "1.2.840.10008.1.2.1")
        text(8, 96, "CS", "MR"); text(32, 14, "UI", "1.2.3." uid); text(32, 19, "IS", z + 1)
        text(32, 50, "DS", "10\\-20\\" 2 * z); text(32, 55, "DS", "1\\0\\0\\0\\1\\0"); text(40, 48, "DS", "1\\1")
        number(40, 2, 1); text(40, 4, "CS", "MONOCHROME2"); number(40, 16, n); number(40, 17, n)
        number(40, 256, 16); number(40, 257, 16); number(40, 258, 15); number(40, 259, 0)
        two(32736); two(16); printf "OW" > file; two(0); four(2 * n * n)
        for (y = 0; y < n; y++) for (x = 0; x < n; x++) {
          inner = (x - 11) ^ 2 + (y - 12) ^ 2 + (2 * (z - 12)) ^ 2 < 64
          two(value == "label" ? 1 + inner : 300 + 400 * inner + (7 * x + 5 * y + 3 * z) % 11)
        }
        close(file)
      }
    }'
}
