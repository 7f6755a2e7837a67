//! Scans as other programs write them: DICOM, MetaImage, NRRD and VTI, made here byte by byte. The same
//! scan lies in the same place of the world whatever file it comes in.

use std::fs;
use std::io::Write;
use std::path::Path;

use atomesh::image::{Frame, Image, Samples, Units};
use atomesh::watch::Silent;
use atomesh_io::image::{
    AnyImage, GivenFrame, ImageFormat, ReadError, ReadNote, ReadOptions, ReadReason, SeriesError,
    decode_image, load_image, read_image, write_image,
};
use proptest::prelude::*;

/// Samples along x, y and z.
const SHAPE: [usize; 3] = [5, 4, 3];

/// The axes of the scan in the world of a DICOM file, LPS, one after another; unlike each other, no
/// symmetry takes one to another.
const AXES: [[f64; 3]; 3] = [[0.8, 0.6, 0.0], [0.0, 0.0, -1.0], [-0.6, 0.8, 0.0]];

const SPACING: [f64; 3] = [0.5, 1.25, 3.0];

/// Sample 0, LPS.
const ORIGIN: [f64; 3] = [10.0, -20.0, 30.5];

/// Samples that tell every place.
fn values() -> Vec<i16> {
    (0..60).map(|k| 7 * k - 100).collect()
}

