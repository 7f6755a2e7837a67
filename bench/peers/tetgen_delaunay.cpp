// Times TetGen's Delaunay tetrahedralization of given points.
//
// usage: tetgen_delaunay POINTS MESH|-
//
// POINTS: raw f64, x fastest. TetGen is under the AGPL: a peer to measure against, never linked with
// atomesh. Compile: g++ -O3 -std=c++17 -DTETLIBRARY tetgen_delaunay.cpp -ltet, with Debian's libtet1.5-dev.

#include <tetgen.h>

#include "stopwatch.hpp"

int main(int argc, char** argv) try {
    if (argc != 3) {
        std::fprintf(stderr, "usage: %s POINTS MESH|-\n", argv[0]);
        return 2;
    }
    std::vector<double> points = read_raw<double>(argv[1]);
    tetgenio in, out;
    in.numberofpoints = static_cast<int>(points.size() / 3);
    in.pointlist = points.data();
    char quiet[] = "Q";
    const Stopwatch clock;
    tetrahedralize(quiet, &in, &out);
    const std::string seconds = clock.json();
    in.pointlist = nullptr; // ours, not to be freed
    write_mesh(argv[2], std::vector<double>(out.pointlist, out.pointlist + 3 * out.numberofpoints),
               std::vector<std::uint32_t>(out.tetrahedronlist, out.tetrahedronlist + 4 * out.numberoftetrahedra));
    std::printf("{%s, \"points\": %d, \"cells\": %d}\n", seconds.c_str(), out.numberofpoints,
                out.numberoftetrahedra);
} catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
