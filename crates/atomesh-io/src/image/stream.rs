//! Numbers in a file to samples in memory and back, a block at a time.
//!
//! Only one vector is ever as large as the image: bytes pass through a buffer of a block. Beyond what its
//! caller allows, a vector grows only as bytes come, so that a false header costs no memory.

use std::io::{self, Read, Write};

use atomesh::image::Samples;
use atomesh::watch::{Phase, Watch, check};

use super::error::{ReadReason, WriteReason};
use super::format::ImageFormat;
use super::memory::Memory;
use super::sample_type::{ByteOrder, SampleType};

/// The most bytes that a byte of gzip or zlib can stand for.
pub(super) const GZIP_RATIO: u64 = 1032;

/// Samples that pass through the buffer at a time.
const BLOCK: usize = 1 << 16;

/// How the samples of an image lie in a stream of bytes.
pub(super) struct Layout {
    /// The type of the samples.
    pub sample_type: SampleType,
    /// The order of their bytes.
    pub byte_order: ByteOrder,
    /// How many samples there are.
    pub count: usize,
    /// The samples for which memory is allocated at once, before the first one has come.
    pub reserve: usize,
    /// Slope s and intercept t if a sample is s · value + t, in single precision.
    pub scale: Option<(f64, f64)>,
    /// The shape x, y, z of an image that comes with z fastest; it is turned to x fastest.
    pub turned: Option<[usize; 3]>,
    /// The memory that the samples may take.
    pub memory: Memory,
}

/// Reads the samples, exactly as many as the layout says.
pub(super) fn read_samples(reader: &mut dyn Read, layout: &Layout) -> Result<Samples, ReadReason> {
    /// Reads with one function for each type, in the kind in which the samples are to be held.
    macro_rules! read_as {
        ($kind:ident, $number:ident, $held:ident) => {
            match layout.scale {
                None => Samples::$kind(
                    collect(reader, layout, |b| $number::from_le_bytes(b) as $held)?.into(),
                ),
                Some((slope, intercept)) => Samples::F32(
                    collect(reader, layout, |b| {
                        ($number::from_le_bytes(b) as f64 * slope + intercept) as f32
                    })?
                    .into(),
                ),
            }
        };
    }
    Ok(match layout.sample_type {
        SampleType::Bool => Samples::U8(collect(reader, layout, |[b]| u8::from(b != 0))?.into()),
        SampleType::U8 => read_as!(U8, u8, u8),
        SampleType::I8 => read_as!(I8, i8, i8),
        SampleType::U16 => read_as!(U16, u16, u16),
        SampleType::I16 => read_as!(I16, i16, i16),
        SampleType::U32 => read_as!(U32, u32, u32),
        SampleType::I32 => read_as!(I32, i32, i32),
        SampleType::U64 => read_as!(F64, u64, f64),
        SampleType::I64 => read_as!(F64, i64, f64),
        SampleType::F16 => {
            Samples::F32(collect(reader, layout, |b| half_to_single(u16::from_le_bytes(b)))?.into())
        }
        SampleType::F32 => read_as!(F32, f32, f32),
        SampleType::F64 => read_as!(F64, f64, f64),
    })
}

/// The samples of the stream, each made of `N` bytes.
fn collect<const N: usize, T: Copy + Default>(
    reader: &mut dyn Read,
    layout: &Layout,
    decode: impl Fn([u8; N]) -> T,
) -> Result<Vec<T>, ReadReason> {
    let memory = layout.memory;
    memory.check(layout.count as u128 * size_of::<T>() as u128)?;
    let mut samples = Vec::new();
    memory.reserve(&mut samples, layout.reserve.min(layout.count))?;
    let mut places = layout.turned.map(turned_places);
    if places.is_some() {
        memory.reserve(&mut samples, layout.count)?;
        samples.resize(layout.count, T::default());
    }
    let mut buffer = vec![0; BLOCK.min(layout.count) * N];
    let mut done = 0;
    while done < layout.count {
        let wanted = BLOCK.min(layout.count - done);
        let bytes = &mut buffer[..wanted * N];
        let filled = fill(reader, bytes)?;
        if filled < bytes.len() {
            let found = (done + filled / N) as u64;
            return Err(ReadReason::Truncated { expected: layout.count as u64, found });
        }
        let (numbers, _) = bytes.as_chunks_mut::<N>();
        if layout.byte_order == ByteOrder::Big {
            numbers.iter_mut().for_each(|n| n.reverse());
        }
        if let Some(places) = &mut places {
            for (number, place) in numbers.iter().zip(places) {
                samples[place] = decode(*number);
            }
        } else {
            memory.grow(&mut samples, wanted, layout.count)?;
            samples.extend(numbers.iter().map(|&n| decode(n)));
        }
        done += wanted;
    }
    Ok(samples)
}

/// Where, x fastest, the samples belong that come z fastest.
fn turned_places([nx, ny, nz]: [usize; 3]) -> impl Iterator<Item = usize> {
    (0..nx)
        .flat_map(move |x| (0..ny).flat_map(move |y| (0..nz).map(move |z| x + nx * (y + ny * z))))
}

/// Reads until the buffer is full or the stream ends, and returns the number of bytes.
pub(super) fn fill(reader: &mut dyn Read, buffer: &mut [u8]) -> Result<usize, ReadReason> {
    let mut filled = 0;
    while filled < buffer.len() {
        match reader.read(&mut buffer[filled..]) {
            Ok(0) => break,
            Ok(count) => filled += count,
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            // how a decompressor says that its input is cut short
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => break,
            Err(e) => return Err(ReadReason::Io(e)),
        }
    }
    Ok(filled)
}

