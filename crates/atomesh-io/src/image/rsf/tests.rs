use super::super::{ReadOptions, SegyOptions, decode_image, load_bytes, load_image};
use super::*;
use atomesh::watch::Silent;
use proptest::prelude::*;

const SHAPE: [usize; 3] = [3, 4, 2];

/// A text, and the samples behind it: the value says which of the file's axes has which index.
fn file(text: &str, shape: [usize; 3], encode: fn(f32) -> [u8; 4]) -> Vec<u8> {
    let [n1, n2, n3] = shape;
    let sizes = format!("n1={n1} n2={n2} n3={n3}\n");
    let mut bytes = format!("{sizes}{text}\nin=\"stdin\"\n\x0c\x0c\x04").into_bytes();
    for k3 in 0..n3 {
        for k2 in 0..n2 {
            (0..n1).for_each(|k1| bytes.extend(encode((100 * k1 + 10 * k2 + k3) as f32)));
        }
    }
    bytes
}

fn load(bytes: &[u8], vertical: Option<Vertical>) -> Result<LoadedImage, ReadReason> {
    let segy = SegyOptions { vertical, ..SegyOptions::default() };
    load_bytes(bytes, FORMAT, &ReadOptions { segy, ..ReadOptions::default() }, &mut Silent)
}

fn value(image: &AnyImage, index: [usize; 3]) -> f32 {
    let shape = image.shape();
    let Samples::F32(values) = image.samples() else { panic!("{}", image.type_name()) };
    values[index[0] + shape[0] * (index[1] + shape[1] * index[2])]
}

#[test]
fn a_labelled_depth_is_the_last_axis() {
    let text = "o1=10 d1=5 label1=Depth unit1=m d2=25 label2=X unit2=m o3=7 d3=-50 unit3=m";
    let loaded = load(&file(text, SHAPE, f32::to_le_bytes), None).unwrap();
    let [n1, n2, n3] = SHAPE;
    assert_eq!(loaded.image.shape(), [n2, n3, n1]);
    assert_eq!(loaded.image.spacing(), [25.0, 50.0, 5.0]);
    assert_eq!(loaded.image.origin(), [0.0, 7.0, 10.0]);
    assert_eq!(loaded.image.direction()[1], [0.0, -1.0, 0.0]);
    assert_eq!(loaded.units, ["m", "m", "m"]);
    assert_eq!(value(&loaded.image, [3, 1, 2]), 231.0);
    assert_eq!(value(&loaded.image, [0, 1, 0]), 1.0);
    let order = vec!["2 (X)".into(), "3".into(), "1 (Depth)".into()];
    assert_eq!(loaded.notes, [ReadNote::Axes { order, is_known: true }]);
}

#[test]
fn without_a_label_axes_keep_their_order_unless_the_caller_knows() {
    let bytes = file("data_format=xdr_float", SHAPE, f32::to_be_bytes);
    let straight = load(&bytes, None).unwrap();
    assert_eq!(straight.image.shape(), SHAPE);
    assert_eq!(value(&straight.image, [2, 3, 1]), 231.0);
    assert!(straight.notes[0].to_string().contains("1, 2, 3"), "{}", straight.notes[0]);
    let turned = load(&bytes, Some(Vertical::Depth)).unwrap();
    assert_eq!(turned.image.shape(), [4, 2, 3]);
    assert_eq!(value(&turned.image, [3, 1, 2]), 231.0);
}

#[test]
fn a_flat_image_in_time_has_its_traces_along_x() {
    let text = "label1='Time' unit1=\"s\" d1=0.004 d2=12.5";
    let loaded = load(&file(text, [3, 4, 1], f32::to_le_bytes), None).unwrap();
    assert_eq!(loaded.image.shape(), [4, 3]);
    assert_eq!(loaded.image.spacing(), [12.5, 0.004]);
    assert_eq!(value(&loaded.image, [3, 1, 0]), 130.0);
}

