//! Connecting points in 3-D and 2-D; `bench/run.py` gives CGAL the same points in 3-D.

use atomesh::geometry::Point;
use atomesh::mesh::Delaunay;
use atomesh::watch::Silent;
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use rayon::ThreadPoolBuilder;

/// SplitMix64 (Steele, Lea & Flood 2014), uniform in [0, 1): a few lines in any language.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn scattered<const D: usize>(count: usize) -> Vec<Point<D>> {
    let mut random = Random(1);
    (0..count).map(|_| std::array::from_fn(|_| random.next())).collect()
}

/// A face-centred cubic crystal, each atom moved by up to `jitter / 2` along each axis.
fn crystal(count: usize, jitter: f64, scale: f64) -> Vec<Point<3>> {
    let side = (count as f64 / 4.0).cbrt().round() as usize;
    let mut random = Random(1);
    let mut points = Vec::with_capacity(4 * side.pow(3));
    for cell in 0..side.pow(3) {
        let corner = [cell % side, cell / side % side, cell / side / side];
        for site in [[0.0; 3], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]] {
            points.push(std::array::from_fn(|k| {
                scale * (corner[k] as f64 + site[k] + jitter * (random.next() - 0.5))
            }));
        }
    }
    points
}

fn connect<const D: usize>(
    criterion: &mut Criterion,
    name: &str,
    delaunay: Delaunay<D>,
    points: &[Point<D>],
) {
    let mut group = criterion.benchmark_group("connect");
    group.sample_size(10);
    for threads in [1, 2] {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start");
        let id = BenchmarkId::new(format!("{name}, {threads} threads"), points.len());
        group.bench_with_input(id, points, |bencher, points| {
            bencher.iter(|| pool.install(|| delaunay.connect(points, &mut Silent)));
        });
    }
    group.finish();
}

fn benches(criterion: &mut Criterion) {
    for count in [50_000, 1_000_000] {
        connect(criterion, "scattered", Delaunay::<3>::new(), &scattered(count));
        connect(criterion, "jittered", Delaunay::<3>::new(), &crystal(count, 0.1, 1.0));
        connect(criterion, "perfect", Delaunay::<3>::new(), &crystal(count, 0.0, 1.0));
    }
    connect(criterion, "rounded", Delaunay::<3>::new(), &crystal(50_000, 0.0, 0.1));
    connect(criterion, "plane", Delaunay::<2>::new(), &scattered(100_000));
}

criterion_group!(delaunay, benches);
criterion_main!(delaunay);
