//! Where slices are: straight, tilted, uneven, and what the caller puts in place of it.

use atomesh_io::image::{
    AnyImage, GivenFrame, Meaning, ReadNote, ReadOptions, ReadReason, ScanNote, SeriesError,
};

use super::{File, folder, list, load, load_with, near, numbers, three, whole};

/// Slices of 4 × 40 samples of a value that grows along z and y alone, from a function of the place.
fn scan(
    axes: [f64; 6],
    positions: &[[f64; 3]],
    value: impl Fn([f64; 3]) -> f64,
) -> tempfile::TempDir {
    let place = |position: &[f64; 3], x: f64, y: f64| -> [f64; 3] {
        std::array::from_fn(|r| position[r] + 1.2 * x * axes[r] + 0.8 * y * axes[3 + r])
    };
    let file = |(k, position): (usize, &[f64; 3])| {
        let of = |i: usize| value(place(position, (i % 4) as f64, (i / 4) as f64)).round() as u16;
        let samples: Vec<u16> = (0..160).map(of).collect();
        let mut file = File::of([4, 40], &samples, 0.0);
        file.text(0x0020_0032, "DS", &list(position));
        file.text(0x0020_0037, "DS", &list(&axes));
        (["a", "b", "c", "d", "e", "f"][k], file.bytes())
    };
    folder(positions.iter().enumerate().map(file))
}

/// A function of the place that is linear, so that what is resampled linearly is exact.
fn linear([x, y, z]: [f64; 3]) -> f64 {
    20_000.0 + 100.0 * x + 200.0 * y + 300.0 * z
}

/// Checks that all samples that have data have the values of the function; LPS is RAS turned.
fn is_linear(image: &AnyImage, tolerance: f64) -> usize {
    let AnyImage::Volume(volume) = image else { panic!("flat") };
    let [nx, ny, nz] = volume.frame().shape();
    let mut absent = 0;
    for (index, value) in numbers(image).into_iter().enumerate() {
        let at = [index % nx, index / nx % ny, index / nx / ny].map(|i| i as f64);
        assert!(at[2] < nz as f64);
        let [x, y, z] = volume.frame().lattice_to_world(atomesh::image::Units::Samples, &at);
        if image.absent().is_some_and(|absent| absent[index]) {
            absent += 1;
            continue;
        }
        let expected = linear([-x, -y, z]);
        assert!((value - expected).abs() < tolerance, "{at:?}: {value}, not {expected}");
    }
    absent
}

#[test]
fn slices_of_a_tilted_gantry_are_resampled_onto_a_right_grid() {
    for degrees in [15.0_f64, -22.0, 0.2] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let axes = [1.0, 0.0, 0.0, 0.0, cos, -sin];
        let positions: Vec<_> = (0..6).map(|k| [10.0, -20.0, 30.0 + 4.0 * f64::from(k)]).collect();
        let folder = scan(axes, &positions, linear);
        let loaded = load(folder.path()).unwrap();
        let tilt = loaded.notes.iter().find_map(|note| match note {
            ReadNote::Scan(ScanNote::GantryTilt { degrees, before, after }) => {
                Some((*degrees, *before, *after))
            }
            _ => None,
        });
        let (found, before, after) = tilt.unwrap();
        assert!((found - degrees.abs()).abs() < 1e-6, "{found}");
        // the last slice stands 20 sin(degrees) / 0.8 samples beside the first
        let more = (20.0 * sin.abs() / 0.8).ceil() as usize;
        assert_eq!((before, after), ([4, 40], [4, 40 + more]));
        assert!((loaded.image.spacing()[2] - 4.0 * cos).abs() < 1e-9);
        // half a unit for rounding to integers
        assert!(is_linear(&loaded.image, 1.0) > 0);
        assert!(ReadNote::Scan(ScanNote::Uneven { most: 0.0 }).is_warning());

        // the caller's axes go before
        let given = GivenFrame { direction: true, ..GivenFrame::default() };
        let options = ReadOptions { given, ..ReadOptions::default() };
        let kept = load_with(folder.path(), &options).unwrap();
        assert_eq!(kept.image.shape(), [4, 40, 6]);
        assert!(kept.notes.iter().all(|note| !matches!(note, ReadNote::Scan(_))));
    }
}