#[test]
fn text_samples_are_those_of_binary_ones() {
    let text = b"n1=2 n2=3 data_format=ascii_float in=stdin\n\x0c\x0c\x04 1 2.5\n3 -4 5e1 6";
    let image = load(text, None).unwrap().image;
    assert_eq!(*image.samples(), Samples::F32(vec![1.0, 2.5, 3.0, -4.0, 50.0, 6.0].into()));
    let down = load(text, Some(Vertical::Time)).unwrap().image;
    assert_eq!(*down.samples(), Samples::F32(vec![1.0, 3.0, 50.0, 2.5, -4.0, 6.0].into()));
}

#[test]
fn the_last_value_of_a_key_counts_and_files_may_have_moved() {
    let folder = tempfile::tempdir().unwrap();
    let bytes: Vec<u8> = (0..6).flat_map(|k| (k as f32).to_le_bytes()).collect();
    std::fs::write(folder.path().join("a.rsf@"), &bytes).unwrap();
    let path = folder.path().join("a.rsf");
    let text = "sfspike: n1=9\n n1=2 n2=3 in=\"/no/such/place/a.rsf@\"\n";
    std::fs::write(&path, text).unwrap();
    let loaded = load_image(&path, &ReadOptions::default(), &mut Silent).unwrap();
    assert_eq!(loaded.image.shape(), [2, 3]);
    let beside = |note: &ReadNote| matches!(note, ReadNote::DataBeside { .. });
    assert!(loaded.notes.iter().any(beside), "{:?}", loaded.notes);
    std::fs::write(&path, text.replace("a.rsf@", "gone")).unwrap();
    let error = load_image(&path, &ReadOptions::default(), &mut Silent).unwrap_err().to_string();
    assert!(error.contains("a.rsf") && error.contains("/no/such/place/gone"), "{error}");
}

#[test]
fn what_is_wrong_is_named() {
    for (text, words) in [
        ("n1=2 n2=3", "in is missing"),
        ("n1=2 n2=3 in=stdin", "two form feeds"),
        ("n1=0 n2=3 in=stdin", "n is 0"),
        ("n1=2 n2=3 d1=x in=stdin", "d is x"),
        ("n1=2 in=stdin", "1 axes"),
        ("n1=2 n2=2 n3=2 n4=2 in=stdin", "4 axes"),
        ("n1=2 n2=2 in=stdin data_format=native_complex", "native_complex"),
        ("n1=2 n2=2 in=stdin esize=8", "esize is 8"),
        ("n1=2 n2=2 in=stdin\x0c\x0c\x04abc", "0 of 4 samples"),
        ("n1=99999999 n2=99999999 n3=9999 in=stdin\x0c\x0c\x04", "99999999"),
        (
            "n1=2 n2=2 in=stdin data_format=ascii_int\x0c\x0c\x04 1 2 three 4",
            "number 3 of the file",
        ),
        ("n1=2 n2=2 d2=0 in=stdin\x0c\x0c\x04abcdabcdabcdabcd", "spacing 0"),
        ("n1=2 n2=2 in=elsewhere", "\"elsewhere\""),
    ] {
        let error = load(text.as_bytes(), None).unwrap_err().to_string();
        assert!(error.contains(words), "{text}: {error}");
    }
}

proptest! {
    #[test]
    fn any_text_ends_in_an_image_or_an_error(
        text in r#"((n[1-4]|d1|o2|in|label1|data_format|esize)=("?(stdin|Depth|[0-9.e-]{0,6}|xdr_float|ascii_int)"?)?[ \n]){0,9}(\x0c\x0c\x04.{0,40})?"#,
        vertical in any::<bool>(),
    ) {
        let segy = SegyOptions { vertical: vertical.then_some(Vertical::Time), ..Default::default() };
        let options = ReadOptions { segy, ..ReadOptions::default() };
        let _ = decode_image(text.as_bytes(), FORMAT, &options, &mut Silent);
    }
}
