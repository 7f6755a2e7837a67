//! Files that contradict themselves, leave gaps, or say odd things.

use super::*;

/// The file with bytes of a trace header, counted from 1, changed in some of the traces.
fn with_header<const N: usize>(
    writer: &Writer,
    at: usize,
    number: [u8; N],
    is_wanted: impl Fn(usize) -> bool,
) -> Vec<u8> {
    let mut file = writer.bytes();
    let each = (file.len() - 3600) / writer.traces.len();
    for start in (0..writer.traces.len()).filter(|&k| is_wanted(k)).map(|k| 3600 + k * each) {
        file[start + at - 1..][..N].copy_from_slice(&number);
    }
    file
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
    assert_eq!(cube(5, 7).plain().absent, None);
    let mut some = cube(5, 7);
    some.traces.remove(17);
    let absent = some.plain().absent.unwrap();
    let expected: Vec<u8> = (0..5 * 35).map(|k| u8::from(k % 35 == 17)).collect();
    assert_eq!(absent, expected);
}

#[test]
fn dead_traces_and_dummies_are_missing_ones() {
    let whole = values(&cube(5, 7).plain().image);
    for code in [2_i16, 3] {
        let loaded =
            load(&with_header(&cube(5, 7), 29, code.to_be_bytes(), |k| k % 9 == 4)).unwrap();
        assert!(loaded.notes.contains(&ReadNote::DeadTraces { dead: 4, count: 35, first: 5 }));
        let absent = loaded.absent.as_deref().unwrap_or_default();
        for (k, value) in values(&loaded.image).into_iter().enumerate() {
            let is_dead = k % 35 % 9 == 4;
            assert_eq!((value, absent[k] == 1), (if is_dead { 0.0 } else { whole[k] }, is_dead));
        }
    }
    let marked = load(&with_header(&cube(5, 7), 29, 2_i16.to_be_bytes(), |_| true)).unwrap();
    assert_eq!((values(&marked.image), marked.absent), (whole, None));
    assert!(marked.notes.contains(&ReadNote::AllDead { count: 35 }));
}
