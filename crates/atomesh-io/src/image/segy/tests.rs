//! Small files of our own writing, in every revision and number that is read; odd ones in [`odd`].

use super::super::{ByteOrder, ReadOptions, decode_image, load_bytes};
use super::*;
use atomesh::watch::Silent;
use proptest::prelude::*;

mod odd;

/// A file to write.
#[derive(Clone)]
struct Writer {
    code: i16,
    revision: u8,
    byte_order: ByteOrder,
    samples: usize,
    interval: u16,
    feet: bool,
    /// Textual headers after the first; −1 for one that ends with the words that end them.
    texts: i16,
    scalar: i16,
    /// Places of inline, crossline, X and Y.
    bytes: [usize; 4],
    traces: Vec<Written>,
}

/// A trace to write: numbers, X and Y as stored, the value of its first sample.
#[derive(Clone, Copy)]
struct Written {
    numbers: [i32; 2],
    place: [i32; 2],
    value: f64,
}

impl Default for Writer {
    fn default() -> Self {
        Self {
            code: 5,
            revision: 1,
            byte_order: ByteOrder::Big,
            samples: 5,
            interval: 4000,
            feet: false,
            texts: 0,
            scalar: 1,
            bytes: [189, 193, 181, 185],
            traces: Vec::new(),
        }
    }
}

impl Writer {
    fn put<const N: usize>(&self, bytes: &mut [u8], at: usize, mut number: [u8; N]) {
        if self.byte_order == ByteOrder::Little {
            number.reverse();
        }
        bytes[at..at + N].copy_from_slice(&number);
    }

    fn bytes(&self) -> Vec<u8> {
        let mut file = vec![b' '; 3200];
        let mut binary = [0; 400];
        self.put(&mut binary, 16, self.interval.to_be_bytes());
        self.put(&mut binary, 20, (self.samples as u16).to_be_bytes());
        self.put(&mut binary, 24, self.code.to_be_bytes());
        self.put(&mut binary, 54, (1 + i16::from(self.feet)).to_be_bytes());
        if self.revision >= 2 {
            self.put(&mut binary, 96, 0x0102_0304_i32.to_be_bytes());
            self.put(&mut binary, 312, (self.traces.len() as u64).to_be_bytes());
        }
        binary[300] = self.revision;
        self.put(&mut binary, 304, self.texts.to_be_bytes());
        file.extend(binary);
        match self.texts {
            -1 => {
                let mut text = [b' '; 6400];
                text[3300..3317].copy_from_slice(b"((SEG: EndText)) ");
                file.extend(text);
            }
            count => file.extend(vec![b'C'; 3200 * count as usize]),
        }
        self.traces.iter().for_each(|trace| file.extend(self.trace(trace)));
        file
    }

    fn trace(&self, trace: &Written) -> Vec<u8> {
        let mut bytes = vec![0; 240];
        let numbers = [trace.numbers, trace.place].concat();
        for (at, number) in self.bytes.iter().zip(numbers) {
            self.put(&mut bytes, at - 1, number.to_be_bytes());
        }
        self.put(&mut bytes, 70, self.scalar.to_be_bytes());
        for k in 0..self.samples {
            let value = trace.value + k as f64;
            let mut number = match self.code {
                1 => ibm(value).to_be_bytes().to_vec(),
                2 => (value as i32).to_be_bytes().to_vec(),
                3 => (value as i16).to_be_bytes().to_vec(),
                5 => (value as f32).to_be_bytes().to_vec(),
                6 => value.to_be_bytes().to_vec(),
                8 => (value as i8).to_be_bytes().to_vec(),
                10 => (value as u32).to_be_bytes().to_vec(),
                11 => (value as u16).to_be_bytes().to_vec(),
                _ => (value as u8).to_be_bytes().to_vec(),
            };
            if self.byte_order == ByteOrder::Little {
                number.reverse();
            }
            bytes.extend(number);
        }
        bytes
    }

    fn load(&self, options: &SegyOptions) -> Result<LoadedImage, ReadReason> {
        let bytes = self.bytes();
        let options = ReadOptions { segy: *options, ..ReadOptions::default() };
        load_bytes(&bytes, FORMAT, &options, &mut Silent)
    }

    fn plain(&self) -> LoadedImage {
        self.load(&SegyOptions::default()).unwrap()
    }
}

