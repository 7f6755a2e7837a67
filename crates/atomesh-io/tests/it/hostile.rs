//! Files that ask for more than they should, of the disk or of memory, are refused before they get it.

use std::fs;
use std::io::Write;
use std::path::Path;

use atomesh::image::{Frame, Image, Samples};
use atomesh::watch::Silent;
use atomesh_io::image::{AnyImage, ReadError, ReadOptions, ReadReason, read_image, write_image};

fn read(path: &Path, options: &ReadOptions) -> Result<AnyImage, ReadError> {
    read_image(path, options, &mut Silent)
}

fn plain(path: &Path) -> Result<AnyImage, ReadError> {
    read(path, &ReadOptions::default())
}

/// Headers, by their file names, of 2 × 2 × 2 bytes in another file.
fn headers(data: &str) -> [(&'static str, String); 4] {
    let nrrd = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\n";
    let meta = "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\n";
    let rsf = "n1=2 n2=2 n3=2 esize=1 data_format=native_uchar";
    [
        ("a.nhdr", format!("{nrrd}encoding: raw\ndata file: {data}\n")),
        ("b.nhdr", format!("{nrrd}encoding: ascii\ndata file: {data}\n")),
        ("c.mhd", format!("{meta}ElementDataFile = {data}\n")),
        ("d.rsf", format!("{rsf} in=\"{data}\"\n")),
    ]
}

/// A folder with a file beside the folder `scan`.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("scan")).unwrap();
    fs::write(folder.path().join("secret"), "1 2 3 4 5 6 7 8 password").unwrap();
    folder
}

#[test]
fn headers_reach_no_file_elsewhere_unless_it_is_allowed() {
    let folder = folder();
    let secret = folder.path().join("secret");
    for data in ["../secret", secret.to_str().unwrap()] {
        for (name, text) in headers(data) {
            let path = folder.path().join("scan").join(name);
            fs::write(&path, text).unwrap();
            let error = plain(&path).unwrap_err();
            assert!(matches!(error.reason, ReadReason::DataOutside { .. }), "{name}: {error}");
            assert!(error.to_string().contains(data), "{error}");
            let data_root = Some(folder.path().into());
            let allowed = read(&path, &ReadOptions { data_root, ..ReadOptions::default() });
            assert_eq!(allowed.unwrap().shape(), [2, 2, 2], "{name}");
        }
    }
}

#[test]
fn messages_do_not_quote_files_of_samples_or_what_may_be_no_header() {
    let folder = folder();
    let scan = folder.path().join("scan");
    fs::write(scan.join("text"), "root:x:0 hidden").unwrap();
    for (name, text) in headers("text") {
        fs::write(scan.join(name), text).unwrap();
        if let Err(error) = plain(&scan.join(name)) {
            let text = error.to_string();
            assert!(!text.contains("root") && !text.contains("hidden"), "{text}");
        }
    }
    let ascii = "n1=2 n2=2 data_format=ascii_float in=text";
    fs::write(scan.join("e.rsf"), ascii).unwrap();
    let mut names: Vec<_> = vec!["e.rsf".to_owned()];
    for ending in [
        "png", "nhdr", "mhd", "rsf", "vti", "npy", "nii", "pgm", "tif", "segy", "jpg", "hdr",
        "img", "mgh", "mgz", "npz", "vtk", "su",
    ] {
        fs::write(scan.join(format!("f.{ending}")), "root:x:0:hidden\nroot = hidden\n").unwrap();
        names.push(format!("f.{ending}"));
    }
    for name in names {
        let text = plain(&scan.join(&name)).unwrap_err().to_string();
        let bytes = text.contains("72, 6f, 6f, 74");
        assert!(!text.contains("root") && !text.contains("hidden") && !bytes, "{text}");
    }
}

#[cfg(unix)]
#[test]
fn pipes_are_refused_and_not_waited_for() {
    let folder = folder();
    let scan = folder.path().join("scan");
    let pipe = scan.join("pipe.png");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.is_ok_and(|status| status.success()));
    for (name, text) in headers("pipe.png") {
        fs::write(scan.join(name), text).unwrap();
        let error = plain(&scan.join(name)).unwrap_err();
        assert!(error.to_string().contains("not a plain file"), "{error}");
    }
    assert!(plain(&pipe).unwrap_err().to_string().contains("not a plain file"));
}

#[test]
fn a_file_is_a_part_of_an_image_once() {
    let folder = folder();
    let scan = folder.path().join("scan");
    fs::write(scan.join("s"), [0; 4]).unwrap();
    for (name, text) in headers("LIST\ns\ns").into_iter().take(3) {
        fs::write(scan.join(name), text).unwrap();
        let error = plain(&scan.join(name)).unwrap_err();
        assert!(matches!(error.reason, ReadReason::DataTwice { times: 2, .. }), "{error}");
    }
}