fn bytes() -> Vec<u8> {
    values().iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// The place of a sample in the file's world.
fn lps(index: [usize; 3]) -> [f64; 3] {
    std::array::from_fn(|r| {
        ORIGIN[r] + (0..3).map(|c| AXES[c][r] * SPACING[c] * index[c] as f64).sum::<f64>()
    })
}

fn read(path: &Path) -> Result<AnyImage, ReadError> {
    read_image(path, &ReadOptions::default(), &mut Silent)
}

fn decode(bytes: &[u8], format: ImageFormat) -> Result<AnyImage, ReadReason> {
    decode_image(bytes, format, &ReadOptions::default(), &mut Silent)
}

fn message(bytes: &[u8], format: ImageFormat) -> String {
    decode(bytes, format).unwrap_err().to_string()
}

/// Checks samples, and the places of all corners after the signs of the file's world are changed.
fn check(image: &AnyImage, signs: [f64; 3], what: &str) {
    let AnyImage::Volume(volume) = image else { panic!("{what} is flat") };
    assert_eq!(*volume.samples(), Samples::I16(values().into()), "{what}");
    for corner in 0..8 {
        let index: [usize; 3] = std::array::from_fn(|k| (corner >> k & 1) * (SHAPE[k] - 1));
        let place = volume.frame().lattice_to_world(Units::Samples, &index.map(|i| i as f64));
        for r in 0..3 {
            // single precision of NIfTI, for numbers up to 40
            let expected = signs[r] * lps(index)[r];
            assert!((place[r] - expected).abs() < 4e-6, "{what}: {place:?} along {r}, {expected}");
        }
    }
}

/// LPS to RAS.
const TURNED: [f64; 3] = [-1.0, -1.0, 1.0];

/// Coordinates as the file states them.
const KEPT: [f64; 3] = [1.0, 1.0, 1.0];

fn vector(v: [f64; 3]) -> String {
    format!("({},{},{})", v[0], v[1], v[2])
}

/// An NRRD header up to its last line, in a world whose axes are LPS times `signs`.
fn nrrd_header(space: &str, signs: [f64; 3], encoding: &str) -> String {
    let turn = |v: [f64; 3]| -> [f64; 3] { std::array::from_fn(|r| signs[r] * v[r]) };
    let column = |c: usize| vector(turn(AXES[c].map(|x| x * SPACING[c])));
    format!(
        "NRRD0005\n# made by hand\ntype: short\ndimension: 3\nspace: {space}\nsizes: 5 4 3\n\
         space directions: {} {} {}\nkinds: domain domain domain\nendian: little\n\
         encoding: {encoding}\nspace origin: {}\nkey:=value\n",
        column(0),
        column(1),
        column(2),
        vector(turn(ORIGIN))
    )
}

fn nrrd(space: &str, signs: [f64; 3]) -> Vec<u8> {
    [nrrd_header(space, signs, "raw").as_bytes(), b"\n", &bytes()].concat()
}

/// A MetaImage header without its last line.
fn meta_header(extra: &str) -> String {
    let list = |v: &[f64]| v.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    format!(
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n\
         {extra}TransformMatrix = {}\nOffset = {}\nCenterOfRotation = 0 0 0\n\
         ElementSpacing = {}\nDimSize = 5 4 3\nElementType = MET_SHORT\n",
        list(AXES.as_flattened()),
        list(&ORIGIN),
        list(&SPACING)
    )
}

fn meta(extra: &str) -> Vec<u8> {
    [meta_header(extra).as_bytes(), b"ElementDataFile = LOCAL\n", &bytes()].concat()
}

/// A DICOM element of explicit representation, least byte first.
fn element(tag: u32, kind: &[u8; 2], value: &[u8]) -> Vec<u8> {
    let mut bytes = vec![(tag >> 16) as u8, (tag >> 24) as u8, tag as u8, (tag >> 8) as u8];
    bytes.extend(kind);
    let padding = if kind == b"UI" { 0 } else { b' ' };
    let value = [value, &vec![padding; value.len() % 2]].concat();
    match kind {
        b"OW" | b"SQ" => {
            bytes.extend([0, 0]);
            bytes.extend((value.len() as u32).to_le_bytes());
        }
        _ => bytes.extend((value.len() as u16).to_le_bytes()),
    }
    [bytes, value].concat()
}

/// What a slice is made with; changed by tests.
#[derive(Clone)]
struct Slice {
    series: &'static str,
    position: [f64; 3],
    axes: [[f64; 3]; 2],
    shape: [u16; 2],
    photometric: &'static str,
    syntax: &'static str,
    frames: &'static str,
    scale: Option<(&'static str, &'static str)>,
    samples: Vec<u8>,
    /// Whether it says where it is, which way, and how far apart samples are.
    has: Said,
    /// The number in the series.
    instance: &'static str,
    /// The spacing at the detector, rows first.
    imager_spacing: &'static str,
}

/// What a slice says of its place.
#[derive(Clone, Copy)]
struct Said {
    position: bool,
    axes: bool,
    spacing: bool,
}

impl Slice {
    /// Slice k of the scan.
    fn of(k: usize) -> Self {
        Self {
            series: "1.2.3.4",
            position: lps([0, 0, k]),
            axes: [AXES[0], AXES[1]],
            shape: [5, 4],
            photometric: "MONOCHROME2",
            syntax: "1.2.840.10008.1.2.1",
            frames: "",
            scale: None,
            samples: bytes()[40 * k..40 * (k + 1)].to_vec(),
            has: Said { position: true, axes: true, spacing: true },
            instance: "",
            imager_spacing: "",
        }
    }

    fn bytes(&self) -> Vec<u8> {
        let list = |v: &[f64]| v.iter().map(f64::to_string).collect::<Vec<_>>().join("\\");
        let short = |tag, value: u16| element(tag, b"US", &value.to_le_bytes());
        let text = |tag, kind, value: &str| element(tag, kind, value.as_bytes());
        let mut file = [vec![0; 128], b"DICM".to_vec()].concat();
        file.extend(text(0x0002_0010, b"UI", self.syntax));
        // a sequence without a length, of an item without one, in which a wrong number of rows stands
        file.extend(b"\x08\x00\x32\x10SQ\0\0\xff\xff\xff\xff\xfe\xff\x00\xe0\xff\xff\xff\xff");
        file.extend(short(0x0028_0010, 99));
        file.extend(b"\xfe\xff\x0d\xe0\0\0\0\0\xfe\xff\xdd\xe0\0\0\0\0");
        // lies that nobody may follow
        file.extend(text(0x0018_0050, b"DS", "99"));
        file.extend(text(0x0018_0088, b"DS", "55"));
        if !self.imager_spacing.is_empty() {
            file.extend(text(0x0018_1164, b"DS", self.imager_spacing));
        }
        file.extend(text(0x0020_000e, b"UI", self.series));
        if !self.instance.is_empty() {
            file.extend(text(0x0020_0013, b"IS", self.instance));
        }
        if self.has.position {
            file.extend(text(0x0020_0032, b"DS", &list(&self.position)));
        }
        if self.has.axes {
            file.extend(text(0x0020_0037, b"DS", &list(self.axes.as_flattened())));
        }
        file.extend(short(0x0028_0002, 1));
        file.extend(text(0x0028_0004, b"CS", self.photometric));
        if !self.frames.is_empty() {
            file.extend(text(0x0028_0008, b"IS", self.frames));
        }
        file.extend(short(0x0028_0010, self.shape[1]));
        file.extend(short(0x0028_0011, self.shape[0]));
        if self.has.spacing {
            file.extend(text(0x0028_0030, b"DS", &list(&[SPACING[1], SPACING[0]])));
        }
        for (tag, value) in [(0x0028_0100, 16), (0x0028_0101, 16), (0x0028_0102, 15)] {
            file.extend(short(tag, value));
        }
        file.extend(short(0x0028_0103, 1));
        if let Some((intercept, slope)) = self.scale {
            file.extend(text(0x0028_1052, b"DS", intercept));
            file.extend(text(0x0028_1053, b"DS", slope));
        }
        file.extend(element(0x7fe0_0010, b"OW", &self.samples));
        file
    }
}

/// A folder of the scan's slices, named against their order, and of a file that is no image.
fn series(change: impl Fn(usize, &mut Slice)) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for k in 0..SHAPE[2] {
        let mut slice = Slice::of(k);
        change(k, &mut slice);
        fs::write(folder.path().join(["c", "b.17", "a.dcm"][k]), slice.bytes()).unwrap();
    }
    fs::write(folder.path().join("README"), "no image").unwrap();
    folder
}