/// IBM's number next to a value.
pub(super) fn ibm(value: f64) -> u32 {
    if value == 0.0 {
        return 0;
    }
    let (mut exponent, mut size) = (64, value.abs());
    while size >= 1.0 {
        (size, exponent) = (size / 16.0, exponent + 1);
    }
    while size < 1.0 / 16.0 {
        (size, exponent) = (size * 16.0, exponent - 1);
    }
    u32::from(value < 0.0) << 31 | exponent << 24 | (size * 2f64.powi(24)).round() as u32
}

/// A line along X, 12.5 m apart, as in the velocity models of benchmarks.
fn line(count: i32) -> Writer {
    let trace =
        |k: i32| Written { numbers: [0, 0], place: [125 * (k + 1), 0], value: f64::from(10 * k) };
    Writer { scalar: -10, traces: (0..count).map(trace).collect(), ..Writer::default() }
}

/// Inlines 100, 102 …, crosslines 7, 8 …, bins of 25 m × 12.5 m, turned by 30 degrees.
fn cube(inlines: i32, crosslines: i32) -> Writer {
    let (sin, cos) = 30f64.to_radians().sin_cos();
    let trace = |k: i32| {
        let (i, j) = (k % crosslines, k / crosslines);
        let (u, v) = (12.5 * f64::from(i), 25.0 * f64::from(j));
        let place = [4e5 + u * cos - v * sin, 6e6 + u * sin + v * cos];
        Written {
            numbers: [100 + 2 * j, 7 + i],
            place: place.map(|p| (100.0 * p).round() as i32),
            value: f64::from(10 * i + 100 * j),
        }
    };
    Writer {
        scalar: -100,
        traces: (0..inlines * crosslines).map(trace).collect(),
        ..Writer::default()
    }
}

fn values(image: &AnyImage) -> Vec<f64> {
    image.samples().to_f32().into_iter().map(f64::from).collect()
}

#[test]
fn a_line_has_x_along_it_and_samples_downwards() {
    let loaded = Writer { interval: 6250, ..line(4) }.plain();
    assert_eq!(loaded.image.shape(), [4, 5]);
    assert_eq!(loaded.image.spacing(), [12.5, 6.25]);
    assert_eq!(loaded.image.origin(), [12.5, 0.0]);
    let expected: Vec<f64> =
        (0..5).flat_map(|y| (0..4).map(move |x| (10 * x + y).into())).collect();
    assert_eq!(values(&loaded.image), expected);
    assert_eq!(loaded.units, ["m", ""]);
    let known = SegyOptions { vertical: Some(Vertical::Depth), ..SegyOptions::default() };
    let deep = Writer { feet: true, ..line(4) }.load(&known).unwrap();
    assert_eq!(deep.units, ["ft", "ft"]);
    assert!(deep.notes.contains(&ReadNote::Feet), "{:?}", deep.notes);
}

#[test]
fn a_turned_cube_has_its_bins_and_its_direction() {
    let loaded = cube(6, 9).plain();
    assert_eq!(loaded.image.shape(), [9, 6, 5]);
    let near = |a: f64, b: f64, tolerance: f64| assert!((a - b).abs() < tolerance, "{a} {b}");
    // coordinates are rounded to a centimetre, over eight bins of 12.5 m and five of 25 m
    for (found, expected) in loaded.image.spacing().into_iter().zip([12.5, 25.0, 4.0]) {
        near(found, expected, 2e-3);
    }
    let direction = loaded.image.direction();
    let (sin, cos) = 30f64.to_radians().sin_cos();
    let expected = [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]];
    for (found, expected) in direction.iter().flatten().zip(expected.as_flattened()) {
        near(*found, *expected, 2e-4);
    }
    near(loaded.image.origin()[0], 4e5, 0.02);
    near(loaded.image.origin()[1], 6e6, 0.02);
    let at = |x: usize, y: usize, z: usize| values(&loaded.image)[x + 9 * (y + 6 * z)];
    assert_eq!((at(8, 0, 0), at(0, 5, 1), at(3, 2, 4)), (80.0, 501.0, 234.0));
    assert!(loaded.notes.iter().all(|note| !note.is_warning()), "{:?}", loaded.notes);
    assert!(loaded.notes[0].to_string().contains("inlines 100 to 110 by 2, crosslines 7 to 15"));
}

