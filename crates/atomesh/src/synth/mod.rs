//! Test images whose features are known exactly, made from a seed.
//!
//! A [`Scene`] is drawn in this order: its geometry from the seed, the grey of every sample from the
//! geometry, blur, noise, rounding to bytes. Grey runs from 0 to 255 ([`grey`]). The geometry comes
//! back as a [`Truth`], in the world coordinates of the image, so that a mesh can be compared with
//! what was drawn instead of what was found.
//!
//! Lengths follow the image: positions and radii are shares of its box, lines are about three samples
//! of the coarsest axis wide. The seed alone fixes the geometry, whatever the noise and blur are.
//!
//! Deterministic: the same options give the same bytes at any thread count. The random numbers are
//! PCG-64's, turned into floats here, so that they do not change with the `rand` crate.

mod draw;
mod faults;
mod grains;
mod layers;
mod outlines;
mod random;
mod truth;

#[cfg(test)]
mod tests;

pub use layers::{Fold, Layers};
pub use truth::{Geometry, Role, TrueFeature, Truth};

use crate::geometry::{Bounds, Point};
use crate::image::{Frame, FrameError, Grid, Image, Units};
use std::str::FromStr;

/// The grey levels that scenes use, of 0…255.
pub mod grey {
    /// What surrounds lines: the grey of the paper's Fig. 1.
    pub const BACKGROUND: f64 = 153.0;
    /// The middle of a dark line.
    pub const DARK: f64 = 0.0;
    /// Inside a disc or sphere.
    pub const INSIDE: f64 = 200.0;
    /// Outside a disc or sphere.
    pub const OUTSIDE: f64 = 60.0;
    /// Zero amplitude in a section or volume of layers.
    pub const ZERO: f64 = 128.0;
    /// The greatest amplitude of layers, to both sides of [`ZERO`].
    pub const AMPLITUDE: f64 = 110.0;
}

/// What is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Scene {
    /// 2-D: dark fault traces on grey, a few long and curved, many short, as in Hale (2001), Fig. 1.
    Faults,
    /// 2-D: a bright disc; its outline is the feature.
    Disc,
    /// 2-D: a dark straight slit of finite length.
    Slit,
    /// 2-D: grains of different greys; their boundaries are the features.
    Grains,
    /// 2-D: a vertical seismic section, folded layers cut by faults, as amplitudes.
    Section,
    /// 2-D: the faults of [`Scene::Section`], dark on grey.
    SectionFaults,
    /// 3-D: a bright sphere; its surface is the feature.
    Sphere,
    /// 3-D: grains of different greys; their boundaries are the features.
    Grains3,
    /// 3-D: a seismic volume, folded layers cut by faults, as amplitudes; z is depth.
    Layers,
    /// 3-D: the faults of [`Scene::Layers`], dark on grey.
    LayersFaults,
}

/// Every scene with its name and dimension.
const SCENES: [(Scene, &str, usize); 10] = [
    (Scene::Faults, "faults", 2),
    (Scene::Disc, "disc", 2),
    (Scene::Slit, "slit", 2),
    (Scene::Grains, "grains", 2),
    (Scene::Section, "section", 2),
    (Scene::SectionFaults, "section-faults", 2),
    (Scene::Sphere, "sphere", 3),
    (Scene::Grains3, "grains3", 3),
    (Scene::Layers, "layers", 3),
    (Scene::LayersFaults, "layers-faults", 3),
];

impl Scene {
    /// The names of all scenes, as [`Scene::from_str`] reads them.
    pub const NAMES: [&'static str; SCENES.len()] = {
        let mut names = [""; SCENES.len()];
        let mut i = 0;
        while i < names.len() {
            names[i] = SCENES[i].1;
            i += 1;
        }
        names
    };

    /// The scene's name.
    pub fn name(self) -> &'static str {
        self.entry().1
    }

    /// The dimension of the scene's image: 2 or 3.
    pub fn dimension(self) -> usize {
        self.entry().2
    }

    fn entry(self) -> (Scene, &'static str, usize) {
        // the table is in the order of the variants; a test holds it there
        SCENES[self as usize]
    }
}

impl std::fmt::Display for Scene {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Scene {
    type Err = SynthError;