fn series_error(change: impl Fn(usize, &mut Slice)) -> (SeriesError, String) {
    let error = read(series(change).path()).unwrap_err();
    let text = error.to_string();
    match error.reason {
        ReadReason::Series(reason) => (*reason, text),
        other => panic!("{other}"),
    }
}

#[test]
fn a_scan_lies_in_the_same_place_whatever_file_it_comes_in() {
    for (space, signs) in [
        ("left-posterior-superior", KEPT),
        ("LPS", KEPT),
        ("right-anterior-superior", TURNED),
        ("LAS", [1.0, -1.0, 1.0]),
    ] {
        check(&decode(&nrrd(space, signs), ImageFormat::NRRD).unwrap(), TURNED, space);
    }
    for extra in ["AnatomicalOrientation = RAI\n", "Modality = MET_MOD_CT\n"] {
        check(&decode(&meta(extra), ImageFormat::META_IMAGE).unwrap(), TURNED, extra);
    }
    check(&read(series(|_, _| {}).path()).unwrap(), TURNED, "DICOM");

    let turn = |v: [f64; 3]| -> [f64; 3] { std::array::from_fn(|r| TURNED[r] * v[r]) };
    let columns = AXES.map(turn);
    let direction = std::array::from_fn(|r| std::array::from_fn(|c| columns[c][r]));
    let frame = Frame::new(SHAPE).unwrap().with_spacing(SPACING).unwrap();
    let frame = frame.with_origin(turn(ORIGIN)).unwrap().with_direction(direction).unwrap();
    let image = Image::new(frame, Samples::I16(values().into())).unwrap();
    let folder = tempfile::tempdir().unwrap();
    for name in ["scan.nii", "scan.nii.gz", "scan.nrrd", "scan.vti"] {
        let path = folder.path().join(name);
        write_image(&path, &image, &mut Silent).unwrap();
        check(&read(&path).unwrap(), TURNED, name);
    }
}

#[test]
fn whoever_reads_coordinates_that_are_turned_is_told_so() {
    let folder = tempfile::tempdir().unwrap();
    let notes = |path: &Path| load_image(path, &ReadOptions::default(), &mut Silent).unwrap().notes;
    for (name, bytes, from) in [
        ("a.nrrd", nrrd("LPS", KEPT), Some("LPS")),
        ("b.nrrd", nrrd("LAS", [1.0, -1.0, 1.0]), Some("LAS")),
        ("c.nrrd", nrrd("RAS", TURNED), None),
        ("a.mha", meta("AnatomicalOrientation = RAI\n"), Some("LPS")),
        ("b.mha", meta(""), None),
    ] {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        assert_eq!(
            notes(&path),
            Vec::from_iter(from.map(|from| ReadNote::Turned { from })),
            "{name}"
        );
    }
    assert_eq!(notes(series(|_, _| {}).path()), [ReadNote::Turned { from: "LPS" }]);
}

#[test]
fn coordinates_of_no_body_stand_as_they_are() {
    for space in ["3D-right-handed", "3D-left-handed", "scanner-xyz"] {
        check(&decode(&nrrd(space, KEPT), ImageFormat::NRRD).unwrap(), KEPT, space);
    }
    let unnamed = String::from_utf8_lossy(&nrrd_header("", KEPT, "ascii").into_bytes())
        .replace("space: \n", "space dimension: 3\n");
    let words: Vec<_> = values().iter().map(i16::to_string).collect();
    let text = format!("{unnamed}\n{}", words.join("\n"));
    check(&decode(text.as_bytes(), ImageFormat::NRRD).unwrap(), KEPT, "space dimension");
    for extra in ["", "AnatomicalOrientation = ???\n", "Modality = MET_MOD_OTHER\n"] {
        check(&decode(&meta(extra), ImageFormat::META_IMAGE).unwrap(), KEPT, extra);
    }
    let columns = |r: usize| AXES.iter().map(move |axis| axis[r].to_string());
    let direction = (0..3).flat_map(columns).collect::<Vec<_>>().join(" ");
    let vti = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"0 4 0 3 0 2\" \
         Origin=\"10 -20 30.5\" Spacing=\"0.5 1.25 3\" Direction=\"{direction}\">\
         <Piece Extent=\"0 4 0 3 0 2\"><PointData Scalars=\"s\"><DataArray type=\"Int16\" \
         Name=\"other\" format=\"ascii\"/><DataArray type=\"Int16\" Name=\"s\" format=\"ascii\">{}\
         </DataArray></PointData></Piece></ImageData></VTKFile>",
        words.join(" ")
    );
    check(&decode(vti.as_bytes(), ImageFormat::VTI).unwrap(), KEPT, "VTI");
}

