// Times CGAL's Mesh_3 on a labelled image: tetrahedra whose faces follow the labels.
//
// usage: cgal_image LABELS NX NY NZ SPACING SIZE slivers|no-slivers THREADS MESH|-
//
// LABELS: raw bytes, x fastest; 0 and 1 are both meshed, as parts 1 and 2, so that the box is filled. SIZE
// bounds the circumradius of cells and of surface facets. "no-slivers" runs CGAL's perturbation and exudation,
// its defaults; "slivers" leaves them out. CGAL is under the GPL: a peer to measure against, never linked
// with atomesh. Compile: g++ -O3 -DNDEBUG -std=c++17 cgal_image.cpp -lgmp -lmpfr -lz; where TBB is installed,
// add -DCGAL_LINKED_WITH_TBB -ltbb -ltbbmalloc.

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/ImageIO.h>
#include <CGAL/Image_3.h>
#include <CGAL/Labeled_mesh_domain_3.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/make_mesh_3.h>
#ifdef CGAL_LINKED_WITH_TBB
#include <tbb/global_control.h>
#endif

#include <cstring>
#include <unordered_map>

#include "stopwatch.hpp"

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Domain = CGAL::Labeled_mesh_domain_3<Kernel>;

struct Task {
    CGAL::Image_3 image;
    double size;
    bool improve;
    std::string path;
};

template <class Complex> void finish(const std::string& seconds, const Complex& complex, const std::string& path) {
    std::unordered_map<const void*, std::uint32_t> index;
    std::vector<double> points;
    std::vector<std::uint32_t> cells;
    for (auto cell = complex.cells_in_complex_begin(); cell != complex.cells_in_complex_end(); ++cell)
        for (int k = 0; k < 4; ++k) {
            const auto vertex = cell->vertex(k);
            const auto [entry, fresh] = index.emplace(&*vertex, static_cast<std::uint32_t>(index.size()));
            if (fresh)
                for (int axis = 0; axis < 3; ++axis) points.push_back(vertex->point()[axis]);
            cells.push_back(entry->second);
        }
    write_mesh(path, points, cells);
    std::printf("{%s, \"points\": %zu, \"cells\": %zu}\n", seconds.c_str(), index.size(), cells.size() / 4);
}

template <class Concurrency> void run(const Task& task) {
    using Triangulation = typename CGAL::Mesh_triangulation_3<Domain, CGAL::Default, Concurrency>::type;
    using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation>;
    using Criteria = CGAL::Mesh_criteria_3<Triangulation>;
    namespace P = CGAL::parameters;
    const Stopwatch clock;
    const Domain domain = Domain::create_labeled_image_mesh_domain(task.image);
    const Criteria criteria(P::facet_angle = 30, P::facet_size = task.size, P::facet_distance = 0.25 * task.size,
                            P::cell_radius_edge_ratio = 3, P::cell_size = task.size);
    const Complex complex =
        task.improve ? CGAL::make_mesh_3<Complex>(domain, criteria)
                     : CGAL::make_mesh_3<Complex>(domain, criteria, P::no_perturb(), P::no_exude());
    finish(clock.json(), complex, task.path);
}

int main(int argc, char** argv) try {
    if (argc != 10) {
        std::fprintf(stderr, "usage: %s LABELS NX NY NZ SPACING SIZE slivers|no-slivers THREADS MESH|-\n", argv[0]);
        return 2;
    }
    const std::vector<unsigned char> labels = read_raw<unsigned char>(argv[1]);
    const unsigned nx = std::stoul(argv[2]), ny = std::stoul(argv[3]), nz = std::stoul(argv[4]);
    const double spacing = std::stod(argv[5]);
    _image* raw = _createImage(nx, ny, nz, 1, spacing, spacing, spacing, 1, WK_FIXED, SGN_UNSIGNED);
    if (labels.size() != std::size_t(nx) * ny * nz) throw std::runtime_error("labels do not fill the shape");
    for (std::size_t i = 0; i < labels.size(); ++i) static_cast<unsigned char*>(raw->data)[i] = labels[i] + 1;
    const Task task{CGAL::Image_3(raw), std::stod(argv[6]), std::strcmp(argv[7], "no-slivers") == 0, argv[9]};
    const int threads = std::stoi(argv[8]);
    if (threads == 1) {
        run<CGAL::Sequential_tag>(task);
        return 0;
    }
#ifdef CGAL_LINKED_WITH_TBB
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    run<CGAL::Parallel_tag>(task);
#else
    throw std::runtime_error("compiled without TBB");
#endif
} catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
