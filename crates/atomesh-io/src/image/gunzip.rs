//! What gzip packed: streams one after another, and the zeros that tapes and some programs leave behind them.

use std::io::{self, BufRead, BufReader, Read};

use flate2::bufread::GzDecoder;

use super::error::ReadReason;

/// The magic word of a gzip stream.
pub(super) const GZIP: &[u8] = b"\x1f\x8b";

/// Unpacks streams that follow each other; zeros behind the last of them are passed over.
pub(super) struct Gunzip<R: BufRead> {
    stream: Option<GzDecoder<R>>,
}

impl<R: BufRead> Gunzip<R> {
    /// Unpacks from where `source` is.
    pub fn new(source: R) -> Self {
        Self { stream: Some(GzDecoder::new(source)) }
    }
}

impl<R: BufRead> Read for Gunzip<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if buffer.is_empty() {
            return Ok(0);
        }
        while let Some(stream) = &mut self.stream {
            let count = stream.read(buffer)?;
            if count > 0 {
                return Ok(count);
            }
            let more = self.stream.take().map(GzDecoder::into_inner);
            if let Some(mut source) = more
                && pass_zeros(&mut source)?
            {
                self.stream = Some(GzDecoder::new(source));
            }
        }
        Ok(0)
    }
}

/// Passes over zeros; whether something else comes behind them.
fn pass_zeros(source: &mut impl BufRead) -> io::Result<bool> {
    loop {
        let buffer = source.fill_buf()?;
        if buffer.is_empty() {
            return Ok(false);
        }
        let zeros = buffer.iter().take_while(|byte| **byte == 0).count();
        let is_more = zeros < buffer.len();
        source.consume(zeros);
        if is_more {
            return Ok(true);
        }
    }
}

/// Bytes of a file, unpacked if gzip packed them.
pub(super) struct Unpacked<'a> {
    pub bytes: Box<dyn Read + 'a>,
    /// Whether they were packed.
    pub is_packed: bool,
}

impl<'a> Unpacked<'a> {
    /// Unpacks what begins as gzip's streams do.
    pub fn new(source: impl Read + 'a) -> Result<Self, ReadReason> {
        let mut source = BufReader::with_capacity(1 << 16, source);
        let is_packed = source.fill_buf().map_err(ReadReason::Io)?.starts_with(GZIP);
        let bytes: Box<dyn Read + 'a> =
            if is_packed { Box::new(Gunzip::new(source)) } else { Box::new(source) };
        Ok(Self { bytes, is_packed })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::write::GzEncoder;
    use std::io::Write;

    fn packed(bytes: &[u8]) -> Vec<u8> {
        let mut packed = GzEncoder::new(Vec::new(), flate2::Compression::fast());
        packed.write_all(bytes).unwrap();
        packed.finish().unwrap()
    }

    fn unpack(bytes: &[u8]) -> io::Result<Vec<u8>> {
        let mut found = Vec::new();
        Gunzip::new(BufReader::with_capacity(3, bytes)).read_to_end(&mut found)?;
        Ok(found)
    }

    #[test]
    fn streams_follow_each_other_and_zeros_are_passed_over() {
        let (a, b) = (packed(b"one "), packed(b"two"));
        let zeros = vec![0; 600];
        for file in [
            [&a[..], &b].concat(),
            [&a[..], &b, &zeros].concat(),
            [&a[..], &zeros, &b, &zeros].concat(),
        ] {
            assert_eq!(unpack(&file).unwrap(), b"one two");
        }
        assert!(unpack(&[&a[..], &zeros, b"other"].concat()).is_err());
        assert!(unpack(&a[..a.len() - 1]).is_err());
        let mut broken = a.clone();
        *broken.last_mut().unwrap() ^= 1;
        assert!(unpack(&broken).is_err());
    }
}