#[test]
fn values_in_vtk_cells_sit_in_their_middles() {
    let file = |extent: &str, data: &str, words: &str| {
        format!(
            "<VTKFile type=\"ImageData\"><ImageData WholeExtent=\"{extent}\" Origin=\"10 20 30\" \
             Spacing=\"2 4 8\"><Piece Extent=\"{extent}\"><{data}><DataArray type=\"UInt8\" \
             Name=\"a\">{words}</DataArray></{data}></Piece></ImageData></VTKFile>"
        )
    };
    let cells = file("1 3 0 2 5 6", "CellData", "1 2 3 4");
    let cells = decode(cells.as_bytes(), ImageFormat::VTI).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cells.vti");
    fs::write(&path, file("1 3 0 2 5 6", "CellData", "1 2 3 4")).unwrap();
    let loaded = load_image(&path, &ReadOptions::default(), &mut Silent).unwrap();
    assert_eq!(loaded.notes, [ReadNote::LevelSlice { z: 74.0 }, ReadNote::Cells]);
    // one layer of cells between two of points: a flat image
    assert_eq!((cells.shape(), cells.origin()), (vec![2, 2], vec![13.0, 22.0]));
    let points = file("1 2 0 1 5 5", "PointData", "1 2 3 4");
    let points = decode(points.as_bytes(), ImageFormat::VTI).unwrap();
    assert_eq!((points.shape(), points.origin()), (vec![2, 2], vec![12.0, 20.0]));
    assert_eq!(*points.samples(), Samples::U8(vec![1, 2, 3, 4].into()));
}

#[test]
fn samples_in_other_files_are_found_beside_the_header() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
    file("all.raw", &bytes());
    file("late.raw", &[b"two\nlines\n..", &bytes()[..]].concat());
    for k in 0..3 {
        file(&format!("z{k:02}.raw"), &bytes()[40 * k..40 * (k + 1)]);
    }
    let header = nrrd_header("LPS", KEPT, "raw");
    for (name, end) in [
        ("a.nhdr", "data file: all.raw\n"),
        ("b.nhdr", "datafile: late.raw\nline skip: 2\nbyte skip: 2\n"),
        ("c.nhdr", "data file: late.raw\nbyte skip: -1\n"),
        ("d.nhdr", "data file: z%02d.raw 0 2 1\n"),
        ("e.nhdr", "data file: LIST\nz00.raw\nz01.raw\nz02.raw\n"),
        ("f.nhdr", "data file: ./all.raw\n\nthese bytes are not looked at"),
    ] {
        file(name, format!("{header}{end}").as_bytes());
        check(&read(&folder.path().join(name)).unwrap(), TURNED, name);
    }
    let header = meta_header("AnatomicalOrientation = RAI\n");
    for (name, end) in [
        ("a.mhd", "ElementDataFile = all.raw\n"),
        ("b.mhd", "HeaderSize = -1\nElementDataFile = late.raw"),
        ("c.mhd", "HeaderSize = 12\nElementDataFile = late.raw"),
        ("d.mhd", "ElementDataFile = z%02d.raw 0 2 1\n"),
        ("e.mhd", "ElementDataFile = LIST\nz00.raw\nz01.raw\nz02.raw\n"),
    ] {
        file(name, format!("{header}{end}").as_bytes());
        check(&read(&folder.path().join(name)).unwrap(), TURNED, name);
    }

    file("g.mhd", format!("{header}ElementDataFile = none.raw\n").as_bytes());
    let error = read(&folder.path().join("g.mhd")).unwrap_err();
    assert!(matches!(error.reason, ReadReason::DataFile { .. }), "{error}");
    assert!(error.to_string().contains("none.raw"), "{error}");
    file("h.mhd", format!("{header}ElementDataFile = z01.raw\n").as_bytes());
    let error = read(&folder.path().join("h.mhd")).unwrap_err();
    assert!(error.to_string().contains("20 of 60"), "{error}");
    let alone =
        message(format!("{header}ElementDataFile = all.raw\n").as_bytes(), ImageFormat::META_IMAGE);
    assert!(alone.contains("all.raw"), "{alone}");
}