#[test]
fn a_tilt_of_rounding_gives_way_to_the_nearest_frame() {
    let (sin, cos) = 0.05_f64.to_radians().sin_cos();
    let positions: Vec<_> = (0..6).map(|k| [0.0, 0.0, 2.5 * f64::from(k)]).collect();
    let loaded = load(scan([1.0, 0.0, 0.0, 0.0, cos, -sin], &positions, linear).path()).unwrap();
    let is_noted = loaded.notes.iter().any(|note| {
        matches!(note, ReadNote::Sheared { first: 1, second: 2, degrees, .. } if (degrees - 89.95).abs() < 1e-6
            || (degrees - 90.05).abs() < 1e-6)
    });
    assert!(is_noted, "{:?}", loaded.notes);
    assert_eq!(loaded.image.shape(), [4, 40, 6]);
    // cosines of three digits
    let rounded = [0.866, 0.5, 0.0, -0.5, 0.866, 0.0];
    let loaded = load(scan(rounded, &positions, linear).path()).unwrap();
    assert_eq!(loaded.image.shape(), [4, 40, 6]);
    let third = [0.577, 0.577, 0.577, -0.408, 0.816, -0.408];
    let positions: Vec<_> =
        (0..6).map(|k| [-0.707, 0.0, 0.707].map(|n| n * f64::from(k))).collect();
    let loaded = load(scan(third, &positions, linear).path()).unwrap();
    assert!((loaded.image.spacing()[0] - 1.2).abs() < 1e-9);
}

#[test]
fn slices_that_are_nearly_even_are_resampled_to_even_places() {
    let heights = [0.0, 2.08, 4.0, 5.95, 8.0];
    let positions = heights.map(|z| [0.0, 0.0, z]);
    let folder = scan([1.0, 0.0, 0.0, 0.0, 1.0, 0.0], &positions, linear);
    let loaded = load(folder.path()).unwrap();
    assert_eq!(loaded.image.spacing()[2], 2.0);
    assert_eq!(is_linear(&loaded.image, 1.0), 0);
    let note = ReadNote::Scan(ScanNote::Uneven { most: 0.05 });
    let is_noted = loaded.notes.iter().any(|note| {
        matches!(note, ReadNote::Scan(ScanNote::Uneven { most }) if (most - 0.04).abs() < 1e-9)
    });
    assert!(is_noted && note.is_warning(), "{:?}", loaded.notes);
    assert!(note.to_string().contains("5.0 % of a gap"), "{note}");
    // of labels there is nothing in between
    let options = ReadOptions { meaning: Meaning::Labels, ..ReadOptions::default() };
    let labels = load_with(folder.path(), &options).unwrap();
    let first: Vec<f64> = numbers(&labels.image).iter().step_by(160).copied().collect();
    assert_eq!(first, heights.map(|z| linear([0.0, 0.0, z])));
    // far from even is refused, unless the caller says how far slices are apart
    let positions = [0.0, 2.0, 4.0, 9.0].map(|z| [0.0, 0.0, z]);
    let folder = scan([1.0, 0.0, 0.0, 0.0, 1.0, 0.0], &positions, linear);
    let error = load(folder.path()).unwrap_err();
    assert!(error.to_string().contains("5 apart"), "{error}");
    let given = GivenFrame { spacing: true, ..GivenFrame::default() };
    let loaded =
        load_with(folder.path(), &ReadOptions { given, ..ReadOptions::default() }).unwrap();
    let note = ReadNote::Scan(ScanNote::GivenGaps { least: 2.0, greatest: 5.0 });
    assert!(loaded.notes.contains(&note) && note.is_warning());
}

