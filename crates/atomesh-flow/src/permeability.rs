//! Permeability: one number, a number for each cell, or tensors.

use crate::error::FlowError;

/// A tensor by its rows; symmetric and positive definite if it is a permeability.
pub type Tensor<const D: usize> = [[f64; D]; D];

/// The permeability k of `−∇·(k∇p) = q`, constant in each cell. Any unit.
#[derive(Clone, Debug, PartialEq)]
pub enum Permeability<const D: usize> {
    /// The same in all cells and directions. Above 0.
    Uniform(f64),
    /// The same tensor in all cells.
    UniformTensor(Tensor<D>),
    /// One number for each cell, each above 0.
    Cells(Vec<f64>),
    /// One tensor for each cell.
    CellTensors(Vec<Tensor<D>>),
}

impl<const D: usize> Permeability<D> {
    /// Refuses the first value that is not a permeability.
    ///
    /// # Errors
    /// [`FlowError::Permeability`] names a cell with a number not above 0 and finite, or a tensor that is not
    /// symmetric (to 10⁻¹² of its largest entry) and positive definite; [`FlowError::PermeabilityCount`] says
    /// that there is not one value for each of `cell_count` cells.
    pub fn check(&self, cell_count: usize) -> Result<(), FlowError> {
        let count = match self {
            Self::Cells(values) => values.len(),
            Self::CellTensors(values) => values.len(),
            Self::Uniform(_) | Self::UniformTensor(_) => cell_count,
        };
        if count != cell_count {
            return Err(FlowError::PermeabilityCount { found: count, expected: cell_count });
        }
        let wrong = |cell: usize, tensor: Tensor<D>| {
            let value = tensor.as_flattened().to_vec();
            Err(FlowError::Permeability { cell, value })
        };
        let number = |k: f64| k > 0.0 && k.is_finite();
        match self {
            Self::Uniform(k) if !number(*k) => wrong(0, diagonal(*k)),
            Self::UniformTensor(k) if !is_definite(k) => wrong(0, *k),
            Self::Cells(values) => match values.iter().position(|&k| !number(k)) {
                Some(cell) => wrong(cell, diagonal(values[cell])),
                None => Ok(()),
            },
            Self::CellTensors(values) => match values.iter().position(|k| !is_definite(k)) {
                Some(cell) => wrong(cell, values[cell]),
                None => Ok(()),
            },
            _ => Ok(()),
        }
    }

    /// The tensor of a cell.
    ///
    /// # Panics
    /// If there is no such cell.
    pub fn tensor(&self, cell: usize) -> Tensor<D> {
        match self {
            Self::Uniform(k) => diagonal(*k),
            Self::UniformTensor(k) => *k,
            Self::Cells(values) => diagonal(values[cell]),
            Self::CellTensors(values) => values[cell],
        }
    }

    /// The permeability of a cell as a number; `None` for tensors.
    ///
    /// # Panics
    /// If there is no such cell.
    pub fn scalar(&self, cell: usize) -> Option<f64> {
        match self {
            Self::Uniform(k) => Some(*k),
            Self::Cells(values) => Some(values[cell]),
            Self::UniformTensor(_) | Self::CellTensors(_) => None,
        }
    }

    /// The geometric mean of a cell's principal permeabilities, `det(k)^(1/D)`: the effective permeability around a well.
    ///
    /// # Panics
    /// If there is no such cell.
    pub fn mean(&self, cell: usize) -> f64 {
        self.scalar(cell).unwrap_or_else(|| determinant(&self.tensor(cell)).powf(1.0 / D as f64))
    }
}

fn diagonal<const D: usize>(k: f64) -> Tensor<D> {
    std::array::from_fn(|i| std::array::from_fn(|j| if i == j { k } else { 0.0 }))
}

/// The determinant of the leading rows and columns, for D up to 3.
fn determinant<const D: usize>(k: &Tensor<D>) -> f64 {
    const { assert!(D == 2 || D == 3) };
    if D == 2 {
        return k[0][0] * k[1][1] - k[0][1] * k[1][0];
    }
    k[0][0] * (k[1][1] * k[2][2] - k[1][2] * k[2][1])
        - k[0][1] * (k[1][0] * k[2][2] - k[1][2] * k[2][0])
        + k[0][2] * (k[1][0] * k[2][1] - k[1][1] * k[2][0])
}

/// Symmetric and positive definite: all leading minors are above 0 (Sylvester).
fn is_definite<const D: usize>(k: &Tensor<D>) -> bool {
    let largest = k.as_flattened().iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    let symmetric = (0..D).all(|i| (0..i).all(|j| (k[i][j] - k[j][i]).abs() <= 1e-12 * largest));
    let minor = k[0][0] * k[1][1] - k[0][1] * k[1][0];
    let finite = k.as_flattened().iter().all(|x| x.is_finite());
    finite && symmetric && k[0][0] > 0.0 && minor > 0.0 && determinant(k) > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tensors_must_be_symmetric_and_definite() {
        let check = |k: Tensor<2>| Permeability::UniformTensor(k).check(3).is_ok();
        assert!(check([[2.0, 1.0], [1.0, 1.0]]));
        assert!(!check([[2.0, 1.0], [0.9, 1.0]]), "not symmetric");
        assert!(!check([[1.0, 1.0], [1.0, 1.0]]), "singular");
        assert!(!check([[-2.0, 0.0], [0.0, -1.0]]), "negative");
        assert!(!check([[f64::NAN, 0.0], [0.0, 1.0]]));
        let k =
            Permeability::CellTensors(vec![[[1.0, 0.0, 0.0], [0.0, 8.0, 0.0], [0.0, 0.0, 1.0]]]);
        assert!(k.check(1).is_ok());
        assert!((k.mean(0) - 2.0).abs() < 1e-14, "the cube root of 8");
    }

    #[test]
    fn the_first_cell_that_is_wrong_is_named() {
        let k = Permeability::<3>::Cells(vec![1.0, 2.0, 0.0]);
        assert!(matches!(k.check(3), Err(FlowError::Permeability { cell: 2, .. })));
        assert!(matches!(k.check(4), Err(FlowError::PermeabilityCount { found: 3, expected: 4 })));
    }
}
