//! Pictures as pixels.

use atomesh_draw::{Picture, PictureFormat};

/// The pixels of a PNG, row by row.
pub struct Pixels {
    pub width: usize,
    pub height: usize,
    pub rgb: Vec<[u8; 3]>,
}

impl Pixels {
    /// Decodes a picture.
    pub fn of(picture: &Picture) -> Self {
        let bytes = picture.encode(PictureFormat::Png).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut rgb).unwrap();
        assert_eq!((info.width, info.height), (picture.width(), picture.height()));
        let rgb = rgb.as_chunks().0.to_vec();
        Self { width: info.width as usize, height: info.height as usize, rgb }
    }

    /// The colour at a place.
    pub fn at(&self, x: f64, y: f64) -> [u8; 3] {
        self.rgb[y as usize * self.width + x as usize]
    }
}
