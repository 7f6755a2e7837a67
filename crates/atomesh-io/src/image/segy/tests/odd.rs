//! Files that contradict themselves, leave gaps, or say odd things.

use super::super::super::{Duplicates, IntervalSource, SampleFormat};
use super::*;

/// A file whose trace headers can be changed.
struct Changed {
    file: Vec<u8>,
    traces: usize,
}

impl Changed {
    fn of(writer: &Writer) -> Self {
        Self { file: writer.bytes(), traces: writer.traces.len() }
    }

    /// The same with a number, at a byte counted from 1, in the headers of those traces that are wanted.
    fn with<const N: usize>(
        mut self,
        at: usize,
        number: [u8; N],
        is_wanted: impl Fn(usize) -> bool,
    ) -> Self {
        let each = (self.file.len() - 3600) / self.traces;
        for trace in (0..self.traces).filter(|&k| is_wanted(k)) {
            self.file[3600 + trace * each + at - 1..][..N].copy_from_slice(&number);
        }
        self
    }

    fn load(&self) -> LoadedImage {
        load(&self.file).unwrap()
    }
}

fn load(bytes: &[u8]) -> Result<LoadedImage, ReadReason> {
    load_bytes(bytes, FORMAT, &ReadOptions::default(), &mut Silent)
}

/// The warnings of an image, as texts.
fn warnings(loaded: &LoadedImage) -> Vec<String> {
    loaded.notes.iter().filter(|n| n.is_warning()).map(ReadNote::to_string).collect()
}

#[test]
fn places_without_a_trace_are_told_from_samples_that_are_0() {
    assert_eq!(cube(5, 7).plain().image.absent(), None);
    let mut some = cube(5, 7);
    some.traces.remove(17);
    let image = some.plain().image;
    let expected: Vec<bool> = (0..5 * 35).map(|k| k % 35 == 17).collect();
    assert_eq!(image.absent(), Some(&expected[..]));
}

#[test]
fn dead_traces_and_dummies_are_missing_ones() {
    let whole = values(&cube(5, 7).plain().image);
    for code in [2_i16, 3] {
        let loaded = Changed::of(&cube(5, 7)).with(29, code.to_be_bytes(), |k| k % 9 == 4).load();
        assert!(loaded.notes.contains(&ReadNote::DeadTraces { dead: 4, count: 35, first: 5 }));
        let absent = loaded.image.absent().unwrap_or_default();
        for (k, value) in values(&loaded.image).into_iter().enumerate() {
            let is_dead = k % 35 % 9 == 4;
            assert_eq!((value, absent[k]), (if is_dead { 0.0 } else { whole[k] }, is_dead));
        }
    }
    let marked = Changed::of(&cube(5, 7)).with(29, 2_i16.to_be_bytes(), |_| true).load();
    assert_eq!((values(&marked.image), marked.image.absent()), (whole, None));
    assert!(marked.notes.contains(&ReadNote::AllDead { count: 35 }));
}

#[test]
fn a_dead_trace_is_nowhere_and_moves_no_grid() {
    let zeros = [0; 8];
    let dead = Changed::of(&cube(5, 7)).with(29, 2_i16.to_be_bytes(), |k| k == 20);
    let loaded = dead.with(181, zeros, |k| k == 20).load();
    assert!(loaded.notes.iter().all(|n| !matches!(n, ReadNote::Irregular { .. })));
    // centimetres of the other 34 traces
    assert!((loaded.image.spacing()[0] - 12.5).abs() < 2e-3);
}

#[test]
fn delays_are_scaled_as_the_trace_header_says() {
    let delayed = |scalar: i16| {
        let changed = Changed::of(&line(4)).with(109, 1000_i16.to_be_bytes(), |_| true);
        changed.with(215, scalar.to_be_bytes(), |_| true).load()
    };
    for (scalar, origin) in [(0, 1000.0), (1, 1000.0), (-10, 100.0), (-1000, 1.0), (10, 10_000.0)] {
        assert_eq!(delayed(scalar).image.origin()[1], origin, "{scalar}");
        assert!(warnings(&delayed(scalar)).is_empty());
    }
    let odd = delayed(37);
    assert_eq!(odd.image.origin()[1], 1000.0);
    assert!(odd.notes.contains(&ReadNote::TimeScalar { trace: 1, scalar: 37 }));
    // without a delay there is nothing to scale, and old files have anything there
    let nothing = Changed::of(&line(4)).with(215, 37_i16.to_be_bytes(), |_| true).load();
    assert!(warnings(&nothing).is_empty());

    let differ = Changed::of(&line(4)).with(109, 8_i16.to_be_bytes(), |k| k == 2).load();
    assert!(differ.notes.contains(&ReadNote::Delays { first: 0.0, trace: 3, other: 8.0 }));
}

