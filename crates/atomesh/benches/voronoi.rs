//! Voronoi cells of sites at random and of a crystal, beside connecting the same sites, their least cost.

use atomesh::geometry::{Bounds, Point};
use atomesh::mesh::Delaunay;
use atomesh::voronoi::voronoi;
use atomesh::watch::Silent;
use criterion::{Criterion, criterion_group, criterion_main};

/// SplitMix64 (Steele, Lea & Flood 2014), uniform in [0, 1).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

const SIDE: f64 = 36.0;

fn benches(criterion: &mut Criterion) {
    let mut random = Random(1);
    let scattered: Vec<Point<3>> =
        (0..100_000).map(|_| std::array::from_fn(|_| SIDE * random.next())).collect();
    let crystal: Vec<Point<3>> = (0..37 * 37 * 37)
        .map(|n| [n % 37, n / 37 % 37, n / 1369].map(f64::from))
        .flat_map(|p| [p, p.map(|x| x + 0.5)])
        .filter(|p| p.iter().all(|x| *x <= SIDE))
        .collect();
    let bounds = Bounds { min: [0.0; 3], max: [SIDE; 3] };
    let delaunay = Delaunay::<3>::new();
    let mut group = criterion.benchmark_group("voronoi");
    group.sample_size(10);
    for (name, sites) in [("scattered", &scattered), ("crystal", &crystal)] {
        group.bench_function(format!("{name}, {} cells", sites.len()), |bencher| {
            bencher.iter(|| voronoi(&delaunay, sites, bounds, &mut Silent));
        });
        group.bench_function(format!("{name}, connected alone"), |bencher| {
            bencher.iter(|| delaunay.connect(sites, &mut Silent));
        });
    }
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
