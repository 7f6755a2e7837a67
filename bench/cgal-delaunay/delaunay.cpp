// Times CGAL's 3-D Delaunay triangulation on the points that crates/atomesh/benches/delaunay.rs makes.
// A peer to measure against: never linked with atomesh.

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Triangulation = CGAL::Delaunay_triangulation_3<Kernel>;
using Point = Kernel::Point_3;

// SplitMix64 (Steele, Lea & Flood 2014), uniform in [0, 1).
struct Random {
    std::uint64_t state = 1;
    double next() {
        std::uint64_t z = state += 0x9E3779B97F4A7C15;
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
        return static_cast<double>((z ^ (z >> 31)) >> 11) / 9007199254740992.0;
    }
};

static std::vector<Point> scattered(std::size_t count) {
    Random random;
    std::vector<Point> points;
    for (std::size_t i = 0; i < count; ++i) {
        double x = random.next(), y = random.next(), z = random.next();
        points.emplace_back(x, y, z);
    }
    return points;
}

// A face-centred cubic crystal of unit cells, each atom moved by up to jitter / 2 along each axis.
static std::vector<Point> crystal(std::size_t count, double jitter) {
    const double sites[4][3] = {{0, 0, 0}, {0.5, 0.5, 0}, {0.5, 0, 0.5}, {0, 0.5, 0.5}};
    const int side = static_cast<int>(std::lround(std::cbrt(count / 4.0)));
    Random random;
    std::vector<Point> points;
    for (int k = 0; k < side; ++k)
        for (int j = 0; j < side; ++j)
            for (int i = 0; i < side; ++i)
                for (const auto& site : sites) {
                    double x = i + site[0] + jitter * (random.next() - 0.5);
                    double y = j + site[1] + jitter * (random.next() - 0.5);
                    double z = k + site[2] + jitter * (random.next() - 0.5);
                    points.emplace_back(x, y, z);
                }
    return points;
}

int main(int argc, char** argv) {
    if (argc != 4) {
        std::fprintf(stderr, "usage: %s scattered|jittered|perfect COUNT REPEATS\n", argv[0]);
        return 2;
    }
    const std::string kind = argv[1];
    const std::size_t count = std::strtoull(argv[2], nullptr, 10);
    const std::vector<Point> points =
        kind == "scattered" ? scattered(count) : crystal(count, kind == "jittered" ? 0.1 : 0.0);
    for (int repeat = std::atoi(argv[3]); repeat > 0; --repeat) {
        const std::clock_t start = std::clock();
        const Triangulation triangulation(points.begin(), points.end());
        const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
        std::printf("%s %zu points %zu cells %.3f CPU seconds\n", kind.c_str(), points.size(),
                    static_cast<std::size_t>(triangulation.number_of_finite_cells()), seconds);
    }
}