#[test]
fn intervals_that_disagree_or_are_negative_are_told_with_the_one_taken() {
    use IntervalSource::{BinaryHeader, FirstTrace};
    let of_trace = |writer: Writer, interval: i16| {
        Changed::of(&writer).with(117, interval.to_be_bytes(), |k| k > 1).load()
    };
    let differ = of_trace(line(5), 2000);
    assert_eq!(differ.image.spacing()[1], 4.0);
    assert!(differ.notes.contains(&ReadNote::IntervalsDiffer {
        source: BinaryHeader,
        taken: 4000.0,
        trace: 3,
        other: 2000.0,
        count: 3
    }));
    assert!(warnings(&of_trace(line(5), 4000)).is_empty());
    assert!(warnings(&of_trace(line(5), 0)).is_empty());

    // 61536 is -4000 with a sign
    let negative = Writer { interval: 61536, ..line(5) };
    let mended = Changed::of(&negative).with(117, 4000_i16.to_be_bytes(), |_| true).load();
    assert_eq!(mended.image.spacing()[1], 4.0);
    assert!(mended.notes.contains(&ReadNote::NegativeInterval {
        of: BinaryHeader,
        stated: -4000.0,
        source: FirstTrace,
        taken: 4000.0
    }));
    let unsigned = negative.plain();
    assert_eq!(unsigned.image.spacing()[1], 61.536);
    assert_eq!(warnings(&unsigned).len(), 1);
    assert_eq!(Writer { interval: 0, ..line(5) }.plain().image.spacing()[1], 1.0);
}

/// A bent line of the plane: y is a wave, steps of x are even.
fn wave(count: i32) -> Writer {
    let trace = |k: i32| {
        let t = f64::from(k) / f64::from(count - 1);
        let place = [5e5 + 2000.0 * t, 6e6 + 600.0 * (3.0 * t).sin()];
        let place = place.map(|p| (100.0 * p).round() as i32);
        Written { numbers: [0, 0], place, value: 0.0 }
    };
    Writer { scalar: -100, traces: (0..count).map(trace).collect(), ..Writer::default() }
}

#[test]
fn x_of_a_crooked_line_is_the_sum_of_its_steps() {
    let loaded = wave(101).plain();
    // the arc's length, by many more steps than the line has; a chord's is 2001.8
    let at = |t: f64| [2000.0 * t, 600.0 * (3.0 * t).sin()];
    let arc: f64 = (0..100_000)
        .map(|k| (at(f64::from(k) / 1e5), at(f64::from(k + 1) / 1e5)))
        .map(|(a, b)| (b[0] - a[0]).hypot(b[1] - a[1]))
        .sum();
    // chords are shorter by their curvature, a ten thousandth here
    assert!((loaded.image.spacing()[0] * 100.0 / arc - 1.0).abs() < 2e-4, "{arc}");
    assert_eq!(loaded.image.origin()[0], 0.0);
    let ends = |n: &ReadNote| match n {
        ReadNote::CrookedLine { first, last, .. } => Some((*first, *last)),
        _ => None,
    };
    let last = [502_000.0, (6e8 + 6e4 * 3f64.sin()).round() / 100.0];
    assert_eq!(loaded.notes.iter().find_map(ends), Some(([5e5, 6e6], last)));
    // its steps are uneven, since those of x are even
    assert!(loaded.notes.iter().any(|n| matches!(n, ReadNote::UnevenLine { .. })));
}

#[test]
fn rounded_coordinates_do_not_lengthen_a_line() {
    // steps of 1.5 m, in whole metres, along a bend
    let mut rounded = wave(1001);
    rounded.scalar = 1;
    for trace in &mut rounded.traces {
        trace.place = trace.place.map(|p| (f64::from(p) / 100.0).round() as i32);
    }
    let (fine, coarse) = (wave(1001).plain(), rounded.plain());
    let ratio = coarse.image.spacing()[0] / fine.image.spacing()[0];
    assert!((ratio - 1.0).abs() < 5e-3, "{ratio}"); // half a metre across steps of ten
}