/// Bytes packed by gzip or zlib.
fn packed(bytes: &[u8], is_zlib: bool) -> Vec<u8> {
    let level = flate2::Compression::default();
    if is_zlib {
        let mut out = flate2::write::ZlibEncoder::new(Vec::new(), level);
        out.write_all(bytes).unwrap();
        return out.finish().unwrap();
    }
    let mut out = flate2::write::GzEncoder::new(Vec::new(), level);
    out.write_all(bytes).unwrap();
    out.finish().unwrap()
}

#[test]
fn packed_samples_are_held_to_what_the_header_promises() {
    let files = |shape: &str, samples: &[u8]| {
        let nrrd = nrrd_header("LPS", KEPT, "gzip").replace("5 4 3", shape);
        let meta = meta_header("AnatomicalOrientation = RAI\nCompressedData = True\n");
        let meta = meta.replace("5 4 3", shape) + "ElementDataFile = LOCAL\n";
        let nrrd = [nrrd.as_bytes(), b"\n", &packed(samples, false)].concat();
        let meta = [meta.as_bytes(), &packed(samples, true)].concat();
        [(nrrd, ImageFormat::NRRD), (meta, ImageFormat::META_IMAGE)]
    };
    // what stands behind the samples is not unpacked
    let bomb = [bytes(), vec![0; 1 << 24]].concat();
    for (file, format) in files("5 4 3", &bytes()).into_iter().chain(files("5 4 3", &bomb)) {
        check(&decode(&file, format).unwrap(), TURNED, "packed");
    }
    for (file, format) in files("5 4 3", &bytes()[..100]) {
        assert!(message(&file, format).contains("50 of 60"), "{}", message(&file, format));
    }
    for (file, format) in files("5000 4000 3000", &bytes()) {
        assert!(
            message(&file, format).contains("more than a file of"),
            "{}",
            message(&file, format)
        );
    }
    for (mut file, format) in files("5 4 3", &bytes()) {
        let sum = file.len() - if format == ImageFormat::NRRD { 8 } else { 4 };
        file[sum] ^= 1;
        assert!(decode(&file, format).is_err(), "{format}: a wrong check sum");
    }
}

#[test]
fn what_an_nrrd_header_may_not_say_is_named() {
    let whole = String::from_utf8_lossy(&nrrd_header("LPS", KEPT, "raw").into_bytes()).into_owned();
    let with = |from: &str, to: &str| {
        assert!(whole.contains(from), "{from}");
        let header = whole.replace(from, to);
        message(&[header.as_bytes(), b"\n", &bytes()[..]].concat(), ImageFormat::NRRD)
    };
    for (from, to, part) in [
        ("kinds: domain", "kinds: RGB-color", "5 values of kind \"rgb-color\""),
        ("encoding: raw", "encoding: zrl", "zrl"),
        ("encoding: raw", "encoding: weird", "encoding is weird"),
        ("type: short", "type: block", "type is block"),
        ("dimension: 3", "dimension: 4", "sizes is 5 4 3"),
        ("dimension: 3", "dimension: 0", "dimension is 0"),
        ("sizes: 5 4 3", "sizes: 5 0 3", "sizes is 5 0 3"),
        ("sizes: 5 4 3", "sizes: 500 400 300", "more than a file of"),
        ("sizes: 5 4 3", "sizes: 5 4 6", "60 of 120"),
        ("sizes: 5 4 3", "sizes: 4294967296 4294967296 4294967296", "too many to address"),
        ("endian: little\n", "", "endian is missing"),
        ("endian: little", "endian: middle", "endian is middle"),
        ("space: LPS", "space: left-posterior-superior-time", "without time"),
        ("space: LPS", "space: sideways", "space is sideways"),
        ("space origin: (10,", "space origin: (NaN,", "origin NaN"),
        ("space origin: (10,", "space origin: (", "space origin is"),
        ("space directions: (", "space directions: ", "space directions is"),
        ("space directions: (0.4,", "space directions: (9,", "meet at"),
        ("key:=value", "no field", "line is no field"),
    ] {
        let text = with(from, to);
        assert!(text.contains(part), "{to}: {text} lacks {part}");
    }
}