#[test]
fn samples_are_not_read_into_more_memory_than_there_is() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let frame = Frame::new([32, 32, 4]).unwrap();
    let volume = Image::new(frame, Samples::U16(vec![7; 4096].into())).unwrap();
    for name in ["v.npy", "v.nii", "v.nii.gz", "v.nrrd", "v.vti", "v.tif"] {
        write_image(&at(name), &volume, &mut Silent).unwrap();
    }
    let flat =
        Image::new(Frame::new([128, 64]).unwrap(), Samples::U8(vec![7; 8192].into())).unwrap();
    write_image(&at("f.png"), &flat, &mut Silent).unwrap();
    let head = b"P5 128 64 255\n".to_vec();
    fs::write(at("f.pgm"), [head, vec![7; 8192]].concat()).unwrap();
    fs::write(at("f.pbm"), [b"P4 128 64\n".to_vec(), vec![7; 1024]].concat()).unwrap();
    let text = "n1=128 n2=64 data_format=native_uchar esize=1 in=\"f.raw\"";
    fs::write(at("f.rsf"), text).unwrap();
    fs::write(at("f.raw"), vec![7; 8192]).unwrap();
    let meta = "NDims = 2\nDimSize = 128 64\nElementType = MET_UCHAR\nElementDataFile = f.raw\n";
    fs::write(at("f.mhd"), meta).unwrap();
    let bytes: Vec<u8> = [7, 0].repeat(4096);
    let words = [1, 32, 32, 4, 1, 4, 0].map(i32::to_be_bytes);
    let head = [words.as_flattened(), &[0; 256]].concat();
    fs::write(at("v.mgh"), [&head[..], &bytes].concat()).unwrap();
    let head =
        b"# vtk DataFile Version 3.0\n\nBINARY\nDATASET STRUCTURED_POINTS\nDIMENSIONS 32 32 4\n\
                 POINT_DATA 4096\nSCALARS a short\nLOOKUP_TABLE default\n";
    fs::write(at("v.vtk"), [&head[..], &bytes].concat()).unwrap();
    let mut zip = zip::ZipWriter::new(fs::File::create(at("v.npz")).unwrap());
    zip.start_file("a.npy", zip::write::SimpleFileOptions::default()).unwrap();
    zip.write_all(&fs::read(at("v.npy")).unwrap()).unwrap();
    zip.finish().unwrap();
    fs::create_dir(at("stack")).unwrap();
    for name in ["stack/1.png", "stack/2.png"] {
        fs::copy(at("f.png"), at(name)).unwrap();
    }
    for name in [
        "v.npy", "v.nii", "v.nii.gz", "v.nrrd", "v.vti", "v.tif", "f.png", "f.pgm", "f.pbm",
        "f.rsf", "f.mhd", "v.mgh", "v.vtk", "v.npz",
    ] {
        let limited = |bytes| {
            let options = ReadOptions { memory_limit: Some(bytes), ..ReadOptions::default() };
            read(&at(name), &options)
        };
        let error = limited(8191).unwrap_err();
        assert!(matches!(error.reason, ReadReason::Memory { .. }), "{name}: {error}");
        assert!(error.to_string().contains("of which 8191 are left"), "{error}");
        assert_eq!(limited(1 << 20).unwrap().samples().len() % 4096, 0, "{name}");
    }
    // a limit that each slice keeps, and not both
    let options = ReadOptions { memory_limit: Some(16_383), ..ReadOptions::default() };
    let error = read(&at("stack"), &options).unwrap_err();
    assert!(matches!(error.reason, ReadReason::Memory { bytes: 16_384, .. }), "{error}");
}

/// A chunk of a PNG.
fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let mut sum = flate2::Crc::new();
    sum.update(kind);
    sum.update(data);
    let length = (data.len() as u32).to_be_bytes();
    [&length[..], kind, data, &sum.sum().to_be_bytes()].concat()
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut packed = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    packed.write_all(bytes).unwrap();
    packed.finish().unwrap()
}

#[test]
fn profiles_and_texts_that_unpack_to_much_are_not_unpacked() {
    // 64 MiB of nothing, more than the image may take
    let packed = zlib(&vec![0; 64 << 20]);
    let bomb = |head: &[u8]| [head, &packed].concat();
    let file = [
        b"\x89PNG\r\n\x1a\n".to_vec(),
        chunk(b"IHDR", &[0, 0, 0, 8, 0, 0, 0, 8, 8, 0, 0, 0, 0]),
        chunk(b"iCCP", &bomb(b"a\0\0")),
        chunk(b"zTXt", &bomb(b"a\0\0")),
        chunk(b"IDAT", &zlib(&[0; 72])),
        chunk(b"IEND", &[]),
    ]
    .concat();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bomb.png");
    fs::write(&path, file).unwrap();
    let options = ReadOptions { memory_limit: Some(1 << 20), ..ReadOptions::default() };
    assert_eq!(read(&path, &options).unwrap().shape(), [8, 8]);
}