#[test]
fn coordinates_arrange_traces_that_have_no_numbers() {
    let numbered = cube(12, 16);
    let mut bare = numbered.clone();
    bare.traces.iter_mut().for_each(|t| t.numbers = [0, 0]);
    let (bare_image, whole) = (bare.plain(), numbered.plain());
    assert_eq!(bare_image.image.shape(), [16, 12, 5]);
    assert_eq!(values(&bare_image.image), values(&whole.image));
    assert_eq!(bare_image.image.spacing(), whole.image.spacing());
    assert_eq!(bare_image.image.origin(), whole.image.origin());
    let note = ReadNote::TracesByPosition { count: 192, shape: [16, 12] };
    assert!(bare_image.notes.contains(&note) && warnings(&bare_image).is_empty());

    // gaps, and any order behind the first two traces
    let mut some = bare.clone();
    some.traces.swap(5, 150);
    some.traces.truncate(190);
    some.traces.drain(40..47);
    let some = some.plain();
    assert_eq!(some.image.shape(), [16, 12, 5]);
    let absent = some.image.absent().unwrap();
    for (k, value) in values(&some.image).into_iter().enumerate() {
        assert_eq!(value, if absent[k] { 0.0 } else { values(&whole.image)[k] });
    }
}

#[test]
fn a_large_grid_is_found_though_coordinates_are_rounded() {
    // bins of 12.5 m by 25 m in whole metres: a step is known to a tenth at first
    let mut bare = cube(150, 200);
    bare.scalar = 1;
    for trace in &mut bare.traces {
        trace.numbers = [0, 0];
        trace.place = trace.place.map(|p| (f64::from(p) / 100.0).round() as i32);
    }
    assert_eq!(bare.plain().image.shape(), [200, 150, 5]);
}

#[test]
fn traces_without_numbers_that_are_no_grid_are_a_line_or_refused() {
    let line = wave(101).plain();
    assert_eq!(line.image.shape(), [101, 5]);
    // rows of a grid that is bent
    let mut bent = cube(8, 30);
    for (k, trace) in bent.traces.iter_mut().enumerate() {
        trace.numbers = [0, 0];
        trace.place[0] += 3000 * (k as i32 % 7) * (k as i32 / 30);
    }
    let error = load(&bent.bytes()).unwrap_err();
    assert!(matches!(error, ReadReason::NoLine { traces: 240, .. }), "{error}");
    // unless the caller says that it is a line
    let options = SegyOptions { trace_bytes: Some([193, 193]), ..SegyOptions::default() };
    assert_eq!(bent.load(&options).unwrap().image.shape(), [240, 5]);
}