#[test]
fn what_a_meta_header_may_not_say_is_named() {
    let whole = String::from_utf8_lossy(&meta("")).into_owned();
    let start = whole.find("LOCAL\n").unwrap() + 6;
    let with = |from: &str, to: &str| {
        assert!(whole[..start].contains(from), "{from}");
        let header = whole[..start].replace(from, to);
        message(&[header.as_bytes(), &bytes()[..]].concat(), ImageFormat::META_IMAGE)
    };
    for (from, to, part) in [
        ("ObjectType = Image", "ObjectType = Tube", "Tube"),
        ("NDims = 3", "NDims = three", "NDims is three"),
        ("DimSize = 5 4 3", "DimSize = 5 4", "DimSize is 5 4"),
        ("DimSize = 5 4 3", "DimSize = 5 4 9", "60 of 180"),
        ("MET_SHORT", "MET_SHORT_ARRAY", "MET_SHORT_ARRAY"),
        ("MET_SHORT", "MET_SHORT\nElementNumberOfChannels = 3", "3 channels"),
        ("Offset = 10", "Offset = ten", "Offset is ten"),
        ("ElementSpacing = 0.5", "ElementSpacing = 0", "affine column x"),
        ("TransformMatrix = 0.8", "TransformMatrix = 3", "meet at"),
        ("ElementDataFile = LOCAL", "Comment = none", "ElementDataFile is missing"),
        ("ElementDataFile = LOCAL", "ElementDataFile = a%d 3 1", "a pattern"),
        ("NDims = 3", "three dimensions", "an entry is missing in line 2"),
        ("BinaryData = True", "CompressedData = True", "corrupt"),
    ] {
        let text = with(from, to);
        assert!(text.contains(part), "{to}: {text} lacks {part}");
    }
}

#[test]
fn slices_that_are_not_one_volume_are_named() {
    let (error, text) = series_error(|k, slice| {
        if k == 1 {
            slice.series = "1.2.3.5";
        }
    });
    assert!(matches!(error, SeriesError::SeveralSeries { .. }));
    assert!(text.contains("1.2.3.4 (2 files") && text.contains("1.2.3.5 (1 files, such as b.17)"));

    let (error, text) = series_error(|k, slice| {
        if k == 2 {
            slice.position = lps([0, 0, 3]);
        }
    });
    assert!(matches!(error, SeriesError::Gap { gap: 6.0, expected: 3.0, .. }), "{error:?}");
    assert!(text.contains("b.17 and a.dcm are 6 apart") && text.contains("a slice is missing"));

    let (error, text) = series_error(|k, slice| {
        if k == 2 {
            slice.position = lps([0, 0, 1]);
        }
    });
    assert!(matches!(error, SeriesError::Duplicate { .. }), "{error:?}");
    assert!(text.contains("a.dcm and b.17"), "{text}");

    let (error, _) = series_error(|k, slice| {
        if k == 2 {
            slice.position[1] += 0.6;
        }
    });
    assert!(matches!(error, SeriesError::Gap { .. }), "{error:?}");

    let (_, text) = series_error(|k, slice| {
        if k == 0 {
            slice.shape = [4, 5];
        }
    });
    assert!(text.contains("c has the shape 4 × 5; expected 5 × 4, as a.dcm has"), "{text}");
    let (_, text) = series_error(|k, slice| {
        if k == 1 {
            slice.axes.swap(0, 1);
        }
    });
    assert!(text.contains("b.17 has the orientation"), "{text}");

    // steeper than a tilted gantry
    let leaning = series(|k, slice| slice.position[2] += 4.0 * k as f64);
    let error = read(leaning.path()).unwrap_err();
    assert!(matches!(error.reason, ReadReason::Sheared { first: 1, second: 2, .. }), "{error}");
}

#[test]
fn slices_that_cannot_be_read_are_named() {
    for (change, part) in [
        ((|s| s.frames = "12") as fn(&mut Slice), "20 of 240 samples"),
        (|s| s.photometric = "RGB", "RGB samples"),
        (|s| s.syntax = "1.2.840.10008.1.2.4.70", "packed otherwise"),
        (|s| s.syntax = "1.2.840.10008.1.2.1.99", "deflate"),
        (|s| s.samples.truncate(20), "10 of 20 samples"),
        (|s| s.position[0] = f64::NAN, "image position (patient) is NaN"),
    ] {
        let error = read(
            series(|k, slice| {
                if k == 1 {
                    change(slice)
                }
            })
            .path(),
        )
        .unwrap_err();
        let text = error.to_string();
        assert!(text.contains("b.17: ") && text.contains(part), "{text} lacks {part}");
    }
}

#[test]
fn stored_values_are_rescaled_and_white_is_turned_to_black() {
    let rescaled = series(|_, slice| slice.scale = Some(("-1024", "2")));
    let expected = values().iter().map(|&v| 2.0 * f32::from(v) - 1024.0).collect();
    assert_eq!(*read(rescaled.path()).unwrap().samples(), Samples::F32(expected));
    let inverted = series(|_, slice| slice.photometric = "MONOCHROME1");
    let expected = values().iter().map(|&v| -1 - v).collect();
    assert_eq!(*read(inverted.path()).unwrap().samples(), Samples::I16(expected));
}

