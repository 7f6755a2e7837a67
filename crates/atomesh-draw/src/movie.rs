//! Pictures one after another, as an animated PNG.

use png::{BitDepth, BlendOp, ColorType, DisposeOp, Encoder};

use crate::error::DrawError;
use crate::picture::Picture;
use crate::png_encode::pixels;

/// A picture of a movie and how long it stays.
#[derive(Clone, Debug)]
pub struct MovieFrame {
    /// The picture. One of another size than the first is cut, or filled up with white.
    pub picture: Picture,
    /// How long it stays, in milliseconds.
    pub milliseconds: u16,
}

/// The bytes of an animated PNG of `count` frames, played again and again; the same for the same frames. A program that
/// does not know animated PNG shows the first frame.
///
/// A frame holds what differs from the one before and is transparent elsewhere. Two frames are in memory at a time.
///
/// # Errors
/// What `frame` gives for a number below `count`; [`DrawError::Png`] if there are no frames, or the encoder fails.
pub fn encode_movie<E: From<DrawError>>(
    count: usize,
    mut frame: impl FnMut(usize) -> Result<MovieFrame, E>,
) -> Result<Vec<u8>, E> {
    let failed = |e: png::EncodingError| DrawError::Png { reason: e.to_string() };
    if count == 0 {
        return Err(DrawError::Png { reason: "a movie has one frame or more".into() }.into());
    }
    let first = frame(0)?;
    let size = [first.picture.width, first.picture.height];
    let mut out = Vec::new();
    let mut encoder = Encoder::new(&mut out, size[0], size[1]);
    encoder.set_color(ColorType::Rgba);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_animated(count as u32, 0).map_err(failed)?;
    encoder.set_dispose_op(DisposeOp::None).map_err(failed)?;
    encoder.set_blend_op(BlendOp::Over).map_err(failed)?;
    let mut writer = encoder.write_header().map_err(failed)?;
    let mut shown = vec![[0_u8; 4]; size[0] as usize * size[1] as usize];
    let mut next = Some(first);
    for number in 0..count {
        let MovieFrame { picture, milliseconds } = match next.take() {
            Some(first) => first,
            None => frame(number)?,
        };
        let drawn = pixels(size, &picture.shapes)?;
        let new = drawn.pixels().iter().map(|p| [p.red(), p.green(), p.blue(), 255]);
        let mut changed = vec![[0_u8; 4]; shown.len()];
        for ((changed, shown), new) in changed.iter_mut().zip(&mut shown).zip(new) {
            if *shown != new {
                (*changed, *shown) = (new, new);
            }
        }
        writer.set_frame_delay(milliseconds, 1000).map_err(failed)?;
        writer.write_image_data(changed.as_flattened()).map_err(failed)?;
    }
    writer.finish().map_err(failed)?;
    Ok(out)
}