#[test]
fn slices_beside_each_other_are_put_onto_one_grid() {
    let positions = [[0.0, 0.0, 0.0], [1.2, 0.0, 2.0], [0.0, -1.6, 4.0], [0.0, 0.0, 6.0]];
    let loaded = load(scan([1.0, 0.0, 0.0, 0.0, 1.0, 0.0], &positions, linear).path()).unwrap();
    assert_eq!(loaded.image.shape(), [5, 42, 4]);
    assert_eq!(is_linear(&loaded.image, 1.0), 4 * (5 * 42 - 4 * 40));
    near(&loaded.image.origin(), &[0.0, 1.6, 0.0]);
    let note = ReadNote::Scan(ScanNote::Shifted { most: 2.0 });
    let found = loaded.notes.iter().any(|note| {
        matches!(note, ReadNote::Scan(ScanNote::Shifted { most }) if (most - 2.0).abs() < 1e-9)
    });
    assert!(found && note.is_warning(), "{:?}", loaded.notes);
    // what is steeper than any gantry is no scan
    let steep = [[0.0, 0.0, 0.0], [0.0, 5.0, 2.0], [0.0, 10.0, 4.0]];
    let error = load(scan([1.0, 0.0, 0.0, 0.0, 1.0, 0.0], &steep, linear).path()).unwrap_err();
    assert!(matches!(error.reason, ReadReason::Sheared { first: 1, second: 2, .. }), "{error}");
}

#[test]
fn what_the_caller_gives_is_not_looked_at_in_the_files() {
    let nothing = GivenFrame::default();
    let (spacing, direction) =
        (GivenFrame { spacing: true, ..nothing }, GivenFrame { direction: true, ..nothing });
    for (tag, bad, given, part) in [
        (0x0028_0030, "0\\1", spacing, "pixel spacing"),
        (0x0028_0030, "wide", spacing, "pixel spacing"),
        (0x0020_0032, "here", spacing, "image position"),
        (0x0020_0037, "1\\0\\0\\1\\0\\0", direction, "axes"),
        (0x0020_0037, "up", direction, "image orientation"),
    ] {
        let files = three().map(|(name, mut file)| {
            file.text(tag, "DS", bad);
            (name, file)
        });
        let folder = folder(whole(&files));
        let text = load(folder.path()).unwrap_err().to_string();
        assert!(text.contains(part), "{text}");
        let loaded = load_with(folder.path(), &ReadOptions { given, ..ReadOptions::default() });
        assert_eq!(loaded.unwrap().image.shape(), [3, 2, 3], "{bad}");
    }
    // without any numbers, by the names of files
    let files = three().map(|(name, mut file)| {
        file.without(&[0x0020_0032]);
        (name, file)
    });
    let folder = folder(whole(&files));
    let error = load(folder.path()).unwrap_err();
    assert!(
        matches!(&error.reason, ReadReason::Series(e) if matches!(**e, SeriesError::Missing { .. }))
    );
    let options = ReadOptions { given: spacing, ..ReadOptions::default() };
    let loaded = load_with(folder.path(), &options).unwrap();
    assert_eq!(numbers(&loaded.image)[0], 20.0);
    assert!(loaded.notes.contains(&ReadNote::ByNumber { numbers: "files' names" }));
}

#[test]
fn a_single_slice_says_where_it_is() {
    let read = |axes: &str, height: f64| {
        let mut file = File::of([3, 2], &[1, 2, 3, 4, 5, 6], height);
        file.text(0x0020_0037, "DS", axes);
        let folder = folder([("a.dcm", file.bytes())]);
        load(&folder.path().join("a.dcm")).unwrap()
    };
    let level = read("1\\0\\0\\0\\1\\0", 7.0);
    near(&level.image.origin(), &[-10.0, 20.0]);
    assert!(level.notes.contains(&ReadNote::LevelSlice { z: 7.0 }), "{:?}", level.notes);
    let upright = read("1\\0\\0\\0\\0\\-1", 7.0);
    near(&upright.image.origin(), &[0.0, 0.0]);
    let axes = [[-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]];
    let note = ReadNote::ObliqueSlice { origin: [-10.0, 20.0, 7.0], axes };
    assert!(upright.notes.contains(&note), "{:?}", upright.notes);
    let odd = read("0\\0\\0\\0\\0\\0", 7.0);
    near(&odd.image.origin(), &[-10.0, 20.0]);
    let note = ScanNote::OddAxes { axes: [[0.0; 3]; 2] };
    assert!(odd.notes.contains(&note.into()), "{:?}", odd.notes);
}
