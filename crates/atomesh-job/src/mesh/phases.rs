//! Labels as phases of a material: made by thresholds, left out, with edge lengths of their own.

use atomesh::enhance::without_noise;
use atomesh::fields::default_distance;
use atomesh::image::{Image, Samples};
use atomesh::region::samples_inside;
use atomesh::run::Size;
use rayon::prelude::*;

use crate::error::JobError;
use crate::options::RunConfig;
use crate::session::Session;
use crate::values::{LabelSize, Labels, Numbers, Text};

/// Labels by the thresholds that options give; `None` if they give none.
///
/// # Errors
/// [`JobError`] if they do not ascend, or part nothing.
pub(super) fn by_thresholds<const D: usize>(
    run: &RunConfig,
    image: &Image<D>,
    session: &mut Session<'_>,
) -> Result<Option<Image<D>>, JobError> {
    let Some(given) = &run.regions.threshold else { return Ok(None) };
    let Numbers(thresholds) = given;
    if !thresholds.is_sorted_by(|a, b| a < b) || thresholds.is_empty() {
        let message = format!("--threshold {given}; expected ascending values");
        return Err(JobError::misuse(message));
    }
    if thresholds.len() > 254 {
        let message = format!("{} values of --threshold; expected 254 or fewer", thresholds.len());
        return Err(JobError::misuse(message));
    }
    let clean;
    let image = match run.features.denoise {
        Some(strength) => {
            let units = run.lattice.units.unwrap_or_default();
            clean = without_noise(image, strength, units, session)?;
            &clean
        }
        None => image,
    };
    let samples = image.samples();
    let label = |value: f64| thresholds.partition_point(|&t| t <= value) as u8;
    let labels: Vec<u8> =
        (0..samples.len()).into_par_iter().map(|at| label(samples.get(at))).collect();
    if labels.windows(2).all(|pair| pair[0] == pair[1]) {
        let range = samples.range();
        let message =
            format!("--threshold {given} parts nothing: values are {} to {}", range.min, range.max);
        return Err(JobError::content(message).about_any(run.input.shown()));
    }
    let labels = image.clone().with_samples(Samples::U8(labels.into()));
    labels.map(Some).map_err(JobError::content)
}

/// The mask without the labels that options leave out; `mask` if they leave none out.
///
/// # Errors
/// [`JobError`] if there are no labels, or nothing is left.
pub(super) fn without_voids<const D: usize>(
    run: &RunConfig,
    mask: Option<Image<D>>,
    labels: Option<&Image<D>>,
    session: &mut Session<'_>,
) -> Result<Option<Image<D>>, JobError> {
    let (option, named, keeps) = match (&run.regions.void, &run.regions.only) {
        (None, None) => return Ok(mask),
        (Some(Text(Labels(void))), None) => ("--void", void, false),
        (None, Some(Text(Labels(only)))) => ("--only", only, true),
        (Some(_), Some(_)) => {
            return Err(JobError::misuse("--void and --only; expected one of them"));
        }
    };
    let labels = labels.ok_or_else(|| no_labels(option))?;
    note_unknown(option, named.iter().copied(), labels, session);
    let samples = labels.samples();
    let given = mask.as_ref().map(|mask| samples_inside(mask.samples())).transpose();
    let given = given.map_err(|e| JobError::content(format!("the mask: {e}")))?;
    let is_inside = |at: usize| given.as_ref().is_none_or(|given| given[at]);
    let is_kept = |at: usize| is_of(samples.get(at), named) == keeps && is_inside(at);
    let kept: Vec<u8> =
        (0..samples.len()).into_par_iter().map(|at| u8::from(is_kept(at))).collect();
    if !kept.contains(&1) {
        let message = format!("{option} leaves no sample to mesh");
        return Err(JobError::content(message));
    }
    let mask = Image::new(*labels.frame(), Samples::U8(kept.into()));
    mask.map(Some).map_err(JobError::content)
}

fn is_of(value: f64, labels: &[i32]) -> bool {
    labels.iter().any(|&label| f64::from(label) == value)
}