/// The value of IEEE 754 half precision bits; exact.
fn half_to_single(bits: u16) -> f32 {
    let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 0x1f), f32::from(bits & 0x3ff));
    sign * match exponent {
        0 => fraction * 2f32.powi(-24),
        31 if fraction == 0.0 => f32::INFINITY,
        31 => f32::NAN,
        _ => (1024.0 + fraction) * 2f32.powi(exponent - 25),
    }
}

/// Writes the samples, each with its least significant byte first.
pub(super) fn write_samples(
    out: &mut dyn Write,
    samples: &Samples,
    format: ImageFormat,
    watch: &mut dyn Watch,
) -> Result<(), WriteReason> {
    /// Writes with one function for each type.
    macro_rules! write_as {
        ($($kind:ident),*) => {
            match samples {
                $(Samples::$kind(v) => spread(out, v, |n| n.to_le_bytes(), watch),)*
                _ => Err(WriteReason::SampleType {
                    format,
                    sample_type: samples.type_name(),
                    expected: "integers up to 32 bits, float32 and float64",
                }),
            }
        };
    }
    write_as!(U8, I8, U16, I16, U32, I32, F32, F64)
}

/// Writes numbers of `N` bytes through a buffer.
fn spread<const N: usize, T: Copy>(
    out: &mut dyn Write,
    numbers: &[T],
    encode: impl Fn(T) -> [u8; N],
    watch: &mut dyn Watch,
) -> Result<(), WriteReason> {
    let mut buffer = Vec::with_capacity(BLOCK.min(numbers.len()) * N);
    for (k, block) in numbers.chunks(BLOCK).enumerate() {
        check(watch, Phase::Write, (k * BLOCK) as f64 / numbers.len() as f64, None)?;
        buffer.clear();
        block.iter().for_each(|&n| buffer.extend_from_slice(&encode(n)));
        out.write_all(&buffer)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(sample_type: SampleType, count: usize) -> Layout {
        Layout {
            sample_type,
            byte_order: ByteOrder::Little,
            count,
            reserve: count,
            scale: None,
            turned: None,
            memory: Memory::default(),
        }
    }

    #[test]
    fn half_precision_has_its_known_values() {
        // the table of examples in IEEE 754's definition of binary16
        for (bits, value) in [
            (0x0000, 0.0),
            (0x0001, 5.960_464_5e-8),
            (0x03ff, 6.097_555e-5),
            (0x0400, 6.103_515_6e-5),
            (0x3555, 0.333_251_95),
            (0x3c00, 1.0),
            (0x3c01, 1.000_976_6),
            (0x7bff, 65504.0),
            (0xc000, -2.0),
            (0x7c00, f32::INFINITY),
            (0xfc00, f32::NEG_INFINITY),
        ] {
            assert_eq!(half_to_single(bits), value, "{bits:#06x}");
        }
        assert!(half_to_single(0x7e00).is_nan());
    }

    #[test]
    fn a_short_stream_reports_whole_samples() {
        let error = read_samples(&mut &[1u8, 2, 3, 4, 5][..], &layout(SampleType::U16, 4));
        assert!(matches!(error.unwrap_err(), ReadReason::Truncated { expected: 4, found: 2 }));
    }

    #[test]
    fn an_absurd_count_fails_without_allocating() {
        let mut absurd = layout(SampleType::U8, usize::MAX / 2);
        absurd.reserve = 10;
        assert!(matches!(
            read_samples(&mut &[0u8; 100][..], &absurd),
            Err(ReadReason::Truncated { found: 100, .. })
        ));
        absurd.memory = Memory::up_to(Some(1 << 30));
        assert!(matches!(
            read_samples(&mut &[0u8; 100][..], &absurd),
            Err(ReadReason::Memory { limit: Some(_), .. })
        ));
        absurd.memory = Memory::default();
        absurd.reserve = absurd.count;
        assert!(matches!(
            read_samples(&mut &[0u8; 100][..], &absurd),
            Err(ReadReason::Memory { .. })
        ));
    }

    #[test]
    fn many_blocks_arrive_in_order_either_way_round() {
        let [nx, ny, nz] = [70, 50, 60]; // more than three blocks
        let count = nx * ny * nz;
        let value = |x: usize, y: usize, z: usize| (x + 100 * y + 10_000 * z) as u32;
        let mut straight = Vec::new();
        for z in 0..nz {
            for y in 0..ny {
                (0..nx).for_each(|x| straight.push(value(x, y, z)));
            }
        }
        let mut turned = Vec::new();
        for x in 0..nx {
            for y in 0..ny {
                (0..nz).for_each(|z| turned.extend(value(x, y, z).to_be_bytes()));
            }
        }
        let from_turned = Layout {
            byte_order: ByteOrder::Big,
            turned: Some([nx, ny, nz]),
            ..layout(SampleType::U32, count)
        };
        let read = read_samples(&mut &turned[..], &from_turned).unwrap();
        assert_eq!(read, Samples::U32(straight.clone().into()));

        let bytes: Vec<u8> = straight.iter().flat_map(|n| n.to_le_bytes()).collect();
        let growing = Layout { reserve: 1, ..layout(SampleType::U32, count) };
        assert_eq!(read_samples(&mut &bytes[..], &growing).unwrap(), read);
    }
}
