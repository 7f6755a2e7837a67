// Times CGAL's Delaunay triangulation of given points: 2-D, 3-D, and 3-D on several threads by TBB.
//
// usage: cgal_delaunay POINTS 2|3 THREADS MESH|-
//
// POINTS: raw f64, x fastest. Prints one line of JSON: seconds from points in memory to the triangulation,
// the sort along a curve included. CGAL is under the GPL: a peer to measure against, never linked with
// atomesh. Compile: g++ -O3 -DNDEBUG -std=c++17 cgal_delaunay.cpp -lgmp -lmpfr; where TBB is installed,
// add -DCGAL_LINKED_WITH_TBB -ltbb -ltbbmalloc.

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#ifdef CGAL_LINKED_WITH_TBB
#include <tbb/global_control.h>
#endif

#include <algorithm>
#include <unordered_map>

#include "stopwatch.hpp"

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Flat = CGAL::Delaunay_triangulation_2<Kernel>;
using Solid = CGAL::Delaunay_triangulation_3<Kernel>;

static void points_of(const std::vector<double>& x, std::vector<Flat::Point>& points) {
    for (std::size_t i = 0; i + 1 < x.size(); i += 2) points.emplace_back(x[i], x[i + 1]);
}

static void points_of(const std::vector<double>& x, std::vector<Solid::Point>& points) {
    for (std::size_t i = 0; i + 2 < x.size(); i += 3) points.emplace_back(x[i], x[i + 1], x[i + 2]);
}

// Prints the answer, and writes the mesh where it is wanted.
template <int D, class Triangulation>
void finish(const std::string& seconds, const Triangulation& triangulation, const std::string& path) {
    std::unordered_map<const void*, std::uint32_t> index;
    std::vector<double> points;
    std::vector<std::uint32_t> cells;
    std::size_t count = 0;
    auto add = [&](auto cell) {
        ++count;
        if (path == "-") return;
        for (int k = 0; k <= D; ++k) cells.push_back(index.at(&*cell->vertex(k)));
    };
    if (path != "-")
        for (auto vertex : triangulation.finite_vertex_handles()) {
            index.emplace(&*vertex, static_cast<std::uint32_t>(index.size()));
            for (int k = 0; k < D; ++k) points.push_back(vertex->point()[k]);
        }
    if constexpr (D == 2)
        for (auto cell : triangulation.finite_face_handles()) add(cell);
    else
        for (auto cell : triangulation.finite_cell_handles()) add(cell);
    write_mesh(path, points, cells);
    std::printf("{%s, \"points\": %zu, \"cells\": %zu}\n", seconds.c_str(),
                static_cast<std::size_t>(triangulation.number_of_vertices()), count);
}

template <int D, class Triangulation>
void connect(const std::vector<double>& coordinates, const std::string& path) {
    std::vector<typename Triangulation::Point> points;
    points_of(coordinates, points);
    const Stopwatch clock;
    const Triangulation triangulation(points.begin(), points.end());
    finish<D>(clock.json(), triangulation, path);
}

#ifdef CGAL_LINKED_WITH_TBB
// Locks are over a grid of 50 cells a side, as CGAL's manual has it.
static void connect_in_parallel(const std::vector<double>& coordinates, int threads, const std::string& path) {
    using Structure = CGAL::Triangulation_data_structure_3<CGAL::Triangulation_vertex_base_3<Kernel>,
                                                           CGAL::Delaunay_triangulation_cell_base_3<Kernel>,
                                                           CGAL::Parallel_tag>;
    using Triangulation = CGAL::Delaunay_triangulation_3<Kernel, Structure>;
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
    std::vector<Triangulation::Point> points;
    points_of(coordinates, points);
    const auto [low, high] = std::minmax_element(coordinates.begin(), coordinates.end());
    const Stopwatch clock;
    Triangulation::Lock_data_structure locks(CGAL::Bbox_3(*low, *low, *low, *high, *high, *high), 50);
    const Triangulation triangulation(points.begin(), points.end(), &locks);
    finish<3>(clock.json(), triangulation, path);
}
#endif

int main(int argc, char** argv) try {
    if (argc != 5) {
        std::fprintf(stderr, "usage: %s POINTS 2|3 THREADS MESH|-\n", argv[0]);
        return 2;
    }
    const std::vector<double> coordinates = read_raw<double>(argv[1]);
    const int dimension = std::stoi(argv[2]), threads = std::stoi(argv[3]);
    if (dimension == 2 && threads == 1) {
        connect<2, Flat>(coordinates, argv[4]);
    } else if (dimension == 3 && threads == 1) {
        connect<3, Solid>(coordinates, argv[4]);
    } else if (dimension == 3) {
#ifdef CGAL_LINKED_WITH_TBB
        connect_in_parallel(coordinates, threads, argv[4]);
#else
        throw std::runtime_error("compiled without TBB");
#endif
    } else {
        throw std::runtime_error("CGAL connects the plane on one thread only");
    }
} catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
