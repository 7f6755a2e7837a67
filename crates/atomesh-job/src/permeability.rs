//! Permeability as options give it: numbers, or the name of a field of the cells.

use atomesh_flow::Permeability;
use atomesh_io::mesh::OwnedField;

use crate::error::JobError;

/// The permeability that a text gives: numbers (one, one for each axis, or the upper triangle of a tensor, row by
/// row), or else the name of one of the fields.
///
/// # Errors
/// [`JobError`] if there is no such field, or the numbers make no permeability.
pub(crate) fn given<const D: usize>(
    text: &str,
    fields: &[OwnedField<f64>],
) -> Result<Permeability<D>, JobError> {
    let text = text.trim();
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    if let Some(numbers) = numbers {
        let permeability = tensor(&numbers)?;
        permeability
            .check(1)
            .map_err(|_| JobError::misuse(format!("--permeability {text}; expected {VALUE}")))?;
        return Ok(permeability);
    }
    if let Some(field) = fields.iter().find(|field| field.name == text) {
        return Ok(Permeability::Cells(field.values.clone()));
    }
    let names: Vec<&str> = fields.iter().map(|field| field.name.as_str()).collect();
    let known = if names.is_empty() { "none".to_string() } else { names.join(", ") };
    let message = format!(
        "--permeability {text}; expected numbers, or a cell field of the mesh, which has {known}"
    );
    Err(JobError::misuse(message))
}

const VALUE: &str = "a number above 0, or a tensor whose principal values are above 0";

/// One number, one for each axis, or the upper triangle of a tensor, row by row.
fn tensor<const D: usize>(numbers: &[f64]) -> Result<Permeability<D>, JobError> {
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
            return Err(JobError::misuse(message));
        }
    }
    Ok(Permeability::UniformTensor(tensor))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_make_a_number_axes_or_a_tensor() {
        assert_eq!(given::<2>("3", &[]), Ok(Permeability::Uniform(3.0)));
        let axes = Permeability::UniformTensor([[1.0, 0.0], [0.0, 2.0]]);
        assert_eq!(given::<2>("1, 2", &[]), Ok(axes));
        let full = [[9.0, 2.0, 3.0], [2.0, 8.0, 5.0], [3.0, 5.0, 7.0]];
        assert_eq!(given::<3>("9,2,3,8,5,7", &[]), Ok(Permeability::UniformTensor(full)));
        for (odd, expected) in [("1,1,1,1", "expected 1, 2 or 3"), ("0", "above 0"), ("k", "none")]
        {
            assert!(given::<2>(odd, &[]).unwrap_err().to_string().contains(expected), "{odd}");
        }
    }

    #[test]
    fn a_name_is_that_of_a_field() {
        let fields = [OwnedField { name: "k".into(), values: vec![1.0, 2.0] }];
        assert_eq!(given::<2>(" k ", &fields), Ok(Permeability::Cells(vec![1.0, 2.0])));
    }
}
