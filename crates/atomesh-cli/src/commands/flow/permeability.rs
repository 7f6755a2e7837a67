//! Permeability as the command line gives it: numbers, a field of the mesh, or an image.

use std::path::Path;

use atomesh::image::Image;
use atomesh::sample::{CellSurfaces, SampleError, SampleOptions, Statistic, sample};
use atomesh_flow::Permeability;
use atomesh_io::image::ImageFormat;

use super::FlowOptions;
use super::ground::{Body, Ground};
use crate::dimension::Dimension;
use crate::failure::Failure;
use crate::frame_options::{self, FrameOptions};
use crate::progress::Progress;

/// The permeability that options ask for.
///
/// # Errors
/// [`Failure`] if there is no such field, the numbers do not make a tensor, or the image cannot be used.
pub fn permeability<const D: usize>(
    options: &FlowOptions,
    frame: &FrameOptions,
    ground: &Ground<D>,
    dimension: &Dimension<D>,
    watch: &mut Progress,
) -> Result<Permeability<D>, Failure> {
    if let Some(path) = &options.permeability_image {
        let image = read(path, frame, ground, dimension, watch)?;
        let statistic = options.permeability_mean.parse().map_err(Failure::misuse)?;
        let values = match &ground.body {
            Body::Polytopes(cells, _) => means(&**cells, &image, statistic, watch),
            Body::Simplices(mesh, _) => means(mesh, &image, statistic, watch),
        };
        return values.map(Permeability::Cells).map_err(|failure| failure.about(path));
    }
    let text = options.permeability.trim();
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    if let Some(numbers) = numbers {
        return tensor(&numbers);
    }
    match ground.cell_fields.iter().find(|field| field.name == text) {
        Some(field) => Ok(Permeability::Cells(field.values.clone())),
        None => {
            let names: Vec<&str> = ground.cell_fields.iter().map(|f| f.name.as_str()).collect();
            let known = if names.is_empty() { "none".to_string() } else { names.join(", ") };
            let message = format!(
                "--permeability {text}; expected numbers, or a cell field of the mesh, which has {known}"
            );
            Err(Failure::misuse(message))
        }
    }
}

/// One number, one for each axis, or the upper triangle of a tensor, row by row.
fn tensor<const D: usize>(numbers: &[f64]) -> Result<Permeability<D>, Failure> {
    let mut tensor = [[0.0; D]; D];
    match numbers.len() {
        1 => return Ok(Permeability::Uniform(numbers[0])),
        count if count == D => (0..D).for_each(|axis| tensor[axis][axis] = numbers[axis]),
        count if count == D * (D + 1) / 2 => {
            let mut next = numbers.iter();
            for row in 0..D {
                for column in row..D {
                    let value = *next.next().expect("as many as the triangle has");
                    (tensor[row][column], tensor[column][row]) = (value, value);
                }
            }
        }
        count => {
            let upper = D * (D + 1) / 2;
            let message =
                format!("--permeability has {count} numbers; expected 1, {D} or {upper} in {D}-D");
            return Err(Failure::misuse(message));
        }
    }
    Ok(Permeability::UniformTensor(tensor))
}

/// Reads the image, placed as the mesh's own where it has no frame.
fn read<const D: usize>(
    path: &Path,
    frame: &FrameOptions,
    ground: &Ground<D>,
    dimension: &Dimension<D>,
    watch: &mut Progress,
) -> Result<Image<D>, Failure> {
    let any = frame_options::read(path, &frame.read_options()?, watch)?;
    let axes = any.dimension();
    let Some(image) = (dimension.image)(any) else {
        let message = format!("has {axes} axes; expected {D}, as the mesh");
        return Err(Failure::content(message).about(path));
    };
    let has_frame = ImageFormat::of(path).is_some_and(ImageFormat::has_frame);
    let known = ground.frame.filter(|f| !has_frame && f.shape() == image.frame().shape());
    match known {
        Some(known) => image.with_frame(known).map_err(Failure::content),
        None => frame.place_as_is(image),
    }
    .map_err(|failure| failure.about(path))
}

/// The mean of the samples in each cell.
fn means<const D: usize>(
    cells: &impl CellSurfaces<D>,
    image: &Image<D>,
    statistic: Statistic,
    watch: &mut Progress,
) -> Result<Vec<f64>, Failure> {
    let statistics = [statistic];
    let found = sample(cells, image, SampleOptions::new(&statistics), watch);
    let mut found = found.map_err(|e| match e {
        SampleError::Cancelled(_) => Failure::cancelled(),
        _ => Failure::content(e),
    })?;
    Ok(found.values.swap_remove(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_make_a_number_axes_or_a_tensor() {
        assert_eq!(tensor::<2>(&[3.0]), Ok(Permeability::Uniform(3.0)));
        let axes = Permeability::UniformTensor([[1.0, 0.0], [0.0, 2.0]]);
        assert_eq!(tensor::<2>(&[1.0, 2.0]), Ok(axes));
        let full = [[1.0, 2.0, 3.0], [2.0, 4.0, 5.0], [3.0, 5.0, 6.0]];
        let numbers = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        assert_eq!(tensor::<3>(&numbers), Ok(Permeability::UniformTensor(full)));
        assert!(tensor::<2>(&[1.0; 4]).unwrap_err().to_string().contains("expected 1, 2 or 3"));
    }
}