#[test]
fn a_single_slice_is_flat_and_keeps_its_place_if_that_is_flat_too() {
    let mut slice = Slice::of(0);
    let upright = decode(&slice.bytes(), ImageFormat::DICOM).unwrap();
    assert_eq!((upright.shape(), upright.spacing()), (vec![5, 4], vec![0.5, 1.25]));
    assert_eq!((upright.origin(), upright.direction()[0][0]), (vec![0.0, 0.0], 1.0));
    slice.axes = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]];
    let across = decode(&slice.bytes(), ImageFormat::DICOM).unwrap();
    assert_eq!(across.origin(), [-10.0, 20.0]);
    assert_eq!(across.direction(), [[0.0, 1.0], [-1.0, 0.0]]);
    // under any name, and alone in a folder
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("IM0001");
    fs::write(&path, slice.bytes()).unwrap();
    for path in [path.as_path(), folder.path()] {
        let image = read(path).unwrap();
        assert_eq!((image.shape(), image.origin()), (vec![5, 4], vec![-10.0, 20.0]));
    }
}

#[test]
fn files_of_other_programs_are_read_as_they_read_them() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let near = |image: &AnyImage, spacing: [f64; 3], origin: [f64; 3], x: [f64; 3], name: &str| {
        let first: Vec<_> = image.direction().iter().map(|row| row[0]).collect();
        for (found, expected) in [(image.spacing(), spacing), (image.origin(), origin), (first, x)]
        {
            // all numbers are stated with a few digits
            let error = found.iter().zip(expected).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
            assert!(error < 1e-12, "{name}: {found:?}, not {expected:?}");
        }
    };
    for (name, sign) in [
        ("itk-zlib.mha", -1.0),
        ("itk-gzip.nrrd", -1.0),
        ("vtk-inline-zlib.vti", 1.0),
        ("vtk-appended-base64-zlib.vti", 1.0),
    ] {
        let image = read(&data.join(name)).unwrap();
        let (origin, x) = ([10.0 * sign, 20.0 * sign, 30.0], [0.8 * sign, 0.6 * sign, 0.0]);
        near(&image, [0.5, 2.25, 4.1], origin, x, name);
        assert_eq!(*image.samples(), Samples::I16((0..24).collect()), "{name}");
    }
    let stored = |k: i16| 100 * (k / 15) + k % 15 - 50;
    for (name, samples) in [
        ("pydicom-run-length", Samples::I16((0..60).map(stored).collect())),
        (
            "pydicom-big-endian",
            Samples::F32((0..60).map(|k| f32::from(2 * stored(k) - 1024)).collect()),
        ),
    ] {
        let image = read(&data.join(name)).unwrap();
        near(&image, [0.4, 0.7, 2.5], [-10.0, -20.0, 30.0], [-0.8, -0.6, 0.0], name);
        assert_eq!(*image.samples(), samples, "{name}");
    }
}

/// A whole file of each kind.
fn whole(which: usize) -> (Vec<u8>, ImageFormat) {
    match which {
        0 => (nrrd("LPS", KEPT), ImageFormat::NRRD),
        1 => (meta("AnatomicalOrientation = RAI\n"), ImageFormat::META_IMAGE),
        _ => (Slice::of(1).bytes(), ImageFormat::DICOM),
    }
}

