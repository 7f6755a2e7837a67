// What every C++ peer needs: raw files, a stopwatch, one line of JSON.

#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

// Wall and CPU time of all threads since it was made.
struct Stopwatch {
    std::chrono::steady_clock::time_point wall = std::chrono::steady_clock::now();
    double cpu = cpu_time();

    static double cpu_time() {
        timespec t{};
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
        return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
    }

    // "wall": …, "cpu": …
    std::string json() const {
        const double used = cpu_time() - cpu;
        const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - wall;
        return "\"wall\": " + std::to_string(passed.count()) + ", \"cpu\": " + std::to_string(used);
    }
};

// All values of a raw little-endian file.
template <class T> std::vector<T> read_raw(const std::string& path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    if (!file) throw std::runtime_error("cannot read " + path);
    std::vector<T> values(static_cast<std::size_t>(file.tellg()) / sizeof(T));
    file.seekg(0);
    file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(T)));
    return values;
}

template <class T> void write_raw(const std::string& path, const std::vector<T>& values) {
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(values.data()),
               static_cast<std::streamsize>(values.size() * sizeof(T)));
}

// Writes PATH.points (f64) and PATH.cells (u32), which the harness measures; "-" writes none.
inline void write_mesh(const std::string& path, const std::vector<double>& points,
                       const std::vector<std::uint32_t>& cells) {
    if (path == "-") return;
    write_raw(path + ".points", points);
    write_raw(path + ".cells", cells);
}