    fn from_str(name: &str) -> Result<Self, SynthError> {
        match SCENES.iter().find(|entry| entry.1 == name) {
            Some(entry) => Ok(entry.0),
            None => Err(SynthError::Name { name: name.to_owned() }),
        }
    }
}

/// Why an image cannot be drawn.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SynthError {
    /// No scene has the name.
    #[error("no scene is named {name:?}; expected one of {}", Scene::NAMES.join(", "))]
    Name {
        /// The name given.
        name: String,
    },
    /// The scene has another dimension.
    #[error("the scene {scene} is {}-dimensional; the shape has {found} axes", scene.dimension())]
    Dimension {
        /// The scene wanted.
        scene: Scene,
        /// The number of axes given.
        found: usize,
    },
    /// An axis has too few samples to show a feature.
    #[error("{count} samples along axis {axis}; expected at least {LEAST_COUNT}")]
    Count {
        /// 0 for x, 1 for y, 2 for z.
        axis: usize,
        /// The samples along it.
        count: usize,
    },
    /// The box is too thin for its coarsest samples to show a feature.
    #[error(
        "the image is {extent} thin and its samples up to {step} apart; expected at least {} times \
         as much",
        LEAST_COUNT - 1
    )]
    Thin {
        /// The least length of the box along an axis, in world units.
        extent: f64,
        /// The greatest spacing.
        step: f64,
    },
    /// The image does not fit in memory.
    #[error("no memory for an image of shape {shape:?}")]
    Memory {
        /// Samples along x, y (and z).
        shape: Vec<usize>,
    },
    /// The noise is not a share of the contrast.
    #[error("noise {value}; expected a share of the contrast, at least 0 and at most {MOST_NOISE}")]
    Noise {
        /// The share given.
        value: f64,
    },
    /// The blur is negative, too great or not a number.
    #[error("blur {value} samples; expected at least 0 and at most {MOST_BLUR}")]
    Blur {
        /// The standard deviation given.
        value: f64,
    },
    /// The shape or spacing makes no frame.
    #[error(transparent)]
    Frame(#[from] FrameError),
}

/// The fewest samples along an axis: a line and its surroundings.
const LEAST_COUNT: usize = 8;
/// The greatest noise: beyond it nothing of the image is left.
const MOST_NOISE: f64 = 100.0;
/// The greatest blur: beyond it nothing of the image is left, and kernels grow long.
const MOST_BLUR: f64 = 1000.0;

/// How a scene is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SynthOptions<const D: usize> {
    /// Samples along x, y (and z), at least 8 each.
    pub shape: [usize; D],
    /// World units from one sample to the next along each axis. Default 1.
    pub spacing: [f64; D],
    /// Fixes the geometry and the noise. Default 0.
    pub seed: u64,
    /// Standard deviation of the white Gaussian noise added after blurring, as a share of the
    /// contrast, which is the greatest less the least grey before noise. Default 0.
    pub noise: f64,
    /// Standard deviation in samples of the Gaussian that blurs the image. Default 0.
    pub blur: f64,
    /// Round and clip the samples to unsigned bytes; single precision otherwise. Default false.
    pub bytes: bool,
}

impl<const D: usize> SynthOptions<D> {
    /// The defaults for an image of the given shape.
    pub fn new(shape: [usize; D]) -> Self {
        Self { shape, spacing: [1.0; D], seed: 0, noise: 0.0, blur: 0.0, bytes: false }
    }

    /// The frame, if all options are sound.
    fn frame(&self) -> Result<Frame<D>, SynthError> {
        if let Some(axis) = self.shape.iter().position(|&n| n < LEAST_COUNT) {
            return Err(SynthError::Count { axis, count: self.shape[axis] });
        }
        if !(0.0..=MOST_NOISE).contains(&self.noise) {
            return Err(SynthError::Noise { value: self.noise });
        }
        if !(0.0..=MOST_BLUR).contains(&self.blur) {
            return Err(SynthError::Blur { value: self.blur });
        }
        Ok(Frame::new(self.shape)?.with_spacing(self.spacing)?)
    }
}

/// An image and what it shows.
#[derive(Clone, Debug)]
pub struct Synthetic<const D: usize> {
    /// The image, with its origin at 0 and axes along the world's.
    pub image: Image<D>,
    /// The features drawn.
    pub truth: Truth<D>,
}