#[test]
fn cut_scans_are_refused_wherever_they_end() {
    for which in 0..3 {
        let (bytes, format) = whole(which);
        assert!(decode(&bytes, format).is_ok());
        for length in 0..bytes.len() {
            assert!(decode(&bytes[..length], format).is_err(), "{format} cut to {length}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Whole files with a few bytes changed, nearly all in the header, and cut: an image or an error, no panic.
    #[test]
    fn damaged_scans_end_in_an_image_or_an_error(
        which in 0..3usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        length in any::<prop::sample::Index>(),
        cut in prop::bool::weighted(0.2),
    ) {
        let (mut bytes, format) = whole(which);
        for (place, value) in changes {
            // DICOM has 132 bytes that say nothing first
            let start = if which == 2 { 132 } else { 7 };
            let at = start + place.index(bytes.len() - start);
            // digits for digits, so that most headers stay readable
            bytes[at] = if bytes[at].is_ascii_digit() { b'0' + value % 10 } else { value };
        }
        if cut {
            bytes.truncate(length.index(bytes.len()));
        }
        let _ = decode(&bytes, format);
    }

    /// Text that begins like a header and goes on anyhow.
    #[test]
    fn any_header_ends_in_an_image_or_an_error(
        nrrd in r"NRRD0004\n(((type|dimension|sizes|space|space directions|encoding|endian|space origin|data file|kinds|byte skip|line skip|axis mins|spacings): ?(uchar|double|2|3|raw|gzip|ascii|little|LIST|none|-?[0-9]{1,20}|\(-?[0-9],?[0-9]?\)| ){0,3})\n){0,9}\n?.{0,40}",
        meta in r"((NDims|DimSize|ElementType|ElementSpacing|HeaderSize|TransformMatrix|CompressedData|BinaryData) = ?(MET_UCHAR|MET_DOUBLE|True|False|-?[0-9]{1,20}| ){0,4}\n){0,9}(ElementDataFile = (LOCAL|LIST|%d 1 9|x))?\n.{0,40}",
    ) {
        let _ = decode(nrrd.as_bytes(), ImageFormat::NRRD);
        let _ = decode(meta.as_bytes(), ImageFormat::META_IMAGE);
    }
}

#[test]
fn what_the_caller_gives_need_not_be_in_the_slices() {
    let load = |folder: &Path, given: GivenFrame| {
        load_image(folder, &ReadOptions { given, ..ReadOptions::default() }, &mut Silent)
    };
    let nothing = GivenFrame::default();
    let spacing = GivenFrame { spacing: true, ..nothing };
    let unspaced = series(|_, slice| slice.has.spacing = false);
    let text = load(unspaced.path(), nothing).unwrap_err().to_string();
    assert!(text.contains("no pixel spacing"), "{text}");
    let loaded = load(unspaced.path(), spacing).unwrap();
    assert_eq!(*loaded.image.samples(), Samples::I16(values().into()));
    assert!(loaded.units.is_empty(), "the caller's unit is not known");

    // files are named against their order, and numbered in it
    let unplaced = series(|k, slice| {
        slice.has = Said { position: false, axes: false, spacing: true };
        slice.instance = ["1", "2", "10"][k];
    });
    let text = load(unplaced.path(), nothing).unwrap_err().to_string();
    assert!(text.contains("no image position"), "{text}");
    let loaded = load(unplaced.path(), spacing).unwrap();
    assert_eq!(*loaded.image.samples(), Samples::I16(values().into()));
    let note = ReadNote::ByNumber { numbers: "instance numbers" };
    assert!(loaded.notes.contains(&note) && note.is_warning(), "{:?}", loaded.notes);
    let twice = series(|k, slice| {
        slice.has.position = false;
        slice.instance = ["1", "2", "2"][k];
    });
    let text = load(twice.path(), spacing).unwrap_err().to_string();
    assert!(text.contains("both instance 2"), "{text}");

    let unturned = series(|_, slice| slice.has.axes = false);
    assert!(load(unturned.path(), spacing).is_err());
    let both = GivenFrame { direction: true, ..spacing };
    assert_eq!(
        *load(unturned.path(), both).unwrap().image.samples(),
        Samples::I16(values().into())
    );
}

#[test]
fn the_spacing_of_a_radiograph_is_that_at_the_detector() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("film.dcm");
    let load = |change: &dyn Fn(&mut Slice)| {
        let mut slice = Slice::of(0);
        slice.has = Said { position: false, axes: false, spacing: false };
        change(&mut slice);
        fs::write(&path, slice.bytes()).unwrap();
        load_image(&path, &ReadOptions::default(), &mut Silent).unwrap()
    };
    let film = load(&|slice| slice.imager_spacing = "0.2\\0.1");
    assert_eq!((film.image.spacing(), film.units[0].as_str()), (vec![0.1, 0.2], "mm"));
    let note = ReadNote::AtDetector { spacing: [0.1, 0.2] };
    assert!(film.notes.contains(&note), "{:?}", film.notes);
    // the patient's goes before the detector's
    let calibrated = load(&|slice| {
        slice.imager_spacing = "0.2\\0.1";
        slice.has.spacing = true;
    });
    assert_eq!(calibrated.image.spacing(), [SPACING[0], SPACING[1]]);
    let unknown = load(&|_| {});
    assert_eq!((unknown.image.spacing(), unknown.units.len()), (vec![1.0; 2], 0));
    assert!(unknown.notes.contains(&ReadNote::NoSpacing) && ReadNote::NoSpacing.is_warning());
}

#[test]
fn axes_that_are_sheared_are_read_where_the_caller_gives_others() {
    let header = nrrd_header("RAS", KEPT, "raw").replace("(0,0,-1.25)", "(0.5,0,-1.25)");
    let bytes = [header.as_bytes(), b"\n", &bytes()].concat();
    let error = decode(&bytes, ImageFormat::NRRD).unwrap_err();
    assert!(matches!(error, ReadReason::Sheared { .. }), "{error}");
    let given = GivenFrame { direction: true, ..GivenFrame::default() };
    let options = ReadOptions { given, ..ReadOptions::default() };
    let image = decode_image(&bytes, ImageFormat::NRRD, &options, &mut Silent).unwrap();
    assert_eq!(*image.samples(), Samples::I16(values().into()));
}