#[test]
fn traces_may_come_in_any_order_and_some_not_at_all() {
    let whole = cube(5, 7);
    let mut some = whole.clone();
    some.traces.remove(17); // inline 104, crossline 10
    some.traces.reverse();
    some.traces.swap(3, 20);
    let (whole, some) = (whole.plain(), some.plain());
    assert_eq!(some.image.shape(), whole.image.shape());
    let missing = ReadNote::MissingTraces {
        missing: 1,
        expected: 35,
        first: "inline 104, crossline 10".into(),
    };
    assert!(some.notes.contains(&missing), "{:?}", some.notes);
    for (k, (a, b)) in values(&some.image).into_iter().zip(values(&whole.image)).enumerate() {
        assert_eq!(a, if k % 35 == 17 { 0.0 } else { b });
    }
    for (a, b) in some.image.spacing().iter().zip(whole.image.spacing()) {
        assert!((a - b).abs() < 2e-3, "{a} {b}"); // centimetres of another 34 traces
    }
}

#[test]
fn every_number_and_revision_gives_the_same_samples() {
    let expected = values(&cube(3, 4).plain().image);
    for (code, name) in [
        (1, "float32"),
        (2, "int32"),
        (3, "int16"),
        (5, "float32"),
        (6, "float64"),
        (10, "uint32"),
        (11, "uint16"),
    ] {
        for (revision, byte_order) in [
            (0, ByteOrder::Big),
            (1, ByteOrder::Little),
            (2, ByteOrder::Big),
            (2, ByteOrder::Little),
        ] {
            let loaded = Writer { code, revision, byte_order, ..cube(3, 4) }.plain();
            assert_eq!(loaded.image.type_name(), name);
            assert_eq!(values(&loaded.image), expected, "code {code}, revision {revision}");
        }
    }
    for (code, name) in [(8, "int8"), (16, "uint8")] {
        let loaded = Writer { code, ..line(7) }.plain();
        assert_eq!(loaded.image.type_name(), name);
        assert_eq!(values(&loaded.image), values(&line(7).plain().image));
    }
}

#[test]
fn extended_headers_are_skipped_counted_or_not() {
    let expected = values(&line(3).plain().image);
    for texts in [1, 3, -1] {
        let loaded = Writer { texts, ..line(3) }.plain();
        assert_eq!(values(&loaded.image), expected, "{texts}");
    }
}

#[test]
fn given_bytes_go_before_the_usual_ones() {
    let odd = Writer { bytes: [9, 21, 201, 205], ..cube(4, 3) };
    let options = SegyOptions {
        trace_bytes: Some([9, 21]),
        coordinate_bytes: Some([201, 205]),
        ..SegyOptions::default()
    };
    let (given, usual) = (odd.load(&options).unwrap(), cube(4, 3).plain());
    assert_eq!(given.image.spacing(), usual.image.spacing());
    assert_eq!(values(&given.image), values(&usual.image));
    // and without a word about them all is one line, by the numbers at byte 21: three for twelve
    let error = odd.load(&SegyOptions::default()).unwrap_err().to_string();
    assert!(error.contains("traces 1 and 4 both are ensemble 7"), "{error}");
    let beyond = SegyOptions { trace_bytes: Some([9, 238]), ..SegyOptions::default() };
    assert!(odd.load(&beyond).unwrap_err().to_string().contains("byte 238"));
}

#[test]
fn one_trace_at_two_places_of_the_file_is_an_error_that_names_both() {
    let mut twice = cube(3, 3);
    twice.traces.push(twice.traces[4]);
    let error = twice.load(&SegyOptions::default()).unwrap_err().to_string();
    assert!(error.contains("traces 5 and 10 both are inline 102, crossline 8"), "{error}");
}

#[test]
fn numbers_that_fill_no_grid_are_refused() {
    let mut diagonal = line(40);
    for (k, trace) in diagonal.traces.iter_mut().enumerate() {
        trace.numbers = [k as i32, k as i32];
    }
    let error = diagonal.load(&SegyOptions::default()).unwrap_err().to_string();
    assert!(error.contains("1600 places"), "{error}");
    let options = SegyOptions { trace_bytes: Some([193, 193]), ..SegyOptions::default() };
    assert_eq!(diagonal.load(&options).unwrap().image.shape(), [40, 5]);
}