/// What a scene is drawn on: its box and the steps of its samples, in world units.
#[derive(Clone, Copy, Debug)]
struct Canvas<const D: usize> {
    bounds: Bounds<D>,
    /// The greatest spacing: lines are drawn wide enough for the coarsest axis to show them.
    step: f64,
    /// The spacing along the last axis.
    depth_step: f64,
}

impl<const D: usize> Canvas<D> {
    /// The canvas of a grid whose samples can show something.
    fn new(grid: &Grid<D>) -> Result<Self, SynthError> {
        let step = grid.step.into_iter().fold(0.0, f64::max);
        let canvas = Self { bounds: grid.bounds(), step, depth_step: grid.step[D - 1] };
        let extent = canvas.least_extent();
        if extent < (LEAST_COUNT - 1) as f64 * step {
            return Err(SynthError::Thin { extent, step });
        }
        Ok(canvas)
    }

    /// The point at the given shares of the box, each in 0..=1.
    fn at(&self, shares: &Point<D>) -> Point<D> {
        let extent = self.bounds.extent();
        std::array::from_fn(|k| self.bounds.min[k] + shares[k] * extent[k])
    }

    /// The least length of the box along an axis.
    fn least_extent(&self) -> f64 {
        self.bounds.extent().into_iter().fold(f64::INFINITY, f64::min)
    }

    /// The distance from its middle at which a line's grey is the background's to the last bit.
    fn line_reach(&self) -> f64 {
        1.25 * self.step * 9.0 // exp(−9²/2) is 3e-18, of 153 a thirtieth of a rounding
    }

    /// The grey of a dark line at a distance from its middle: a Gaussian three samples wide.
    fn line(&self, distance: f64) -> f64 {
        let u = distance / (1.25 * self.step);
        grey::BACKGROUND + (grey::DARK - grey::BACKGROUND) * (-0.5 * u * u).exp()
    }
}

/// The grey at a point of the world.
type Shade<const D: usize> = Box<dyn Fn(&Point<D>) -> f64 + Sync>;

/// A scene before it is sampled.
struct Sketch<const D: usize> {
    features: Vec<TrueFeature<D>>,
    layers: Option<Layers<D>>,
    shade: Shade<D>,
}

/// Draws a scene.
///
/// Memory: four bytes a sample; one if rounded to bytes and not blurred, else a byte more. Time: at most
/// about a second for 10 million samples.
///
/// ```
/// use atomesh::synth::{Scene, SynthOptions, synthesize};
/// let options = SynthOptions { noise: 0.1, ..SynthOptions::new([64, 48]) };
/// let disc = synthesize(Scene::Disc, &options)?;
/// assert_eq!(disc.image.samples().len(), 64 * 48);
/// assert!(disc.truth.distance(&[31.5, 23.5]) > 10.0); // the outline is far from the centre
/// # Ok::<(), atomesh::synth::SynthError>(())
/// ```
///
/// # Errors
/// [`SynthError`] if the scene has another dimension or an option is out of its range.
pub fn synthesize<const D: usize>(
    scene: Scene,
    options: &SynthOptions<D>,
) -> Result<Synthetic<D>, SynthError> {
    if scene.dimension() != D {
        return Err(SynthError::Dimension { scene, found: D });
    }
    let frame = options.frame()?;
    let grid = frame.grid(Units::Physical);
    let canvas = Canvas::new(&grid)?;
    let mut random = random::Random::geometry(options.seed);
    let sketch = match scene {
        Scene::Faults => faults::sketch(&canvas, &mut random),
        Scene::Slit => faults::slit(&canvas, &mut random),
        Scene::Disc | Scene::Sphere => outlines::sketch(&canvas, &mut random),
        Scene::Grains | Scene::Grains3 => grains::sketch(&canvas, &mut random),
        Scene::Section | Scene::Layers => layers::amplitudes(&canvas, &mut random),
        Scene::SectionFaults | Scene::LayersFaults => layers::faults(&canvas, &mut random),
    };
    let samples = draw::draw(&sketch.shade, &grid, options)?;
    let Sketch { features, layers, .. } = sketch;
    let truth = Truth { scene, seed: options.seed, grid, features, layers };
    Ok(Synthetic { image: Image::new(frame, samples)?, truth })
}