#[test]
fn sheared_surveys_are_refused_with_their_angle() {
    let (sin, cos) = 70f64.to_radians().sin_cos();
    let mut sheared = cube(9, 9);
    for (k, trace) in sheared.traces.iter_mut().enumerate() {
        let (i, j) = (12.5 * (k % 9) as f64, 25.0 * (k / 9) as f64);
        trace.place = [i + j * cos, j * sin].map(|p| (100.0 * p).round() as i32);
    }
    match load(&sheared.bytes()) {
        // a centimetre over 200 m
        Err(ReadReason::ShearedTraces { degrees }) => assert!((degrees - 70.0).abs() < 0.01),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_format_that_is_given_goes_before_the_code() {
    let called = |code: i16| {
        let mut file = line(4).bytes();
        file[3224..3226].copy_from_slice(&code.to_be_bytes());
        file
    };
    let segy = SegyOptions { sample_format: Some(SampleFormat::F32), ..SegyOptions::default() };
    let options = ReadOptions { segy, ..ReadOptions::default() };
    let expected = values(&line(4).plain().image);
    for code in [1, 0, 4, 77] {
        let given = decode_image(&called(code), FORMAT, &options, &mut Silent).unwrap();
        assert_eq!(values(&given), expected, "{code}");
        if code != 1 {
            let error = load(&called(code)).unwrap_err();
            assert!(matches!(error, ReadReason::TraceFormat { .. }), "{error}");
        }
    }
}

/// Traces with 200 samples of a wave that decays, called by another code than they are written in.
fn decaying(written: i16, called: i16) -> LoadedImage {
    let mut writer = Writer { code: written, samples: 200, ..line(40) };
    let count = writer.samples;
    writer.traces.iter_mut().for_each(|t| t.value = 0.0);
    let mut file = writer.bytes();
    file[3224..3226].copy_from_slice(&called.to_be_bytes());
    for (trace, bytes) in file[3600..].chunks_exact_mut(240 + 4 * count).enumerate() {
        for (k, sample) in bytes[240..].chunks_exact_mut(4).enumerate() {
            let t = (k + 7 * trace) as f64;
            let value = 3e4 * (-0.02 * k as f64).exp() * (0.9 * t).sin();
            let bits = if written == 1 { ibm(value) } else { (value as f32).to_bits() };
            sample.copy_from_slice(&bits.to_be_bytes());
        }
    }
    load(&file).unwrap()
}

#[test]
fn samples_called_by_the_wrong_name_are_doubted_and_others_are_not() {
    for code in [1, 5] {
        assert!(warnings(&decaying(code, code)).is_empty(), "{code}");
        let doubt = warnings(&decaying(code, 6 - code));
        assert!(doubt.len() == 1 && doubt[0].contains("their bits are those of"), "{doubt:?}");
    }
    assert!(warnings(&Writer { code: 1, ..cube(6, 9) }.plain()).is_empty());
}

#[test]
fn samples_whose_bits_tell_nothing_are_doubted_if_they_are_large() {
    // values of one odd power of 2 differ from their other reading by a factor alone
    let mut writer = Writer { samples: 20, ..line(30) };
    for (k, trace) in writer.traces.iter_mut().enumerate() {
        trace.value = 100_300.0 + 300.0 * k as f64;
    }
    let mut file = writer.bytes();
    file[3225] = 1;
    let loaded = load(&file).unwrap();
    assert!(warnings(&loaded)[0].contains("may be those of IEEE numbers too"));
    assert!(warnings(&Writer { code: 1, ..writer }.plain()).is_empty());
}

#[test]
fn one_of_several_traces_with_the_same_numbers_is_kept() {
    let mut writer = cube(5, 7);
    let mut twice = writer.traces[17];
    twice.value = 777.0;
    writer.traces.push(twice);
    let text = writer.load(&SegyOptions::default()).unwrap_err().to_string();
    assert!(text.contains("traces 18 and 36"), "{text}");
    for (duplicates, is_last) in [(Duplicates::First, false), (Duplicates::Last, true)] {
        let options = SegyOptions { duplicates: Some(duplicates), ..SegyOptions::default() };
        let loaded = writer.load(&options).unwrap();
        assert_eq!(loaded.image.samples().get(17) == 777.0, is_last);
        let trace = if is_last { 18 } else { 36 };
        let note = ReadNote::DuplicateTraces { count: 1, is_last, trace };
        assert!(loaded.notes.contains(&note), "{:?}", loaded.notes);
        assert_eq!(loaded.image.absent(), None);
        assert_eq!(loaded.image.spacing(), cube(5, 7).plain().image.spacing());
    }
    // a dead trace gives way, whichever it is
    let dead = Changed::of(&writer).with(29, 2_i16.to_be_bytes(), |k| k == 35);
    let segy = SegyOptions { duplicates: Some(Duplicates::Last), ..SegyOptions::default() };
    let options = ReadOptions { segy, ..ReadOptions::default() };
    let loaded = load_bytes(&dead.file, FORMAT, &options, &mut Silent).unwrap();
    assert_ne!(loaded.image.samples().get(17), 777.0);
}

#[test]
fn a_file_that_is_cut_short_is_read_up_to_its_last_whole_trace() {
    let whole = cube(5, 7).bytes();
    let cut = &whole[..whole.len() - 50];
    let text = load(cut).unwrap_err().to_string();
    assert!(text.contains("34 traces are whole and 210 bytes are left over"), "{text}");
    let segy = SegyOptions { truncated: true, ..SegyOptions::default() };
    let options = ReadOptions { segy, ..ReadOptions::default() };
    let loaded = load_bytes(cut, FORMAT, &options, &mut Silent).unwrap();
    assert_eq!(loaded.image.shape(), cube(5, 7).plain().image.shape());
    let note = ReadNote::TruncatedTraces { found: 34, promised: None, rest: 210 };
    assert_eq!(loaded.notes[0], note);
    assert!(loaded.notes.iter().any(|n| matches!(n, ReadNote::MissingTraces { missing: 1, .. })));
    assert!(load_bytes(&whole[..3700], FORMAT, &options, &mut Silent).is_err());
}

#[test]
fn trace_headers_and_texts_are_counted_as_they_fill_the_file() {
    let plain = cube(5, 7);
    let values_of = |loaded: &LoadedImage| values(&loaded.image);
    let expected = values_of(&plain.plain());
    // revision 0 with two textual headers more
    let texts = Writer { revision: 0, texts: 2, ..plain.clone() };
    let loaded = texts.plain();
    assert_eq!(values_of(&loaded), expected);
    assert!(loaded.notes.contains(&ReadNote::CountedTexts { count: 2 }), "{:?}", loaded.notes);
    // the same bytes where no such headers are: what they hold means nothing
    let mut odd = Writer { revision: 0, ..plain.clone() }.bytes();
    odd[3505] = 2;
    assert_eq!(values_of(&load(&odd).unwrap()), expected);

    // an additional trace header, as revisions 2.0 and 2.1 count it
    let two = Writer { revision: 2, ..plain }.bytes();
    let each = (two.len() - 3600) / 35;
    for (minor, at, is_own) in
        [(1, 3507, true), (0, 3509, true), (0, 3507, false), (1, 3509, false)]
    {
        let mut file = two[..3600].to_vec();
        file[3501] = minor;
        file[at] = 1;
        for trace in two[3600..].chunks(each) {
            file.extend(&trace[..240]);
            file.extend([0; 240]);
            file.extend(&trace[240..]);
        }
        let loaded = load(&file).unwrap();
        assert_eq!(values_of(&loaded), expected, "{minor} {at}");
        let note = ReadNote::OtherRevision { count: 1 };
        assert_eq!(loaded.notes.contains(&note), !is_own, "{minor} {at}: {:?}", loaded.notes);
    }
}

#[test]
fn seismic_unix_is_read_in_either_order_of_bytes() {
    for byte_order in [ByteOrder::Little, ByteOrder::Big] {
        // numbers at places of their own: the header has none for them
        let writer = Writer { byte_order, bytes: [9, 13, 73, 77], ..cube(5, 7) };
        let mut file = writer.bytes()[3600..].to_vec();
        let each = file.len() / 35;
        let put = |file: &mut [u8], at: usize, number: u16| {
            let bytes = if byte_order == ByteOrder::Big {
                number.to_be_bytes()
            } else {
                number.to_le_bytes()
            };
            file[at - 1..at + 1].copy_from_slice(&bytes);
        };
        for trace in file.chunks_mut(each) {
            put(trace, 115, 5);
            put(trace, 117, 2000);
            trace[180..184].copy_from_slice(&0.25f32.to_le_bytes()); // d1, and no X
            put(trace, 215, 7); // no scalar of times
        }
        let load = |file: &[u8], segy: SegyOptions| {
            let options = ReadOptions { segy, ..ReadOptions::default() };
            load_bytes(file, su::CODEC.format, &options, &mut Silent)
        };
        let loaded = load(&file, SegyOptions::default()).unwrap();
        assert_eq!(loaded.image.samples(), cube(5, 7).plain().image.samples(), "{byte_order:?}");
        assert_eq!(loaded.image.spacing()[2], 2.0);
        let numbered = SegyOptions { trace_bytes: Some([9, 13]), ..SegyOptions::default() };
        assert_eq!(load(&file, numbered).unwrap().image.shape(), loaded.image.shape());
        // cut short, and of other lengths
        assert!(matches!(
            load(&file[..file.len() - 1], SegyOptions::default()),
            Err(ReadReason::TruncatedTraces { found: 34, .. })
        ));
        let whole = SegyOptions { truncated: true, ..SegyOptions::default() };
        assert!(load(&file[..file.len() - 1], whole).is_ok());
        put(&mut file[each..], 115, 4);
        let text = load(&file, SegyOptions::default()).unwrap_err().to_string();
        assert!(text.contains("4 in trace 2"), "{text}");
    }
}
