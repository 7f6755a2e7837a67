//! How formats spell the types of samples.

use atomesh::image::Samples;

use super::sample_type::SampleType;

/// A type with its names in each format, the one that is written first; empty where a format has none.
pub(super) struct Spelling {
    pub sample_type: SampleType,
    pub npy: &'static [&'static str],
    pub nrrd: &'static [&'static str],
    pub meta_image: &'static [&'static str],
    pub vtk: &'static [&'static str],
    pub rsf: &'static [&'static str],
    /// NIfTI's code; 0 for none.
    pub nifti: i16,
}

/// MetaImage's long has 4 bytes, whatever a machine's long has. DICOM and SEG-Y have numbers of bits and
/// codes with other meanings, and so tables of their own.
const SPELLINGS: [Spelling; 12] = [
    Spelling { npy: &["b1", "?"], ..Spelling::of(SampleType::Bool) },
    Spelling {
        npy: &["u1"],
        nrrd: &["uint8", "uint8_t", "uchar", "unsigned char"],
        meta_image: &["MET_UCHAR", "MET_ASCII_CHAR"],
        vtk: &["UInt8"],
        rsf: &["uchar", "byte"],
        nifti: 2,
        ..Spelling::of(SampleType::U8)
    },
    Spelling {
        npy: &["i1"],
        nrrd: &["int8", "int8_t", "signed char"],
        meta_image: &["MET_CHAR"],
        vtk: &["Int8"],
        nifti: 256,
        ..Spelling::of(SampleType::I8)
    },
    Spelling {
        npy: &["u2"],
        nrrd: &["uint16", "uint16_t", "ushort", "unsigned short", "unsigned short int"],
        meta_image: &["MET_USHORT"],
        vtk: &["UInt16"],
        nifti: 512,
        ..Spelling::of(SampleType::U16)
    },
    Spelling {
        npy: &["i2"],
        nrrd: &["int16", "int16_t", "short", "short int", "signed short", "signed short int"],
        meta_image: &["MET_SHORT"],
        vtk: &["Int16"],
        rsf: &["short"],
        nifti: 4,
        ..Spelling::of(SampleType::I16)
    },
    Spelling {
        npy: &["u4"],
        nrrd: &["uint32", "uint32_t", "uint", "unsigned int"],
        meta_image: &["MET_UINT", "MET_ULONG"],
        vtk: &["UInt32"],
        nifti: 768,
        ..Spelling::of(SampleType::U32)
    },
    Spelling {
        npy: &["i4"],
        nrrd: &["int32", "int32_t", "int", "signed int"],
        meta_image: &["MET_INT", "MET_LONG"],
        vtk: &["Int32"],
        rsf: &["int"],
        nifti: 8,
        ..Spelling::of(SampleType::I32)
    },
    Spelling {
        npy: &["u8"],
        nrrd: &["uint64", "uint64_t", "ulonglong", "unsigned long long", "unsigned long long int"],
        meta_image: &["MET_ULONG_LONG"],
        vtk: &["UInt64"],
        nifti: 1280,
        ..Spelling::of(SampleType::U64)
    },
    Spelling {
        npy: &["i8"],
        nrrd: &[
            "int64",
            "int64_t",
            "longlong",
            "long long",
            "long long int",
            "signed long long",
            "signed long long int",
        ],
        meta_image: &["MET_LONG_LONG"],
        vtk: &["Int64"],
        nifti: 1024,
        ..Spelling::of(SampleType::I64)
    },
    Spelling { npy: &["f2"], ..Spelling::of(SampleType::F16) },
    Spelling {
        npy: &["f4"],
        nrrd: &["float"],
        meta_image: &["MET_FLOAT"],
        vtk: &["Float32"],
        rsf: &["float"],
        nifti: 16,
        ..Spelling::of(SampleType::F32)
    },
    Spelling {
        npy: &["f8"],
        nrrd: &["double"],
        meta_image: &["MET_DOUBLE"],
        vtk: &["Float64"],
        rsf: &["double"],
        nifti: 64,
        ..Spelling::of(SampleType::F64)
    },
];

impl Spelling {
    const fn of(sample_type: SampleType) -> Self {
        Self { sample_type, npy: &[], nrrd: &[], meta_image: &[], vtk: &[], rsf: &[], nifti: 0 }
    }

    /// The spellings of the type in which samples are held; none for a type that is not known here.
    pub fn of_samples(samples: &Samples) -> Option<&'static Self> {
        let sample_type: SampleType = samples.type_name().parse().ok()?;
        SPELLINGS.iter().find(|own| own.sample_type == sample_type)
    }
}

/// The type that a name stands for among those of a format, as in `named(word, |s| s.nrrd)`.
pub(super) fn named(
    name: &str,
    names: fn(&Spelling) -> &'static [&'static str],
) -> Option<SampleType> {
    SPELLINGS.iter().find(|own| names(own).contains(&name)).map(|own| own.sample_type)
}

/// The type that NIfTI's code stands for.
pub(super) fn of_nifti(code: i16) -> Option<SampleType> {
    SPELLINGS.iter().find(|own| own.nifti != 0 && own.nifti == code).map(|own| own.sample_type)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_is_spelled_once_and_names_are_of_one_type() {
        let types: Vec<_> = SPELLINGS.iter().map(|own| own.sample_type).collect();
        assert_eq!(types, SampleType::ALL);
        for names in [
            |s: &Spelling| s.npy,
            |s: &Spelling| s.nrrd,
            |s: &Spelling| s.meta_image,
            |s: &Spelling| s.vtk,
            |s: &Spelling| s.rsf,
        ] {
            for own in &SPELLINGS {
                for name in names(own) {
                    assert_eq!(named(name, names), Some(own.sample_type), "{name}");
                }
            }
        }
        assert_eq!(named("", |s| s.nrrd), None);
        assert_eq!(of_nifti(0), None);
    }

    #[test]
    fn types_of_samples_are_found() {
        let spelling = Spelling::of_samples(&Samples::I16(vec![1].into())).unwrap();
        assert_eq!((spelling.nrrd[0], spelling.vtk[0], spelling.nifti), ("int16", "Int16", 4));
    }
}
