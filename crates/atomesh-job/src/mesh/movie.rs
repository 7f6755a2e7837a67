//! A movie of a run: the atoms between iterations, and at last the mesh.
//!
//! Of all iterations so many frames are kept: where there are more, every second is dropped, and of those to come too.
//! In space only atoms near the slices that are drawn are kept.

use std::ops::ControlFlow;

use atomesh::geometry::Point;
use atomesh::image::{Image, Units};
use atomesh::run::Outcome;
use atomesh::watch::{AtomsView, Phase, Watch, check};
use atomesh_draw::{MovieFrame, Style, encode_movie};

use crate::dimension::Dimension;
use crate::error::JobError;
use crate::session::Session;

/// The most iterations that are kept.
const MOST_FRAMES: usize = 100;

/// How long iterations stay, the first of them, and the mesh, in milliseconds.
const STEP: u16 = 50;
const FIRST: u16 = 600;
const LAST: u16 = 3000;

/// The longest side of a movie in pixels, in the plane and in space, where it shows three slices.
const SIDES: [f64; 2] = [640.0, 900.0];

/// Atoms in sample coordinates: in the plane the first list has all, in space each has those near the slice normal to
/// its axis.
type Atoms<const D: usize> = [Vec<Point<D>>; D];

/// The atoms of a run, recorded.
#[derive(Clone, Debug)]
pub(super) struct Recording<const D: usize> {
    /// The sides of a sample in lattice units.
    step: Point<D>,
    /// The sample at which the slices meet.
    middle: [usize; D],
    frames: Vec<Atoms<D>>,
    /// Every so many iterations one is kept.
    stride: usize,
    seen: usize,
}

impl<const D: usize> Recording<D> {
    /// Nothing yet of a run on that image.
    pub fn new(image: &Image<D>, units: Units) -> Self {
        let frame = image.frame();
        Self {
            step: frame.grid(units).step,
            middle: frame.shape().map(|n| n / 2),
            frames: Vec::new(),
            stride: 1,
            seen: 0,
        }
    }

    /// Whether the next iteration is kept.
    fn is_next(&self) -> bool {
        self.seen.is_multiple_of(self.stride)
    }

    /// Takes the next iteration, with its atoms if it is kept.
    fn keep(&mut self, atoms: Option<Atoms<D>>) {
        self.frames.extend(atoms);
        self.seen += 1;
        if self.frames.len() > MOST_FRAMES {
            let mut number = 0;
            self.frames.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            self.stride *= 2;
        }
    }

    /// The atoms that are drawn: in space those within half their nominal distance of a slice.
    fn shown(&self, atoms: AtomsView<'_>) -> Atoms<D> {
        let mut shown: Atoms<D> = std::array::from_fn(|_| Vec::new());
        for (place, distance) in atoms.coordinates.chunks_exact(D).zip(atoms.distances) {
            let at: Point<D> = std::array::from_fn(|k| place[k] / self.step[k]);
            if D == 2 {
                shown[0].push(at);
                continue;
            }
            for axis in 0..D {
                let off = place[axis] - self.middle[axis] as f64 * self.step[axis];
                if off.abs() <= 0.5 * distance {
                    shown[axis].push(at);
                }
            }
        }
        shown
    }

    /// The movie of the run, over an image; `session` may end the work.
    ///
    /// # Errors
    /// [`JobError`] if it cannot be drawn, or the watch ends the work.
    pub fn encoded(
        &self,
        outcome: &Outcome<D>,
        image: &Image<D>,
        style: &Style,
        dimension: &Dimension<D>,
        session: &mut Session<'_>,
    ) -> Result<Vec<u8>, JobError> {
        // as large as allowed, so that all frames have one size
        let style = Style { max_side: SIDES[D - 2], edge_pixels: 1000.0, ..style.clone() };
        let drawing = &dimension.drawing;
        let count = self.frames.len() + 1;
        encode_movie(count, |number| {
            let ended = check(session, Phase::Draw, number as f64 / count as f64, None);
            ended.map_err(|_| JobError::cancelled())?;
            let (picture, milliseconds) = match (self.frames.get(number), outcome.sample_cells()) {
                (Some(atoms), _) => {
                    let stays = if number == 0 { FIRST } else { STEP };
                    ((drawing.atoms)(image, atoms, &style), stays)
                }
                (None, Some(cells)) => ((drawing.cells)(image, &cells, &style), LAST),
                (None, None) => ((drawing.mesh)(image, &outcome.sample_mesh(), &style), LAST),
            };
            let picture = picture.map_err(JobError::content)?;
            Ok(MovieFrame { picture, milliseconds })
        })
    }
}

/// Records the atoms of a run on their way to a session.
pub(super) struct Recorder<'r, 'w, const D: usize> {
    pub recording: &'r mut Recording<D>,
    pub session: &'r mut Session<'w>,
}

impl<const D: usize> Watch for Recorder<'_, '_, D> {
    fn step(&mut self, phase: Phase, done: f64, energy: Option<f64>) -> ControlFlow<()> {
        self.session.step(phase, done, energy)
    }

    fn atoms(&mut self, phase: Phase, atoms: AtomsView<'_>) {
        let shown = self.recording.is_next().then(|| self.recording.shown(atoms));
        self.recording.keep(shown);
        self.session.atoms(phase, atoms);
    }
}

#[cfg(test)]
mod tests {
    use atomesh::image::{Frame, Samples};

    use super::*;

    #[test]
    fn a_recording_keeps_every_second_of_many_iterations_and_begins_with_the_first() {
        let image = Image::new(Frame::new([4, 4]).unwrap(), Samples::U8(vec![0; 16].into()));
        let mut recording = Recording::new(&image.unwrap(), Units::Samples);
        for number in 0..500 {
            // what the core would show: an atom on its way along x
            let atoms = shown(&recording, f64::from(number));
            recording.keep(atoms);
        }
        let places: Vec<f64> = recording.frames.iter().map(|atoms| atoms[0][0][0]).collect();
        assert!((50..=MOST_FRAMES).contains(&places.len()), "{places:?}");
        assert_eq!(places[0], 0.0);
        assert!(places.windows(2).all(|pair| pair[1] - pair[0] == recording.stride as f64));
    }

    fn shown(recording: &Recording<2>, x: f64) -> Option<Atoms<2>> {
        recording.is_next().then(|| [vec![[x, 1.0]], Vec::new()])
    }
}