/// d(x) where labels have lengths of their own; `field` if none has.
///
/// # Errors
/// [`JobError`] if there are no labels, or the length elsewhere is not one.
pub(super) fn sizes<const D: usize>(
    run: &RunConfig,
    field: Option<Image<D>>,
    labels: Option<&Image<D>>,
    session: &mut Session<'_>,
) -> Result<Option<Image<D>>, JobError> {
    let Some(sizes) = run.regions.size_of.as_ref().filter(|sizes| !sizes.is_empty()) else {
        return Ok(field);
    };
    let labels = labels.ok_or_else(|| no_labels("--size-of"))?;
    let options = run.mesh_options::<D>()?;
    let elsewhere = match (field, options.size) {
        (None, Size::Constant(size)) => size,
        (None, Size::Default) => default_distance(&labels.frame().grid(options.units)),
        _ => {
            let message = "--size-of beside lengths that vary; expected one --size, or none";
            return Err(JobError::misuse(message));
        }
    };
    note_unknown("--size-of", sizes.iter().map(|Text(size)| size.label), labels, session);
    let size = |value: f64| {
        let own = sizes.iter().rev().find(|Text(size)| f64::from(size.label) == value);
        own.map_or(elsewhere, |Text(LabelSize { size, .. })| *size) as f32
    };
    let samples = labels.samples();
    let sizes: Vec<f32> =
        (0..samples.len()).into_par_iter().map(|at| size(samples.get(at))).collect();
    let field = Image::new(*labels.frame(), Samples::F32(sizes.into()));
    field.map(Some).map_err(JobError::content)
}

fn no_labels(option: &str) -> JobError {
    JobError::misuse(format!("{option} without labels; expected --labels or --threshold too"))
}

/// Says which labels no sample has.
fn note_unknown<const D: usize>(
    option: &str,
    named: impl Iterator<Item = i32>,
    labels: &Image<D>,
    session: &mut Session<'_>,
) {
    let samples = labels.samples();
    for label in named {
        let has = |at: usize| samples.get(at) == f64::from(label);
        if !(0..samples.len()).into_par_iter().any(has) {
            session.change(format_args!("{option} names label {label}, which no sample has"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::Session;
    use atomesh::image::Frame;
    use atomesh::watch::Silent;

    fn image(values: &[f32]) -> Image<2> {
        let frame = Frame::new([values.len() / 2, 2]).unwrap();
        Image::new(frame, Samples::F32(values.to_vec().into())).unwrap()
    }

    fn run(text: &str) -> RunConfig {
        RunConfig::parse(text).unwrap()
    }

    fn values(image: &Image<2>) -> Vec<f64> {
        (0..image.samples().len()).map(|at| image.samples().get(at)).collect()
    }

    #[test]
    fn thresholds_part_as_numpys_digitize_does() {
        let (image, mut watch) = (image(&[-1.0, 0.5, 0.49, 2.0, 1.99, 7.0]), Silent);
        let session = &mut Session::new(&mut watch);
        let of = |text: &str, session: &mut Session<'_>| by_thresholds(&run(text), &image, session);
        let labels = of("[regions]\nthreshold = [0.5, 2]", session).unwrap().unwrap();
        assert_eq!(values(&labels), [0.0, 1.0, 0.0, 2.0, 1.0, 2.0]);
        assert!(of("", session).unwrap().is_none());
        for bad in ["[2, 0.5]", "[1, 1]", "[]", "[8]", "[-1]"] {
            let text = format!("[regions]\nthreshold = {bad}");
            assert!(of(&text, session).is_err(), "{bad}");
        }
    }

    #[test]
    fn voids_leave_the_mask_and_lengths_are_those_of_labels() {
        let (labels, mut watch) = (image(&[0.0, 1.0, 2.0, 2.0, 1.0, 0.0]), Silent);
        let session = &mut Session::new(&mut watch);
        let mask = Some(image(&[1.0, 1.0, 1.0, 0.0, 1.0, 1.0]));
        let of = |text: &str, mask: Option<Image<2>>, session: &mut Session<'_>| {
            without_voids(&run(&format!("[regions]\n{text}")), mask, Some(&labels), session)
        };
        let kept = of("void = \"0\"", mask.clone(), session).unwrap().unwrap();
        assert_eq!(values(&kept), [0.0, 1.0, 1.0, 0.0, 1.0, 0.0]);
        let kept = of("only = \"0,1\"", None, session).unwrap().unwrap();
        assert_eq!(values(&kept), [1.0, 1.0, 0.0, 0.0, 1.0, 1.0]);
        assert!(of("only = \"7\"", None, session).is_err());
        assert!(session.notes()[0].text.contains("label 7"));
        assert!(without_voids(&run("[regions]\nvoid = \"0\""), mask, None, session).is_err());
        let odd = Some(image(&[1.0, f32::NAN, 1.0, 0.0, 1.0, 1.0]));
        let refusal = of("void = \"0\"", odd, session).unwrap_err();
        assert!(refusal.to_string().contains("NaN"), "{refusal}");

        let text = "[lattice]\nsize = 5.0\n[regions]\nsize-of = [\"1=2\", \"2=3.5\"]";
        let field = sizes(&run(text), None, Some(&labels), session).unwrap().unwrap();
        assert_eq!(values(&field), [5.0, 2.0, 3.5, 3.5, 2.0, 5.0]);
        let graded = text.replace("5.0\n", "\"5..9\"\n");
        assert!(sizes(&run(&graded), None, Some(&labels), session).is_err());
    }
}