#[test]
fn coordinates_that_fit_no_grid_or_are_not_there_are_warned_about() {
    let mut bent = line(9);
    bent.traces[8].place = [1125, 200];
    let notes = bent.plain().notes;
    let warned = notes.iter().any(|n| matches!(n, ReadNote::UnevenLine { .. }));
    assert!(warned, "{notes:?}");

    let mut nowhere = cube(3, 3);
    nowhere.traces.iter_mut().for_each(|trace| trace.place = [0, 0]);
    let loaded = nowhere.plain();
    assert_eq!(loaded.image.spacing(), [1.0, 1.0, 4.0]);
    let bytes = "181 and 185, 73 and 77, 81 and 85".into();
    assert!(loaded.notes.contains(&ReadNote::NoCoordinates { bytes }), "{:?}", loaded.notes);

    let mut uneven = cube(9, 9);
    for trace in &mut uneven.traces {
        trace.place[0] += 500 * ((trace.numbers[0] - 100) / 2 % 2); // 5 m for every other row
    }
    assert!(uneven.plain().notes.iter().any(|n| matches!(n, ReadNote::Irregular { .. })));
}

#[test]
fn a_line_across_the_map_is_measured_along_itself() {
    let mut slanted = line(5);
    for (k, trace) in slanted.traces.iter_mut().enumerate() {
        trace.place = [1000 - 300 * k as i32, 400 * k as i32]; // 50 m apart
    }
    let loaded = slanted.plain();
    assert_eq!((loaded.image.spacing()[0], loaded.image.origin()[0]), (50.0, 0.0));
    let ends = ReadNote::Line { first: [100.0, 0.0], last: [-20.0, 160.0] };
    assert!(loaded.notes.contains(&ends), "{:?}", loaded.notes);
}

#[test]
fn headers_that_promise_too_much_are_refused_with_what_they_promise() {
    let whole = line(4).bytes();
    let changed = |at: usize, bytes: &[u8]| {
        let mut file = whole.clone();
        file[at - 1..at - 1 + bytes.len()].copy_from_slice(bytes);
        decode_image(&file, FORMAT, &ReadOptions::default(), &mut Silent).unwrap_err().to_string()
    };
    assert!(changed(3225, &[0, 77]).contains("is 77"));
    assert!(changed(3225, &[0, 9]).contains("is 9"));
    assert!(changed(3221, &[0, 6]).contains("left over"), "{}", changed(3221, &[0, 6]));
    assert!(changed(3221, &[0, 0]).contains("is 0"));
    assert!(changed(3505, &[0, 1]).contains("past the end"));
    assert!(changed(3505, &[255, 255]).contains("without an end"));
    assert!(changed(3505, &[255, 0]).contains("-256"));
    assert!(changed(3501, &[2, 0, 0, 0, 0, 0, 1, 9, 1, 9]).contains("additional trace headers"));
    let many = [2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0];
    assert!(changed(3501, &many).contains("4 traces of "), "{}", changed(3501, &many));
    for length in [1, 3600, 3700, whole.len() - 1] {
        let cut = decode_image(&whole[..length], FORMAT, &ReadOptions::default(), &mut Silent);
        assert!(cut.is_err(), "{length}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// What is read has as many samples as its shape says, which `Image` itself guarantees.
    #[test]
    fn damaged_files_end_in_an_image_or_an_error(
        is_cube in any::<bool>(),
        revision in 0..3_u8,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in prop::option::weighted(0.2, any::<prop::sample::Index>()),
    ) {
        let writer = if is_cube { cube(3, 4) } else { line(5) };
        let mut bytes = Writer { revision, ..writer }.bytes();
        for (place, value) in changes {
            // everything hangs on the binary and the trace headers
            let at = 3200 + place.index(bytes.len() - 3200);
            bytes[at] = value;
        }
        if let Some(length) = cut {
            bytes.truncate(length.index(bytes.len()));
        }
        let _ = decode_image(&bytes, FORMAT, &ReadOptions::default(), &mut Silent);
    }

    /// Any numbers of a small survey: each trace is found where its numbers say.
    #[test]
    fn every_trace_comes_to_its_place(
        least in -1000..1000_i32, step in 1..5_i32, inlines in 2..5_i32, crosslines in 2..5_i32,
        order in any::<prop::sample::Index>(),
    ) {
        let mut writer = cube(inlines, crosslines);
        for trace in &mut writer.traces {
            trace.numbers = trace.numbers.map(|n| least + step * n);
        }
        let turn = order.index(writer.traces.len());
        writer.traces.rotate_left(turn);
        prop_assert_eq!(values(&writer.plain().image), values(&cube(inlines, crosslines).plain().image));
    }
}
